"""A parser with one-line errors that accepts every option once."""

import argparse
import re
import shutil
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, NoReturn

from ident.support.naming import nearest
from scenarios.command_line.arguments import quoted
from scenarios.command_line.process import Status, complain, write

if TYPE_CHECKING:
    from _typeshed import SupportsWrite

GIVEN = "options given"
"""Attribute of a namespace for given options; the name has a space, so no option can have it."""


NARROW = 60
"""Width of a terminal below which a usage line does not list the options."""


NEGATIVE = re.compile(r"-\.?\d")
"""How a value begins that is no option: a negative number, or a list of numbers of which the first is negative."""


class OneLineParser(argparse.ArgumentParser):
    """A parser with one-line errors; options may not be abbreviated or repeated."""

    def __init__(self, **settings: object) -> None:
        super().__init__(allow_abbrev=False, **settings)  # type: ignore[arg-type] # argparse's own, passed by itself
        self._negative_number_matcher = NEGATIVE
        for name in (None, "store"):
            self.register("action", name, StoreOnce)
        self.register("action", "store_true", TrueOnce)

    def format_help(self) -> str:
        """Return the help; on a narrow terminal the usage line omits the options."""
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

    def _check_value(self, action: argparse.Action, value: object) -> None:
        """Check choices; unlike argparse, suggest the nearest one."""
        if action.choices is not None and value not in action.choices:
            names = [str(choice) for choice in action.choices]
            raise argparse.ArgumentError(
                action,
                f"invalid choice: {quoted(str(value))}{nearest(str(value), names)}; known: {', '.join(names)}",
            )

    def error(self, message: str) -> NoReturn:
        """Report an error and exit with status 2."""
        complain(f"{message}; see {self.prog} --help", self.prog)
        sys.exit(Status.BAD_INPUT)


class StoreOnce(argparse.Action):
    """Store a value, and refuse a second one."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[object] | None,
        option_string: str | None = None,
    ) -> None:
        """Store it.

        Raises:
            argparse.ArgumentError: If there is one already.
        """
        given: set[str] = namespace.__dict__.setdefault(GIVEN, set())
        if self.dest in given and self.option_strings:
            raise argparse.ArgumentError(self, "given twice; give it once")
        given.add(self.dest)
        setattr(namespace, self.dest, values)


class TrueOnce(StoreOnce):
    """Switch something on."""

    def __init__(self, option_strings: Sequence[str], dest: str, default: bool = False, help: str | None = None):
        super().__init__(option_strings, dest, nargs=0, default=default, help=help)

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[object] | None,
        option_string: str | None = None,
    ) -> None:
        """Switch it on."""
        super().__call__(parser, namespace, None, option_string)
        setattr(namespace, self.dest, True)
