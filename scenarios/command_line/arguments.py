"""Types of command-line arguments, with messages that state the expected form."""

import argparse
import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TypeVar

from ident.support.naming import shown
from scenarios.experiments.scenario_files import SEEDS

Number = TypeVar("Number", int, float)
AUTO = "auto"
"""Word in place of a number that is to be estimated."""
GAINS_ENDINGS = (".json", ".toml")


def whole(text: str) -> int:
    """A whole number."""
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{shown(text)} is not a whole number") from None


def number(text: str) -> float:
    """A finite number."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{shown(text)} is not a number") from None
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"expected a finite number, got {shown(text)}")
    return value


def within(kind: Callable[[str], Number], least: float, most: float, expected: str) -> Callable[[str], Number]:
    """Return a type: a number between bounds, both included."""

    def bounded(text: str) -> Number:
        value = kind(text)
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"expected {expected}")
        return value

    return bounded


seed = within(whole, 0, SEEDS - 1, "a whole number from 0 to 2^31 - 1")
count = within(whole, 1, math.inf, "1 or more")
not_negative = within(number, 0.0, math.inf, "a number of 0 or more")


def count_from(least: int, most: int, why: str) -> Callable[[str], int]:
    """Return a type: a whole number between bounds, both included."""
    return within(whole, least, most, f"a whole number from {least} to {most}: {why}")


def number_from(least: float, most: float, unit: str, why: str) -> Callable[[str], float]:
    """Return a type: a number between bounds, both included."""
    return within(number, least, most, f"{least:g} to {most:g} {unit}: {why}")


def numbers(text: str) -> tuple[float, ...]:
    """Finite numbers, separated by commas."""
    return tuple(map(number, text.split(",")))


def number_or_auto(text: str) -> float | str:
    """A finite number, or the word for one that is estimated."""
    try:
        return text if text == AUTO else number(text)
    except argparse.ArgumentTypeError as error:
        raise argparse.ArgumentTypeError(f"{error}, and not {AUTO}") from None


def names(text: str) -> tuple[str, ...]:
    """Different names, separated by commas."""
    each = tuple(name.strip() for name in text.split(","))
    if not all(each) or len(set(each)) < len(each):
        raise argparse.ArgumentTypeError("expected names, each once, separated by commas")
    return each


def file(text: str) -> Path:
    """A file."""
    if not text:
        raise argparse.ArgumentTypeError("expected the name of a file")
    return Path(text)


def folder(text: str) -> Path:
    """A folder, which may not exist yet."""
    if not text:
        raise argparse.ArgumentTypeError("expected the name of a folder")
    if Path(text).is_file():
        raise argparse.ArgumentTypeError(f"{shown(text)} is a file; expected a folder")
    return Path(text)


def gains_file(text: str, known: Sequence[str] = GAINS_ENDINGS) -> Path:
    """A file whose name has one of the endings, those of a file of gains; they determine the format."""
    path = file(text)
    if path.suffix.lower() not in known:
        raise argparse.ArgumentTypeError(f"{shown(text)}: expected a file name that ends with {' or '.join(known)}")
    return path


def gains_or_numbers(text: str) -> Path | tuple[float, ...]:
    """A file of gains, or the gains of all joints, separated by commas."""
    if "," in text and Path(text).suffix.lower() not in GAINS_ENDINGS:
        return numbers(text)
    try:
        return gains_file(text)
    except argparse.ArgumentTypeError as error:
        raise argparse.ArgumentTypeError(f"{error}, or numbers such as 12,12,10") from None


parquet_file = partial(gains_file, known=(".parquet",))
load_file = partial(gains_file, known=(".json", ".script"))
FILES = (file, gains_file, parquet_file, load_file)
"""Types that a shell completes with files."""
