"""Report as Markdown: all rows of all tables, figures by the names of their files."""

from scenarios.rendering import Page
from scenarios.rendering.content import Column, Heading, Line, Paragraph, Picture, Report, Table
from scenarios.rendering.plot import Plot


def render(report: Report, page: Page) -> str:
    """Render title and parts, separated by empty lines."""
    drawn = [_part(part) for part in report.parts if not isinstance(part, Plot | Picture)]  # only pages show these
    return "\n\n".join([f"# {report.title}", *drawn]) + "\n"


def _part(part: Paragraph | Line | Heading | Table) -> str:
    match part:
        case Paragraph(text, strong=strong):
            return f"**{text}**" if strong else text
        case Line(text):
            return f"    {text}"
        case Heading(text):
            return f"## {text}"
        case Table():
            return _table(part)


def _table(table: Table) -> str:
    rule = ["---" if column.words else "---:" for column in table.columns]
    rows = [[_heading(column) for column in table.columns], rule]
    rows += [[cell.text.replace("|", "\\|") for cell in row] for row in table.rows]
    lines = [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join([f"**{table.title}**", "", *lines] if table.title else lines)


def _heading(column: Column) -> str:
    title = " ".join(column.title.split())  # a row of a table is one line
    return f"{title} [{column.unit}]" if column.unit else title
