"""Content of a report: paragraphs, tables, plots, and the result as one JSON object."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import TypeVar

from scenarios.rendering.plot import Plot
from scenarios.rendering.wording import NONE, Number, sentence

Item = TypeVar("Item")


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
        parts = [replace(each, file_only=False, shown=None) if isinstance(each, Table) else each for each in self.parts]
        return replace(self, parts=tuple(parts))


def _value(text: str) -> object:
    try:
        return text.value if isinstance(text, Number) else int(text) if text.isdigit() else float(text)
    except ValueError:
        return None if text == NONE else text


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

    def written(value: str | int | Cell | None) -> Cell:
        if isinstance(value, Cell):
            return value
        return Cell(value if isinstance(value, str) else NONE if value is None else str(value))

    rows = tuple(tuple(written(cell(item)) for _, cell in columns) for item in items)
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
