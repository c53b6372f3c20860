"""What a report says, as values: paragraphs, tables, figures, and the same as one JSON object."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING, Generic, TypeVar

from scenarios.reports.plot import Plot

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

Item = TypeVar("Item")

NONE = "-"
"""Stands where there is no number."""


class Mood(Enum):
    """How something is to be taken; a renderer may colour it."""

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
    """A column of a table.

    Attributes:
        title: Its heading.
        unit: Of its numbers, empty where they have none.
        words: Whether it holds words, which stand left, not numbers, which stand right.
        file_only: Whether a screen leaves it out.
    """

    title: str
    unit: str = ""
    words: bool = False
    file_only: bool = False


VERDICT = Column(title="Verdict", words=True)
"""The column that says how a row ended, the last one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """A table.

    Attributes:
        title: One line above it, empty for none.
        columns: Headings; the first columns, as many as tell the rows apart, say what a row is about.
        rows: Cells, one tuple a row.
        shown: Rows that are enough for a screen, 0 for a table to be asked for; None for all.
        rest: What a screen says in place of the others.
        file_only: Whether it is too large for a screen.
    """

    title: str = ""
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    shown: int | None = None
    rest: str = ""
    file_only: bool = False

    @property
    def keys(self) -> int:
        """How many columns say what a row is about: the first ones that tell rows apart, one if none do."""
        counts = range(1, len(self.columns))
        return next((k for k in counts if len({row[:k] for row in self.rows}) == len(self.rows)), 1)

    @property
    def verdict_early(self) -> "Table":
        """The same with its verdict behind the first column, where a narrow page shows it too."""
        if VERDICT not in self.columns:
            return self
        last = self.columns.index(VERDICT)
        order = [0, last, *(k for k in range(1, len(self.columns)) if k != last)]
        columns, rows = (
            tuple(self.columns[k] for k in order),
            tuple(tuple(row[k] for k in order) for row in self.rows),
        )
        return replace(self, columns=columns, rows=rows)


@dataclass(frozen=True, slots=True)
class Paragraph:
    """A sentence or more, how it is to be taken, and whether it is what one reads first."""

    text: str
    mood: Mood = Mood.PLAIN
    strong: bool = False


@dataclass(frozen=True, slots=True)
class Line:
    """A line to be copied, never broken: a command."""

    text: str


@dataclass(frozen=True, slots=True)
class Heading:
    """A heading within a report.

    Attributes:
        text: The words.
        folded: Whether a page shows what is below it only when asked.
    """

    text: str
    folded: bool = False


@dataclass(frozen=True, slots=True)
class Figure:
    """A picture.

    Attributes:
        name: Of its file, without ending.
        caption: One line.
        draw: Draws it; called only where a picture is wanted.
        endings: Formats it is saved in; the first is shown.
    """

    name: str
    caption: str
    draw: "Callable[[], Drawing]"
    endings: tuple[str, ...] = ("png",)


@dataclass(frozen=True, slots=True)
class Picture:
    """A photograph, as it were, that a page shows and text leaves out.

    Attributes:
        caption: What is on it.
        png: The file's bytes.
        width, height: Its size [pixel].
    """

    caption: str
    png: bytes
    width: int
    height: int


@dataclass(frozen=True, slots=True)
class Facts:
    """What a page shows at a glance, and text says elsewhere: names and values."""

    pairs: tuple[tuple[str, str], ...]


Part = Paragraph | Line | Heading | Table | Figure | Plot | Picture | Facts


@dataclass(frozen=True, slots=True)
class Report:
    """A result in words, tables and figures.

    Attributes:
        title: One line.
        parts: In the order one reads: the verdict first, if there is one.
        document: The same for programs, as JSON values.
        mood: Of a title that is the verdict.
    """

    title: str
    parts: tuple[Part, ...]
    document: Mapping[str, object]
    mood: Mood = Mood.PLAIN


def number(value: float | None, form: str, unit: str = "") -> str:
    """A number with its unit, a dash for none."""
    return NONE if value is None else f"{value:{form}}{unit}"


def percent(share: float | None, form: str = ".3f") -> str:
    """A share in percent, without the sign: the heading has it. A dash for none."""
    return number(None if share is None else 100.0 * share, form)


def two_sigma(std: float | None, form: str = ".2f") -> str:
    """Two standard deviations, given one as a share, in percent."""
    return percent(None if std is None else 2.0 * std, form)


def rounded(value: float | None, spread: float | None) -> str:
    """A number with as many decimals as two digits of its spread need; four where there is none. A dash for none.

    Both have one unit.
    """
    return number(value, f".{max(1 - math.floor(math.log10(spread)), 0) if spread else 4}f")


def in_unit(unit: str, *numbers: float | None) -> tuple[str, tuple[float | None, ...]]:
    """A unit and numbers in it; lengths below a metre in millimetres."""
    if unit != "m" or any(abs(each) >= 1.0 for each in numbers if each is not None):
        return unit, numbers
    return "mm", tuple(None if each is None else 1e3 * each for each in numbers)


def plus_minus(value: float, spread: float) -> str:
    """A number and what it may be off by, both rounded to the first digit of the latter, or two where that is a 1.

    Both have one unit.
    """
    if spread == 0.0:
        return f"{value:.6g}"
    first = f"{spread:.1e}"
    places = max((first[0] == "1") - int(first.partition("e")[2]), 0)
    return f"{value:.{places}f} +- {spread:.{places}f}"


def cells(*texts: str | Cell) -> tuple[Cell, ...]:
    """A row of a table."""
    return tuple(text if isinstance(text, Cell) else Cell(text) for text in texts)


@dataclass(frozen=True, slots=True)
class ColumnOf(Generic[Item]):
    """A column, and what stands in it for an item: a count is written as it is, nothing as a dash."""

    column: Column
    cell: Callable[[Item], str | int | Cell | None]


def column(
    title: str, cell: Callable[[Item], str | int | Cell | None], *, words: bool = False, file_only: bool = False
) -> ColumnOf[Item]:
    """A column of numbers, or of words; a unit stands in brackets at the end of the title."""
    name, _, unit = title.rpartition(" [") if title.endswith("]") else (title, "", "")
    return ColumnOf(Column(title=name, unit=unit.removesuffix("]"), words=words, file_only=file_only), cell)


def table(
    items: Iterable[Item], *columns: ColumnOf[Item], title: str = "", shown: int | None = None, rest: str = ""
) -> Table:
    """A table with a row an item; `title`, `shown` and `rest` as of `Table`."""
    rows = tuple(tuple(_cell(each.cell(item)) for each in columns) for item in items)
    return Table(title=title, columns=tuple(each.column for each in columns), rows=rows, shown=shown, rest=rest)


def pairs_table(first: str, second: str, pairs: Mapping[str, str], shown: int | None = None, rest: str = "") -> Table:
    """A table of names and what stands for each."""
    return table(
        pairs, column(first, str, words=True), column(second, pairs.__getitem__, words=True), shown=shown, rest=rest
    )


def _cell(value: str | int | Cell | None) -> Cell:
    return value if isinstance(value, Cell) else Cell(NONE if value is None else str(value))
