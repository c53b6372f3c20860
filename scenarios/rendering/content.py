"""Content of a report: paragraphs, tables, plots, and the result as one JSON object; numbers as they are printed."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import TypeVar

from ident.support.naming import enumerated
from scenarios.rendering.plot import Plot

Item = TypeVar("Item")

NONE = "-"
"""Placeholder for a missing number."""


class Number(str):
    """A number as it is printed, and its `value` in the unit of its column."""

    value: float


class Mood(Enum):
    """Assessment of a text or cell; a renderer may colour it."""

    PLAIN = "plain"
    GOOD = "good"
    DOUBTFUL = "doubtful"
    BAD = "bad"


@dataclass(frozen=True, slots=True)
class Cell:
    """One entry of a table."""

    text: str
    mood: Mood = Mood.PLAIN


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """A column of a table."""

    title: str
    unit: str = ""  # of its numbers, empty if dimensionless
    words: bool = False  # left-aligned, numbers right-aligned
    file_only: bool = False  # omitted on a screen

    @property
    def heading(self) -> str:
        """The title on one line."""
        return " ".join(self.title.split())


VERDICT = Column(title="Verdict", words=True)
"""Heading of the last column, the verdict of a row."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """A table."""

    title: str = ""  # one line above it
    columns: tuple[Column, ...]  # the first ones identify a row
    rows: tuple[tuple[Cell, ...], ...]
    shown: int | None = None  # number of rows on a screen, 0 for a table shown only on request; None for all
    rest: str = ""  # text on a screen instead of the other rows
    file_only: bool = False  # too large for a screen

    @property
    def keys(self) -> int:
        """Number of columns that identify a row: the first ones that make all rows distinct, otherwise one."""
        counts = range(1, len(self.columns))
        return next((k for k in counts if len({row[:k] for row in self.rows}) == len(self.rows)), 1)

    @property
    def values(self) -> dict[str, list[object]]:
        """Values of each column in full precision, None for a dash; a name ends with the unit in brackets."""
        found = dict[str, list[object]]()
        for k, each in enumerate(self.columns):
            name = f"{each.heading} [{each.unit}]" if each.unit else each.heading
            name = f"{self.columns[k - 1].heading}, {name}" if name in found else name
            found[name] = [_value(row[k].text) for row in self.rows]
        return found

    @property
    def verdict_early(self) -> "Table":
        """The table with its verdict after the first column, visible on a narrow page."""
        order = sorted(range(len(self.columns)), key=lambda k: (k > 0, self.columns[k] != VERDICT))
        columns = tuple(self.columns[k] for k in order)
        return replace(self, columns=columns, rows=tuple(tuple(row[k] for k in order) for row in self.rows))


@dataclass(frozen=True, slots=True)
class Paragraph:
    """One or more sentences, their assessment, and whether they are the main statement."""

    text: str
    mood: Mood = Mood.PLAIN
    strong: bool = False


@dataclass(frozen=True, slots=True)
class Line:
    """A line that is never wrapped: a command for copying."""

    text: str


@dataclass(frozen=True, slots=True)
class Heading:
    """A heading; `file_only` omits it on a screen."""

    text: str
    file_only: bool = False


@dataclass(frozen=True, slots=True)
class Picture:
    """A raster image, the bytes of a PNG file, shown on pages and omitted in text."""

    caption: str
    png: bytes


Part = Paragraph | Line | Heading | Table | Plot | Picture


@dataclass(frozen=True, slots=True)
class Report:
    """The report of a result: texts, tables and plots."""

    title: str
    parts: tuple[Part, ...]  # in order, the verdict first, if there is one
    document: Mapping[str, object]  # the result for programs, as JSON values
    mood: Mood = Mood.PLAIN  # of a title that is the verdict

    @property
    def in_full(self) -> "Report":
        """The report with all its tables on a screen."""
        parts = [replace(each, file_only=False) if isinstance(each, Table) else each for each in self.parts]
        return replace(self, parts=tuple(parts))


def _value(text: str) -> object:
    try:
        return text.value if isinstance(text, Number) else int(text) if text.isdigit() else float(text)
    except ValueError:
        return None if text == NONE else text


def cells(*texts: str | Cell) -> tuple[Cell, ...]:
    """Return a row of a table."""
    return tuple(text if isinstance(text, Cell) else Cell(text) for text in texts)


ColumnOf = tuple[Column, Callable[[Item], str | int | Cell | None]]
"""A column and its value for an item; a count is written unchanged, None as a dash."""


def column(
    title: str, cell: Callable[[Item], str | int | Cell | None], *, words: bool = False, file_only: bool = False
) -> ColumnOf[Item]:
    """Return a column of numbers or words; the title may end with a unit in brackets."""
    name, _, unit = title.rpartition(" [") if title.endswith("]") else (title, "", "")
    return Column(title=name, unit=unit.removesuffix("]"), words=words, file_only=file_only), cell


def table(
    items: Iterable[Item],
    *columns: ColumnOf[Item],
    title: str = "",
    shown: int | None = None,
    rest: str = "",
    file_only: bool = False,
) -> Table:
    """Return a table with one row per item; `title` to `file_only` as in `Table`."""

    def written(value: str | int | Cell | None) -> str | Cell:
        return value if isinstance(value, Cell | str) else NONE if value is None else str(value)

    rows = tuple(cells(*(written(cell(item)) for _, cell in columns)) for item in items)
    heads = tuple(head for head, _ in columns)
    return Table(title=title, columns=heads, rows=rows, shown=shown, rest=rest, file_only=file_only)


def pairs_table(first: str, second: str, pairs: Mapping[str, str], shown: int | None = None, rest: str = "") -> Table:
    """Return a table of names and values."""
    value = column(second, pairs.__getitem__, words=True)
    return table(pairs, column(first, str, words=True), value, shown=shown, rest=rest)


def verdict(text: str, passed: bool) -> Paragraph:
    """Return the verdict of a result, the main statement."""
    word, mood = ("PASSED", Mood.GOOD) if passed else ("FAILED", Mood.BAD)
    return Paragraph(sentence(f"{word}: {text}"), mood, strong=True)


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


def two_sigma(std: float | None, form: str = ".2f") -> str:
    """Return two standard deviations in percent, from a relative standard deviation."""
    return percent(None if std is None else 2.0 * std, form)


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
