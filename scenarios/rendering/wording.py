"""Numbers, joints and sentences as they are printed."""

import math
from collections.abc import Sequence

from ident.support.naming import enumerated

NONE = "-"
"""Placeholder for a missing number."""


class Number(str):
    """A number as it is printed, and its `value` in the unit of its column."""

    value: float


def number(value: float | None, form: str, unit: str = "") -> str:
    """Return a number with its unit, a dash for None; zero has no minus sign, the last digit no point after it."""
    if value is None:
        return NONE
    sign = form[:1] if form[:1] in "+- " else ""
    text = Number(f"{value:{sign}z{form.removeprefix(sign)}}".removesuffix(".") + unit)
    text.value = value
    return text


def percent(share: float | None, form: str = ".3f") -> str:
    """Return a share in percent, without the sign, which is in the heading; a dash for None."""
    return number(None if share is None else 100.0 * share, form)


def percent_range(low: float, high: float, form: str = ".3f") -> str:
    """Return an interval of shares in percent."""
    return f"{percent(low, form)}..{percent(high, form)}"


def twice(std: float | None) -> float | None:
    """Return two standard deviations."""
    return None if std is None else 2.0 * std


def two_sigma(std: float | None, form: str = ".2f") -> str:
    """Return two standard deviations in percent, from a relative standard deviation."""
    return percent(twice(std), form)


def rounded(value: float | None, spread: float | None) -> str:
    """Return a number to two digits of its standard deviation (same unit), or to four decimals; None is a dash."""
    return number(value, f".{max(1 - math.floor(math.log10(spread)), 0) if spread else 4}f")


def in_unit(unit: str, *numbers: float | None) -> tuple[str, tuple[float | None, ...]]:
    """Return a unit and numbers in it; lengths below a metre in millimetres."""
    if unit != "m" or any(abs(each) >= 1.0 for each in numbers if each is not None):
        return unit, numbers
    return "mm", tuple(None if each is None else 1e3 * each for each in numbers)


def plus_minus(value: float, spread: float) -> str:
    """Return number and uncertainty (same unit), rounded to the first digit of the latter, two digits if it is a 1."""
    if spread == 0.0:
        return f"{value:.6g}"
    first = f"{spread:.1e}"
    places = max((first[0] == "1") - int(first.partition("e")[2]), 0)
    return f"{value:z.{places}f} ± {spread:.{places}f}"


def joints_named(joints: Sequence[int]) -> str:
    """`joint 2`, `joints 1 and 4` or `joints 1 to 5`, of joints from 1."""
    adjacent = len(joints) > 2 and list(joints) == list(range(joints[0], joints[-1] + 1))
    numbers = f"{joints[0]} to {joints[-1]}" if adjacent else enumerated([str(joint) for joint in joints])
    return f"{'joints' if joints[1:] else 'joint'} {numbers}"


def sentence(text: str) -> str:
    """Return a text with a full stop, unless it is a question."""
    return text if text.endswith("?") else f"{text}."


def many(count: int, what: str) -> str:
    """`1 check`, `2 checks`."""
    return f"{count} {what}{'' if count == 1 else 's'}"
