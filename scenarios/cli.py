"""The command line `rx90`: parses it, imports only the requested command, converts its outcome to an exit status."""

import argparse
import os
import re
import shlex
import shutil
import sys
import textwrap
import traceback
from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, NoReturn

from ident.support.errors import IdentificationError
from ident.support.naming import nearest, needed_extra, shown
from scenarios.command_line import arguments
from scenarios.command_line.process import OUTPUT, Status, abandon, complain, ending, own_process, write
from scenarios.commands import COMMANDS, EXAMPLES, FIRST, GROUPS, NEEDED, command
from scenarios.experiments.scenario_files import builtin_names, find_scenario
from scenarios.support.errors import ScenarioError
from scenarios.support.texts import continued
from sim.errors import SimulationError

if TYPE_CHECKING:
    from _typeshed import SupportsWrite

TRACEBACK = "RX90_TRACEBACK"
"""Environment variable that requests the traceback of an unexpected error."""
PURPOSE = "Testbench and identification of robot drive gains."
LAST = "rx90 COMMAND --help shows its options and two examples."
COMPLETION, SHELLS = "--print-completion", ("bash", "zsh", "tcsh", "fish", "powershell")
"""Option, and shells whose completion shtab writes."""
NARROWEST, NARROW = 20, 60
"""Smallest width that text is wrapped to, and width below which a usage line does not list the options."""
NEGATIVE = re.compile(r"-\.?\d")
"""How a value begins that is no option: a negative number, or a list of numbers of which the first is negative."""


def main(words: Sequence[str] | None = None) -> int:
    """Run the command line; by default with the arguments of the process.

    Returns:
        The exit status; a command line that cannot be parsed exits at once with status 2, help with 0.
    """
    words = list(sys.argv[1:] if words is None else words)
    try:
        with own_process():
            if shutil.get_terminal_size().columns < NARROWEST:
                os.environ["COLUMNS"] = str(NARROWEST)
            try:
                return _carried_out(words)
            finally:
                write("")  # output is written before the status is known
    except (IdentificationError, SimulationError, ScenarioError) as error:
        complain(str(error))
        return Status.BAD_INPUT
    except KeyboardInterrupt as interrupt:
        complain("stopped")
        return ending(interrupt)
    except BrokenPipeError:
        abandon(sys.stdout)
        return Status.NOBODY_READS
    except OSError as error:
        complain(f"{error.filename}: {error.strerror}" if error.filename else str(error))
        if error.filename != OUTPUT:
            return Status.BAD_INPUT
        abandon(sys.stdout)
        return Status.NO_OUTPUT
    except MemoryError:
        complain("not enough memory; give shorter logs, or --jobs 1 to a study")
        return Status.BAD_INPUT
    except Exception as error:  # a traceback would end with status 1, that of a missed tolerance
        if os.environ.get(TRACEBACK):
            traceback.print_exc()
        absent = isinstance(error, ModuleNotFoundError)
        known = needed_extra(error.name, NEEDED.get(next(iter(words), ""))) if absent else None
        unforeseen = f"{type(error).__name__}: {error}: internal error; please report it ({TRACEBACK}=1 shows where)"
        complain(known or unforeseen)
        return Status.BAD_INPUT if known else Status.UNFORESEEN


def _carried_out(words: list[str]) -> Status:
    """Parse and run a command; only this one is imported."""
    if not words:
        write(f"{overview()}\n")
        return Status.PASSED
    name = next((word for word in words if not word.startswith("-")), None) if COMPLETION not in words else None
    parser = parser_of([] if name is None else [name])
    if name is not None and name not in COMMANDS:
        known = f"; known: {', '.join(COMMANDS)}"
        parser.error(f"no command {shown(name)}{nearest(name, COMMANDS) or known}")
    for word in words:  # records, log formats and MuJoCo support no other names of files
        if any("\ud800" <= c <= "\udfff" for c in word):
            escaped = os.fsencode(word).decode("utf-8", "backslashreplace")
            parser.error(f"{escaped}: the name is not UTF-8; rename the file or folder")
    options = parser.parse_args(words)
    if options.version or options.print_completion:
        write(_completion(options.print_completion) if options.print_completion else _versions())
        return Status.PASSED
    if name is None:
        parser.error("which command?")
    if "scenario" in options:
        find_scenario(options.scenario)  # report a mistyped name before slow imports
    options.command_line = shlex.join([parser.prog, *words])  # for the records
    return command(name).main(options)


def overview() -> str:
    """Return the commands in order of use, formatted for the terminal."""
    indent = max(map(len, COMMANDS)) + 4
    parts = [_filled(PURPOSE), _listed("begin with", FIRST)]
    for title, commands in GROUPS.items():
        lines = [_filled(f"  {name:<{indent - 4}}  {summary}", indent) for name, summary in commands.items()]
        parts.append("\n".join([f"{title}:", *lines]))
    return "\n\n".join([*parts, _filled(LAST)])


def _listed(title: str, commands: Iterable[str]) -> str:
    """Return commands below a title, continued on further lines of the terminal."""
    width = shutil.get_terminal_size().columns - 4
    return "\n".join([f"{title}:", *(textwrap.indent(continued(each, width), "  ") for each in commands)])


def _filled(text: str, indent: int = 0) -> str:
    width = shutil.get_terminal_size().columns - 2
    return textwrap.fill(text, width, subsequent_indent=" " * indent, break_on_hyphens=False)


def _versions() -> str:
    """Return the versions of this project and of packages, one per line."""
    from importlib.metadata import PackageNotFoundError  # slow import

    from scenarios.support.versions import PACKAGES, versions

    try:
        found = versions()
    except PackageNotFoundError as error:
        return f"rx90 (not installed: {error.name})\n"
    others = [f"{name} {version}" for name, version in found.items() if name != PACKAGES[0]]
    return "\n".join([f"rx90 {found[PACKAGES[0]]}", *others, ""])


def _completion(shell: str) -> str:
    """Return the completion of a shell, as by shtab: commands, options, scenarios, files and folders."""
    import shtab

    whole = parser_of(COMMANDS)
    for action in _actions(whole):
        if isinstance(action, argparse._SubParsersAction):  # pyright: ignore[reportPrivateUsage]
            action.help = "what to do"  # shtab skips commands without help
        elif action.choices is not None:
            action.choices = [str(choice) for choice in action.choices]
        elif action.type in (*arguments.FILES, arguments.folder) or action.dest == "given":
            kind = shtab.DIRECTORY if action.type is arguments.folder else shtab.FILE
            action.complete = kind  # pyright: ignore[reportAttributeAccessIssue] # where shtab looks for it
        elif action.metavar in ("SCENARIO", "SCENARIO|FOLDER"):
            action.choices = builtin_names()
    return shtab.complete(whole, shell) + "\n"


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """Yield all arguments of a parser and of its commands."""
    for action in parser._actions:  # pyright: ignore[reportPrivateUsage] # argparse has no other way to list them
        yield action
        if isinstance(action, argparse._SubParsersAction):  # pyright: ignore[reportPrivateUsage]
            for below in action.choices.values():
                yield from _actions(below)


class WordFormatter(argparse.HelpFormatter):
    """Breaks lines at spaces only; a text of several lines stays as it is."""

    def _split_lines(self, text: str, width: int) -> list[str]:
        return textwrap.wrap(text, width, break_on_hyphens=False)

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        lines = [text] if "\n" in text else self._split_lines(text, width - len(indent))
        return textwrap.indent("\n".join(lines), indent)


class OneLineParser(argparse.ArgumentParser):
    """A parser with one-line errors; options may not be abbreviated or repeated."""

    def __init__(self, **settings: object) -> None:
        super().__init__(allow_abbrev=False, formatter_class=WordFormatter, **settings)  # type: ignore[arg-type] # argparse's own, passed by itself
        self._negative_number_matcher = NEGATIVE
        self._given = set[argparse.Action]()

    def format_help(self) -> str:
        """Return the help with examples; on a narrow terminal the usage line omits the options."""
        if own := [line for line in EXAMPLES if line.split()[1] == self.prog.partition(" ")[2]]:
            self.epilog = _listed("examples", own)
        if shutil.get_terminal_size().columns < NARROW:
            places = [action.metavar or action.dest for action in self._actions if not action.option_strings]
            self.usage = " ".join(["%(prog)s", *map(str, places), "..."])
        return super().format_help()

    def _print_message(self, message: str, file: "SupportsWrite[str] | None" = None) -> None:
        """Print; unlike argparse, report an error if it cannot be written."""
        write(message)

    def parse_known_args(  # pyright: ignore[reportIncompatibleMethodOverride] # as it is called by argparse itself
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        """Parse; unknown words are reported before missing ones, which may be mistyped."""
        self._given.clear()
        if self._subparsers is None:
            self._refuse([word for word in args or () if self._is_no_option(word)])
        parsed, left = super().parse_known_args(args, namespace or argparse.Namespace())
        self._refuse(left)
        return parsed, left

    def _is_no_option(self, word: str) -> bool:
        """Return whether a word looks like an option but is unknown."""
        name = word.partition("=")[0]
        return name.startswith("--") and len(name) > 2 and " " not in word and name not in self._option_string_actions

    def _refuse(self, words: Sequence[str]) -> None:
        """Report unknown words, with the nearest option."""
        if words:
            options = [word.partition("=")[0] for word in words if word.startswith("-")]
            advice = nearest(options[0], self._option_string_actions) if options else ""
            self.error(f"unrecognized arguments: {' '.join(words)}{advice}")

    def _get_values(self, action: argparse.Action, arg_strings: list[str]) -> object:
        """Convert the words of an argument; unlike argparse, refuse a second value of an option that stores one."""
        if action.option_strings and type(action).__name__ in ("_StoreAction", "_StoreTrueAction"):
            if action in self._given:
                raise argparse.ArgumentError(action, "given twice; give it once")
            self._given.add(action)
        return super()._get_values(action, arg_strings)

    def _check_value(self, action: argparse.Action, value: object) -> None:
        """Check choices; unlike argparse, suggest the nearest one."""
        if action.choices is not None and value not in action.choices:
            names = [str(choice) for choice in action.choices]
            advice = f"{nearest(str(value), names)}; known: {', '.join(names)}"
            raise argparse.ArgumentError(action, f"invalid choice: {shown(str(value))}{advice}")

    def error(self, message: str) -> NoReturn:
        """Report an error and exit with status 2."""
        complain(f"{message}; see {self.prog} --help", self.prog)
        sys.exit(Status.BAD_INPUT)


def parser_of(wanted: Collection[str]) -> OneLineParser:
    """Return the parser. Only commands in `wanted` are imported, for their arguments."""
    statuses = [_filled(f"  {status:<4} {status.meaning}", 7) for status in Status]
    parser = OneLineParser(
        prog="rx90",
        usage="rx90 [-h] [--version] [--print-completion SHELL] COMMAND ...",
        description=overview(),
        epilog="\n".join(["exit statuses:", *statuses]),
    )
    parser.add_argument("--version", action="store_true", help="versions that results depend on")
    text = 'print the completion of a shell, e.g. eval "$(rx90 --print-completion bash)" in ~/.bashrc'
    parser.add_argument(COMPLETION, choices=SHELLS, metavar="SHELL", help=text)
    commands = parser.add_subparsers(prog="rx90", metavar="COMMAND", help=argparse.SUPPRESS)
    for name, summary in COMMANDS.items():
        below = commands.add_parser(name, help=summary, description=f"{summary[0].upper()}{summary[1:]}.")
        if name in wanted:
            command(name).add_arguments(below)
            below.add_argument("--quiet", action="store_true", help="no progress on standard error")
    return parser
