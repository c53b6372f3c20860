"""Plots as values: series of numbers with labels, units and a manner of drawing, for pages; text leaves them out."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # a command that draws nothing needs no NumPy
    from ident.support.arrays import Array

Value = float | str | None
"""A number or the name of a category; None is a gap."""
DIGITS = 5
"""Significant digits of a number in a plot: a screen shows three."""


class Mark(Enum):
    """How a series is drawn."""

    LINE = "line"
    POINTS = "points"
    BARS = "bars"
    STACK = "stack"
    INTERVALS = "intervals"


class Tone(Enum):
    """What sets a series apart from others: each has a colour, a dash and a shape of its own."""

    FIRST = "first"
    SECOND = "second"
    THIRD = "third"
    FOURTH = "fourth"
    FIFTH = "fifth"
    SIXTH = "sixth"
    QUIET = "quiet"


TONES = (Tone.FIRST, Tone.SECOND, Tone.THIRD, Tone.FOURTH)
MANY = (*TONES, Tone.FIFTH, Tone.SIXTH)
"""Of parts of a whole, which need not be told apart by more than a place in a stack."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Axis:
    """An axis of a plot.

    Attributes:
        title: What is along it.
        unit: Of its numbers, empty where they have none.
        categories: Names along it in their order, empty for an axis of numbers.
        log: Whether equal factors are equally far.
        zero: Whether 0 is on it.
    """

    title: str
    unit: str = ""
    categories: tuple[str, ...] = ()
    log: bool = False
    zero: bool = False

    @property
    def words(self) -> str:
        """Title, its first letter a capital, and unit."""
        title = self.title[:1].upper() + self.title[1:]
        return f"{title} [{self.unit}]" if self.unit else title


@dataclass(frozen=True, slots=True, kw_only=True)
class Series:
    """Numbers that belong together.

    Attributes:
        label: What they are, in a legend.
        mark: How they are drawn.
        tone: What sets them apart.
        x, y: Places, of one length.
        low, high: Ends of `INTERVALS` and of parts of a `STACK` on the axis of numbers, empty for other marks.
    """

    label: str
    mark: Mark
    tone: Tone = Tone.FIRST
    x: tuple[Value, ...]
    y: tuple[Value, ...]
    low: tuple[float | None, ...] = ()
    high: tuple[float | None, ...] = ()


@dataclass(frozen=True, slots=True)
class Reference:
    """A line across a plot: a limit, or the border between two motions."""

    label: str
    at: float
    upright: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Plot:
    """A plot.

    Attributes:
        title: One line above it.
        caption: What one sees in it, a sentence or two; how numbers were left out, if they were.
        x, y: The axes.
        series: In the order they are drawn, the last on top.
        bands: Stretches of the x axis that are shaded, from and to.
        bands_label: What they are.
        references: Lines across.
        zoom: Whether one may want to look closer along x.
        height: Of its axes [pixel].
        strip: What stands below it along the same x, on a scale of its own; None for nothing.
    """

    title: str
    caption: str
    x: Axis
    y: Axis
    series: tuple[Series, ...]
    bands: tuple[tuple[float, float], ...] = ()
    bands_label: str = ""
    references: tuple[Reference, ...] = ()
    zoom: bool = False
    height: int = 180
    strip: "Plot | None" = None


def values(numbers: "Sequence[float] | Array") -> tuple[float | None, ...]:
    """Numbers as a plot keeps them: `DIGITS` significant digits, None where there is no number."""
    return tuple(float(f"{x:.{DIGITS}g}") if math.isfinite(x) else None for x in map(float, numbers))


def intervals(label: str, x: Sequence[str], ends: Sequence[tuple[float, float, float]], tone: Tone) -> Series:
    """Intervals of categories. `ends` are the value, its lower and its upper end."""
    value, low, high = (values([each[k] for each in ends]) for k in range(3))
    return Series(label=label, mark=Mark.INTERVALS, tone=tone, x=tuple(x), y=value, low=low, high=high)


def about(value: float, half: float) -> tuple[float, float, float]:
    """A value with the ends of an interval that reaches as far either way."""
    return value, value - half, value + half


def one_in(count: int, most: int) -> int:
    """One in how many points is drawn so that no more than `most` are."""
    return max(1, -(-count // most))
