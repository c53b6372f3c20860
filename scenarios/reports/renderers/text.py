"""A report as aligned text.

A table that does not fit the page is first set closer, then words are folded onto further lines; if that is not enough
it is continued below itself, its first column repeated, so that no number is ever cut.
"""

from collections.abc import Mapping, Sequence
from io import StringIO

from rich.cells import cell_len
from rich.console import Console
from rich.table import Table as Grid
from rich.text import Text

from scenarios.reports.content import Cell, Column, Figure, Heading, Line, Mood, Paragraph, Picture, Report, Table
from scenarios.reports.plot import Plot
from scenarios.reports.renderers import Page

WIDE = 10_000
"""Characters a line where any number is allowed."""
GAPS = (2, 1)
"""Spaces between columns, as wished and at least."""
STYLES = {Mood.PLAIN: "", Mood.GOOD: "green", Mood.DOUBTFUL: "yellow", Mood.BAD: "red"}


def render(report: Report, page: Page) -> str:
    """Draw title and parts; figures are files, not text."""
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
        console.print(Text(report.title, style=f"{bold}{STYLES[report.mood]}"), width=width)
        for part in report.parts:
            match part:
                case Paragraph(text, mood, strong):
                    style = f"{'bold ' if strong else ''}{STYLES[mood]}".strip()
                    console.print(Text(text, style=style), width=width)
                case Line(text):
                    console.print(text, soft_wrap=True)
                case Heading(text):
                    console.print(Text(f"\n{text}", style="bold"), width=width)
                case Table():
                    _print_table(part, console, width)
                case Figure() | Plot() | Picture():
                    pass
    return "\n".join(line.rstrip() for line in capture.get().split("\n"))


def _print_table(table: Table, console: Console, width: int) -> None:
    if table.file_only:
        return
    if table.title:
        console.print(Text(table.title, style="bold"), width=width)
    rows = table.rows[: table.shown]
    widths = [_width(column, [row[k] for row in rows]) for k, column in enumerate(table.columns)]
    least = [_least(column, [row[k] for row in rows], width) for k, column in enumerate(table.columns)]
    fits = len(blocks(widths, width)) == 1
    for gap, block in blocks(widths if fits else least, width):
        folded = fold({k: (least[k], widths[k]) for k in block}, width - gap * (len(block) - 1))
        grid = Grid(box=None, pad_edge=False, collapse_padding=True, padding=(0, gap, 0, 0), header_style="bold")
        units = any(table.columns[k].unit for k in block)
        for k in block:
            column = table.columns[k]
            header = f"{column.title}\n{column.unit}" if units else column.title
            justify = "left" if column.words else "right"
            grid.add_column(header, justify=justify, width=folded[k], no_wrap=not column.words, overflow="fold")
        for row in rows:
            grid.add_row(*(Text(row[k].text, style=STYLES[row[k].mood]) for k in block))
        console.print(grid, soft_wrap=True)
    if len(table.rows) > len(rows) and table.rest:
        console.print(table.rest, width=width)


def blocks(widths: Sequence[int], page: int) -> list[tuple[int, tuple[int, ...]]]:
    """Which columns stand beside each other, and how far apart.

    Args:
        widths: Of the columns.
        page: Characters a line.

    Returns:
        The gap and the columns of each part, the first column in all of them. One part if the columns fit with a gap of
        `GAPS`; otherwise as many as are needed, each at least two columns.
    """
    for gap in GAPS:
        if sum(widths) + gap * (len(widths) - 1) <= page:
            return [(gap, tuple(range(len(widths))))]
    parts: list[list[int]] = [[0]]
    for k in range(1, len(widths)):
        used = sum(widths[c] for c in parts[-1]) + GAPS[0] * len(parts[-1])
        if len(parts[-1]) > 1 and used + widths[k] > page:
            parts.append([0])
        parts[-1].append(k)
    return [(GAPS[0], tuple(part)) for part in parts]


def fold(widths: Mapping[int, tuple[int, int]], page: int) -> dict[int, int]:
    """Columns made narrower, always the widest of those that can be, until all fit a page.

    Args:
        widths: Of the columns beside each other, by their index: the least, and the one wished for.
        page: Characters for all of them, without gaps.

    Returns:
        The widths; together more than the page if the least are.
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
