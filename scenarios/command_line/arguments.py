"""Types of command-line arguments, with messages that state the expected form."""

import argparse
import math
import os
from collections.abc import Callable
from pathlib import Path

from scenarios.experiments.scenario_files import SEEDS

LONGEST = 40
"""Number of characters of an argument in a message."""
AUTO = "auto"
"""Word in place of a number that is to be estimated."""


def is_text(word: str) -> bool:
    """Return whether an argument is UTF-8; records, log formats and MuJoCo support no other file names."""
    return not any("\ud800" <= c <= "\udfff" for c in word)


def escaped(word: str) -> str:
    """Return an argument; bytes that are not UTF-8 are escaped as in Python."""
    return os.fsencode(word).decode("utf-8", "backslashreplace")


def quoted(text: str) -> str:
    """Return an argument or its beginning."""
    return repr(text) if len(text) <= LONGEST else f"{text[:LONGEST]!r}..."


def whole(text: str) -> int:
    """A whole number."""
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{quoted(text)} is not a whole number") from None


def number(text: str) -> float:
    """A finite number."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{quoted(text)} is not a number") from None
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"expected a finite number, got {quoted(text)}")
    return value


def seed(text: str) -> int:
    """A seed of NumPy's generators."""
    value = whole(text)
    if not 0 <= value < SEEDS:
        raise argparse.ArgumentTypeError("expected a whole number from 0 to 2^31 - 1")
    return value


def folder(text: str) -> Path:
    """A folder, which may not exist yet."""
    if not text:
        raise argparse.ArgumentTypeError("expected the name of a folder")
    path = Path(text)
    if path.is_file():
        raise argparse.ArgumentTypeError(f"{quoted(text)} is a file; expected a folder")
    return path


def file(text: str) -> Path:
    """A file."""
    if not text:
        raise argparse.ArgumentTypeError("expected the name of a file")
    return Path(text)


def not_negative(text: str) -> float:
    """A finite number, 0 or more."""
    value = number(text)
    if value < 0.0:
        raise argparse.ArgumentTypeError("expected a number of 0 or more")
    return value


def number_or_auto(text: str) -> float | str:
    """A finite number, or the word for one that is estimated."""
    try:
        return text if text == AUTO else number(text)
    except argparse.ArgumentTypeError as error:
        raise argparse.ArgumentTypeError(f"{error}, and not {AUTO}") from None


def count(text: str) -> int:
    """A whole number, 1 or more."""
    value = whole(text)
    if value < 1:
        raise argparse.ArgumentTypeError("expected 1 or more")
    return value


def count_from(least: int, most: int, why: str) -> Callable[[str], int]:
    """Return a type: a whole number between bounds, both included."""

    def bounded(text: str) -> int:
        value = whole(text)
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"expected a whole number from {least} to {most}: {why}")
        return value

    return bounded


def number_from(least: float, most: float, unit: str, why: str) -> Callable[[str], float]:
    """Return a type: a number between bounds, both included."""

    def bounded(text: str) -> float:
        value = number(text)
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"expected {least:g} to {most:g} {unit}: {why}")
        return value

    return bounded


def add_force_argument(parser: argparse.ArgumentParser, more: str = "") -> None:
    """Declare --force, which allows overwriting files of others; `more` states what else it allows."""
    parser.add_argument("--force", action="store_true", help=f"overwrite files that this command did not write{more}")


def add_quiet_argument(parser: argparse.ArgumentParser) -> None:
    """Declare --quiet, which suppresses progress but not notes and errors."""
    parser.add_argument("--quiet", action="store_true", help="no progress on standard error")
