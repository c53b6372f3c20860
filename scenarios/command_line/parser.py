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

NARROW = 60
"""Width of a terminal below which a usage line does not list the options."""
NEGATIVE = re.compile(r"-\.?\d")
"""How a value begins that is no option: a negative number, or a list of numbers of which the first is negative."""


class OneLineParser(argparse.ArgumentParser):
    """A parser with one-line errors; options may not be abbreviated or repeated."""

    def __init__(self, **settings: object) -> None:
        super().__init__(allow_abbrev=False, **settings)  # type: ignore[arg-type] # argparse's own, passed by itself
        self._negative_number_matcher = NEGATIVE
        self._given = set[argparse.Action]()

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
            raise argparse.ArgumentError(action, f"invalid choice: {quoted(str(value))}{advice}")

    def error(self, message: str) -> NoReturn:
        """Report an error and exit with status 2."""
        complain(f"{message}; see {self.prog} --help", self.prog)
        sys.exit(Status.BAD_INPUT)
