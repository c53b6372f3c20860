"""Plots as data: series with labels, units and styles, for pages; text output omits them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:  # a command without plots does not need NumPy
    from ident.support.arrays import Array

Value = float | str | None
"""A number or the name of a category; None for a gap."""
DIGITS = 5
"""Significant digits of a number in a plot."""
Mark = Literal["line", "points", "bars", "intervals"]
"""How a series is drawn."""
Tone = Literal["first", "second", "third", "fourth", "quiet"]
"""Style of a series: colour, dash and shape."""
TONES: tuple[Tone, ...] = ("first", "second", "third", "fourth")


@dataclass(frozen=True, slots=True, kw_only=True)
class Axis:
    """An axis of a plot.

    Attributes:
        title: Name of the quantity.
        unit: Unit of its numbers, empty if dimensionless.
        categories: Names along it in order, empty for an axis of numbers.
        log: Whether the axis is logarithmic.
        zero: Whether the axis includes 0.
    """

    title: str
    unit: str = ""
    categories: tuple[str, ...] = ()
    log: bool = False
    zero: bool = False

    @property
    def words(self) -> str:
        """Return title, capitalised, and unit."""
        title = self.title[:1].upper() + self.title[1:]
        return f"{title} [{self.unit}]" if self.unit else title


def joint_axis(joints: Sequence[int]) -> Axis:
    """Return the axis of joints, from 1, as categories."""
    return Axis(title="joint", categories=tuple(map(str, joints)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Series:
    """A data series.

    Attributes:
        label: Label in the legend, empty for none.
        mark: Type of mark.
        tone: Style.
        x, y: Coordinates, of equal length.
        low, high: Ends of intervals, and of rules on bars; empty for other marks.
    """

    label: str = ""
    mark: Mark = "line"
    tone: Tone = "first"
    x: tuple[Value, ...]
    y: tuple[Value, ...]
    low: tuple[float | None, ...] = ()
    high: tuple[float | None, ...] = ()


@dataclass(frozen=True, slots=True)
class Reference:
    """A reference line: a limit, or the border between two motions."""

    label: str
    at: float
    upright: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Plot:
    """A plot.

    Attributes:
        title: One line above it.
        caption: Explanation in one or two sentences, including omitted data.
        x, y: The axes.
        series: Series in drawing order, the last on top.
        bands: Shaded intervals of the x axis, start and end.
        bands_label: Label of the bands.
        references: Reference lines.
        zoom: Whether it is along time, and wide.
        height: Height of the axes [pixel].
        strip: Plot below it with the same x axis and its own y scale; None for none.
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
    """Return numbers rounded to `DIGITS` significant digits, None for NaN."""
    return tuple(float(f"{x:.{DIGITS}g}") if math.isfinite(x) else None for x in map(float, numbers))


def intervals(label: str, x: Sequence[str], ends: Sequence[tuple[float, float, float]], tone: Tone) -> Series:
    """Return a series of intervals of categories. `ends` has value, lower and upper end."""
    value, low, high = (values([each[k] for each in ends]) for k in range(3))
    return Series(label=label, mark="intervals", tone=tone, x=tuple(x), y=value, low=low, high=high)


def about(value: float, half: float) -> tuple[float, float, float]:
    """Return a value with the ends of a symmetric interval."""
    return value, value - half, value + half
