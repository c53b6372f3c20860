"""Report as aligned text.

If a table is too wide, first the gaps are reduced, then words are wrapped. If this is not enough, the table is split:
further columns follow below, with the identifying columns repeated, so that no number is cut.
"""

import shlex
from collections.abc import Mapping, Sequence
from io import StringIO
from itertools import pairwise
from textwrap import wrap

from rich.cells import cell_len
from rich.console import Console
from rich.table import Table as Grid
from rich.text import Text

from scenarios.rendering import Page
from scenarios.rendering.content import (
    Cell,
    Column,
    Heading,
    Line,
    Mood,
    Paragraph,
    Part,
    Picture,
    Report,
    Table,
)
from scenarios.rendering.plot import Plot

WIDE = 10_000
"""Characters per line if unlimited."""
GAPS = (2, 1)
"""Preferred and least number of spaces between columns."""
HANGING = "  "
"""Indentation of continuation lines of a note."""
EVERY_ROW = "--format markdown shows them"
"""Where rows that are left out can be read."""
GOES_ON, INDENT = " \\", "  "
"""End of a continued command line, and beginning of the next one."""
STYLES = {Mood.PLAIN: "", Mood.GOOD: "green", Mood.DOUBTFUL: "yellow", Mood.BAD: "red"}


def render(report: Report, page: Page) -> str:
    """Render title and parts, related parts without an empty line; figures are omitted."""
    width = page.width or WIDE
    console = Console(
        file=StringIO(),
        width=WIDE,
        force_terminal=page.colour,
        color_system="auto" if page.colour else None,
        highlight=False,
        markup=False,
        emoji=False,
    )
    with console.capture() as capture:
        bold = "" if report.mood is Mood.PLAIN else "bold "
        _print_words(report.title, f"{bold}{STYLES[report.mood]}", console, width)
        before: Part | None = None
        for part in filter(_is_text, report.parts):
            if not _together(before, part):
                console.print()
            _print(part, console, width)
            before = part
    return "\n".join(line.rstrip() for line in capture.get().split("\n"))


def _is_text(part: Part) -> bool:
    return not isinstance(part, Plot | Picture) and not (isinstance(part, Heading | Table) and part.file_only)


def _together(before: Part | None, part: Part) -> bool:
    """Return whether two parts are not separated by an empty line: consecutive notes, a heading and its part."""
    if isinstance(before, Heading):
        return True
    notes = isinstance(before, Paragraph) and not before.strong
    return notes and (isinstance(part, Line) or (isinstance(part, Paragraph) and not part.strong))


def _print(part: Part, console: Console, width: int) -> None:
    match part:
        case Paragraph(text, mood, strong=True):
            _print_words(text, f"bold {STYLES[mood]}".strip(), console, width)
        case Paragraph(text, mood):
            _print_words(text, STYLES[mood], console, width, HANGING)
        case Line(text):
            console.print(continued(text, width), soft_wrap=True)
        case Heading(text):
            _print_words(text, "bold", console, width)
        case Table():
            _print_table(part, console, width)
        case Plot() | Picture():
            pass


def _print_words(text: str, style: str, console: Console, width: int, hanging: str = "") -> None:
    """Print wrapped text; a word wider than the page, such as a path, is not broken."""
    lines = wrap(text, width, subsequent_indent=hanging, break_long_words=False, break_on_hyphens=False)
    console.print(Text("\n".join(lines), style=style), soft_wrap=True)


def continued(command: str, width: int) -> str:
    """Return a command on continued lines; a line is wider than the page only if one word is."""
    words = [shlex.quote(word) for word in shlex.split(command)]
    if len(command) <= width or " ".join(words) != command:
        return command
    lines = words[:1]
    for word, after in pairwise([*words[1:], "-"]):
        beside = f"{word} {after}" if word.startswith("-") and not after.startswith("-") else word  # option and value
        if len(f"{lines[-1]} {beside}{GOES_ON}") > width:
            lines[-1] += GOES_ON
            lines.append(f"{INDENT}{word}")
        else:
            lines[-1] += f" {word}"
    return "\n".join(lines)


def _print_table(table: Table, console: Console, width: int) -> None:
    if table.title:
        _print_words(table.title, "bold", console, width)
    rows = table.rows[: table.shown]
    seen = [k for k, column in enumerate(table.columns) if not column.file_only]
    columns = [(table.columns[k], [row[k] for row in rows]) for k in seen]
    widths = [_width(*column) for column in columns]
    least = [_least(*column, width) for column in columns]
    keys = sum(k < table.keys for k in seen)
    fits = len(blocks(widths, width, keys)) == 1
    for count, (gap, block) in enumerate(blocks(widths if fits else least, width, keys)):
        if count:
            console.print()
        folded = fold({k: (least[k], widths[k]) for k in block}, width - gap * (len(block) - 1))
        grid = Grid(box=None, pad_edge=False, collapse_padding=True, padding=(0, gap, 0, 0), header_style="bold")
        units = any(columns[k][0].unit for k in block)
        for k in block:
            column, _ = columns[k]
            header = f"{column.title}\n{column.unit}" if units else column.title
            justify = "left" if column.words else "right"
            grid.add_column(header, justify=justify, width=folded[k], no_wrap=not column.words, overflow="fold")
        for row in zip(*(columns[k][1] for k in block), strict=True):
            grid.add_row(*(Text(cell.text, style=STYLES[cell.mood]) for cell in row))
        console.print(grid, soft_wrap=True)
    if len(table.rows) > len(rows) and table.rest:
        _print_words(f"{table.rest} ({EVERY_ROW})", "", console, width)


def blocks(widths: Sequence[int], page: int, keys: int = 1) -> list[tuple[int, tuple[int, ...]]]:
    """Return the split of columns and their gap. The first `keys` columns identify a row.

    Returns:
        The gap and the columns of each part, including the first ones. One part if the columns fit with a gap of
        `GAPS`; otherwise as many parts as needed, each with at least one further column.
    """
    for gap in GAPS:
        if sum(widths) + gap * (len(widths) - 1) <= page:
            return [(gap, tuple(range(len(widths))))]
    first = list(range(keys))
    parts = [first.copy()]
    for k in range(keys, len(widths)):
        used = sum(widths[c] for c in parts[-1]) + GAPS[0] * len(parts[-1])
        if len(parts[-1]) > keys and used + widths[k] > page:
            parts.append(first.copy())
        parts[-1].append(k)
    return [(GAPS[0], tuple(part)) for part in parts]


def fold(widths: Mapping[int, tuple[int, int]], page: int) -> dict[int, int]:
    """Reduce the widths of columns, always of the widest reducible one, until all fit a page.

    `widths` has, by column index, the least and the preferred width; `page` excludes gaps.

    Returns:
        The widths; their sum exceeds the page if that of the least widths does.
    """
    folded = {k: wished for k, (_, wished) in widths.items()}
    while sum(folded.values()) > page and (wide := [k for k in folded if folded[k] > widths[k][0]]):
        folded[max(reversed(wide), key=folded.__getitem__)] -= 1
    return folded


def _width(column: Column, cells: Sequence[Cell]) -> int:
    return max(cell_len(text) for text in _texts(column, cells))


def _least(column: Column, cells: Sequence[Cell], page: int) -> int:
    if not column.words:
        return _width(column, cells)
    longest = max(cell_len(word) for text in _texts(column, cells) for word in (text.split() or [""]))
    return min(longest, page // 2 - GAPS[0])


def _texts(column: Column, cells: Sequence[Cell]) -> list[str]:
    return [*column.title.splitlines(), column.unit, *(cell.text for cell in cells)]
