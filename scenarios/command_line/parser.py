"""A parser whose complaints are one line, and that takes every option once."""

import argparse
import contextlib
import re
import shutil
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, NoReturn

from ident.support.naming import nearest
from scenarios.command_line.arguments import quoted
from scenarios.command_line.status import Status
from scenarios.command_line.streams_and_signals import tell

if TYPE_CHECKING:
    from _typeshed import SupportsWrite

GIVEN = "options given"
"""Attribute of a namespace that remembers them; with a space, so that no option can have its name."""


NARROW = 60
"""Columns of a terminal on which a usage line that names every option would not fit."""


NEGATIVE = re.compile(r"-\.?\d")
"""How a value begins that is no option: a negative number, or a list of numbers of which the first is negative."""


class OneLineParser(argparse.ArgumentParser):
    """A parser whose complaints are one line; options are spelled out, and not given twice."""

    def __init__(self, **settings: object) -> None:
        super().__init__(allow_abbrev=False, **settings)  # type: ignore[arg-type] # argparse's own, passed by itself
        self._negative_number_matcher = NEGATIVE
        for name in (None, "store"):
            self.register("action", name, StoreOnce)
        self.register("action", "store_true", TrueOnce)

    def format_help(self) -> str:
        """The help; on a narrow terminal its first line leaves to the list which options there are."""
        if shutil.get_terminal_size().columns < NARROW:
            places = [action.metavar or action.dest for action in self._actions if not action.option_strings]
            self.usage = " ".join(["%(prog)s", *map(str, places), "..."])
        return super().format_help()

    def _print_message(self, message: str, file: "SupportsWrite[str] | None" = None) -> None:
        """Tell; argparse would take it for told if the disk is full."""
        tell(message)

    def parse_known_args(  # pyright: ignore[reportIncompatibleMethodOverride] # as it is called by argparse itself
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        """Parse; what nobody takes is refused where it stands, before anything is missed that may be there mistyped."""
        if self._subparsers is None:
            self._refuse([word for word in args or () if self._is_no_option(word)])
        parsed, left = super().parse_known_args(args, namespace or argparse.Namespace())
        self._refuse(left)
        return parsed, left

    def _is_no_option(self, word: str) -> bool:
        """Whether argparse would take a word for an option, and there is none of that name."""
        name = word.partition("=")[0]
        return name.startswith("--") and len(name) > 2 and " " not in word and name not in self._option_string_actions

    def _refuse(self, words: Sequence[str]) -> None:
        """Complain about words that nobody takes, with the option that may have been meant."""
        if words:
            options = [word.partition("=")[0] for word in words if word.startswith("-")]
            advice = nearest(options[0], self._option_string_actions) if options else ""
            self.error(f"unrecognized arguments: {' '.join(words)}{advice}")

    def _check_value(self, action: argparse.Action, value: object) -> None:
        """Refuse what is none of the choices; argparse would not say which one was meant."""
        if action.choices is not None and value not in action.choices:
            names = [str(choice) for choice in action.choices]
            raise argparse.ArgumentError(
                action,
                f"invalid choice: {quoted(str(value))}{nearest(str(value), names)}; known: {', '.join(names)}",
            )

    def error(self, message: str) -> NoReturn:
        """Complain and exit with status 2."""
        complain(f"{message}; see {self.prog} --help", self.prog)
        sys.exit(Status.BAD_INPUT)


class StoreOnce(argparse.Action):
    """Store a value; a second one would replace the first in silence."""

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


def complain(message: str, program: str = "rx90") -> None:
    """Say what is wrong in one line on stderr, whatever characters the message has."""
    with contextlib.suppress(OSError):  # nobody may be left to read it
        print(f"{program}: {printable(message)}", file=sys.stderr)  # noqa: T201


def printable(text: str) -> str:
    """The text in one line of characters that any file and terminal takes; others are escaped as Python does."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)
