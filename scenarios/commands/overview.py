"""The command line as a whole: its commands, exit statuses and version, and the parser of all commands."""

import argparse
import shutil
import textwrap
from collections.abc import Collection, Sequence

from scenarios.command_line.arguments import add_quiet_argument
from scenarios.command_line.parser import OneLineParser
from scenarios.command_line.status import MEANINGS, Status
from scenarios.command_line.streams_and_signals import tell
from scenarios.commands import COMMANDS, GROUPS, command

PURPOSE = "Testbench and identification of robot drive gains."
FIRST = "rx90 COMMAND --help shows its options. Begin with: rx90 run nominal"


def overview() -> str:
    """Return the commands in order of use, formatted for the terminal."""
    indent = max(map(len, COMMANDS)) + 4
    parts = [_filled(PURPOSE)]
    for title, commands in GROUPS.items():
        lines = [_filled(f"  {name:<{indent - 4}}  {summary}", indent) for name, summary in commands.items()]
        parts.append("\n".join([f"{title}:", *lines]))
    return "\n\n".join([*parts, _filled(FIRST)])


def statuses() -> str:
    """Return the exit statuses with their meanings."""
    lines = [_filled(f"  {status:<4} {meaning}", 7) for status, meaning in MEANINGS.items()]
    return "\n".join(["exit statuses:", *lines])


def _filled(text: str, indent: int = 0) -> str:
    return textwrap.fill(text, shutil.get_terminal_size().columns - 2, subsequent_indent=" " * indent)


class Version(argparse.Action):
    """Prints the versions that results depend on."""

    def __init__(self, option_strings: Sequence[str], dest: str) -> None:
        super().__init__(option_strings, argparse.SUPPRESS, nargs=0, help="versions that results depend on")

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[object] | None,
        option_string: str | None = None,
    ) -> None:
        """Print and exit."""
        tell(version_text())
        parser.exit(Status.PASSED)


def version_text() -> str:
    """Return the versions of this project and of packages, one per line."""
    from importlib.metadata import PackageNotFoundError  # slow import

    from scenarios.support.versions import PACKAGES, versions

    try:
        found = versions()
    except PackageNotFoundError as error:
        return f"rx90 (not installed: {error.name})\n"
    project, *_ = PACKAGES
    others = [f"{name} {version}" for name, version in found.items() if name != project]
    return "\n".join([f"rx90 {found[project]}", *others, ""])


def parser_of(wanted: Collection[str]) -> OneLineParser:
    """Return the parser. Only commands in `wanted` are imported, for their arguments."""
    parser = OneLineParser(
        prog="rx90",
        usage="rx90 [-h] [--version] COMMAND ...",
        description=overview(),
        epilog=statuses(),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=Version)
    commands = parser.add_subparsers(prog="rx90", metavar="COMMAND", help=argparse.SUPPRESS)
    for name, summary in COMMANDS.items():
        below = commands.add_parser(name, help=summary, description=f"{summary[0].upper()}{summary[1:]}.")
        if name in wanted:
            command(name).add_arguments(below)
            add_quiet_argument(below)
    return parser
