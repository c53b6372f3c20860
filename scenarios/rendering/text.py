"""Report as aligned text.

If a table is too wide, first the gaps are reduced, then words are wrapped. If this is not enough, the table is split:
further columns follow below, with the identifying columns repeated, so that no number is cut.
"""

from io import StringIO
from textwrap import wrap

from rich.cells import cell_len
from rich.console import Console
from rich.table import Table as Grid
from rich.text import Text

from scenarios.rendering import Page
from scenarios.rendering.content import Heading, Line, Mood, Paragraph, Part, Picture, Report, Table
from scenarios.rendering.plot import Plot
from scenarios.support.texts import continued

WIDE = 10_000
"""Characters per line if unlimited."""
GAPS = (2, 1)
"""Preferred and least number of spaces between columns."""
STYLES = {Mood.PLAIN: "", Mood.GOOD: "green", Mood.DOUBTFUL: "yellow", Mood.BAD: "red"}


def render(report: Report, page: Page) -> str:
    """Render title and parts, related parts without an empty line; plots and pictures are omitted."""
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
        for part in report.parts:
            if isinstance(part, Plot | Picture) or (isinstance(part, Heading | Table) and part.file_only):
                continue
            note_before = isinstance(before, Paragraph) and not before.strong
            note = isinstance(part, Line) or (isinstance(part, Paragraph) and not part.strong)
            if not isinstance(before, Heading) and not (note_before and note):
                console.print()
            match part:
                case Paragraph(text, mood, strong=True):
                    _print_words(text, f"bold {STYLES[mood]}".strip(), console, width)
                case Paragraph(text, mood):
                    _print_words(text, STYLES[mood], console, width, hanging="  ")
                case Line(text):
                    console.print(continued(text, width), soft_wrap=True)
                case Heading(text):
                    _print_words(text, "bold", console, width)
                case Table():
                    _print_table(part, console, width)
            before = part
    return "\n".join(line.rstrip() for line in capture.get().split("\n"))


def _print_words(text: str, style: str, console: Console, width: int, hanging: str = "") -> None:
    """Print wrapped text; a word wider than the page, such as a path, and a number with `%` or `N m` are not broken."""
    whole = text.replace(" %", "\N{NO-BREAK SPACE}%").replace(" N m", "\N{NO-BREAK SPACE}N\N{NO-BREAK SPACE}m")
    lines = wrap(whole, width, subsequent_indent=hanging, break_long_words=False, break_on_hyphens=False)
    console.print(Text("\n".join(lines).replace("\N{NO-BREAK SPACE}", " "), style=style), soft_wrap=True)


def _print_table(table: Table, console: Console, width: int) -> None:
    if table.title:
        _print_words(table.title, "bold", console, width)
    rows = table.rows[: table.shown]
    shown = [k for k, column in enumerate(table.columns) if not column.file_only]
    wished, least = dict[int, int](), dict[int, int]()
    for k in shown:
        texts = [*table.columns[k].title.splitlines(), table.columns[k].unit, *(row[k].text for row in rows)]
        wished[k] = max(cell_len(text) for text in texts)
        longest = max((cell_len(word) for text in texts for word in text.split()), default=0)
        least[k] = min(longest, width // 2 - GAPS[0]) if table.columns[k].words else wished[k]

    def used(widths: dict[int, int], gap: int) -> int:
        return sum(widths.values()) + gap * (len(widths) - 1)

    gap = next((gap for widths in (wished, least) for gap in GAPS if used(widths, gap) <= width), GAPS[0])
    keys = [k for k in shown if k < table.keys]
    blocks = [keys]
    for k in shown[len(keys) :]:
        if blocks[-1] != keys and used({each: least[each] for each in [*blocks[-1], k]}, gap) > width:
            blocks.append(keys)
        blocks[-1] = [*blocks[-1], k]
    for count, block in enumerate(blocks if rows or table.shown is None else []):
        if count:
            console.print()
        widths = {k: wished[k] for k in block}
        while used(widths, gap) > width and (wide := [k for k in block if widths[k] > least[k]]):
            widths[max(reversed(wide), key=widths.__getitem__)] -= 1
        drawn = Grid(box=None, pad_edge=False, padding=(0, gap, 0, 0), header_style="bold")
        units = any(table.columns[k].unit for k in block)
        for k in block:
            column = table.columns[k]
            header = f"{column.title}\n{column.unit}" if units else column.title
            justify = "left" if column.words else "right"
            drawn.add_column(header, justify=justify, width=widths[k], no_wrap=not column.words, overflow="fold")
        for row in rows:
            drawn.add_row(*(Text(row[k].text, style=STYLES[row[k].mood]) for k in block))
        console.print(drawn, soft_wrap=True)
    if len(table.rows) > len(rows) and table.rest:
        _print_words(f"{table.rest} (--format markdown shows them)", "", console, width)
