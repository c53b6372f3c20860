"""Types of command line arguments; each complains in words of what it expected."""

import argparse
from pathlib import Path

SEEDS = 2**31
"""Seeds end before this."""


def whole(text: str) -> int:
    """A whole number."""
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no whole number") from None


def seed(text: str) -> int:
    """A seed of NumPy's generators."""
    value = whole(text)
    if not 0 <= value < SEEDS:
        raise argparse.ArgumentTypeError("expected a whole number from 0 to 2^31 - 1")
    return value


def folder(text: str) -> Path:
    """A folder, which may not be there yet."""
    if not text:
        raise argparse.ArgumentTypeError("expected the name of a folder")
    return Path(text)


def harmonics(text: str) -> int:
    """Harmonics of a motion at rest at both ends."""
    value = whole(text)
    if value < 2:
        raise argparse.ArgumentTypeError("a motion at rest at both ends needs 2 or more")
    return value


def not_negative(text: str) -> float:
    """A finite number, 0 or more."""
    value = float(text)
    if not 0.0 <= value < float("inf"):
        raise argparse.ArgumentTypeError("expected a number that is not negative")
    return value


def count(text: str) -> int:
    """A whole number, 1 or more."""
    value = whole(text)
    if value < 1:
        raise argparse.ArgumentTypeError("expected 1 or more")
    return value


def positive(text: str) -> float:
    """A finite number above 0."""
    value = float(text)
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError("expected a positive number")
    return value
