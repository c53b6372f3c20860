"""Report as Markdown: all rows of all tables, figures by the names of their files."""

from scenarios.rendering import Page
from scenarios.rendering.content import Heading, Line, Paragraph, Picture, Report, Table
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
            heads = [each.heading + (f" [{each.unit}]" if each.unit else "") for each in part.columns]
            rows = [heads, ["---" if each.words else "---:" for each in part.columns]]
            rows += [[cell.text.replace("|", "\\|") for cell in row] for row in part.rows]
            lines = [f"| {' | '.join(row)} |" for row in rows]
            return "\n".join([f"**{part.title}**", "", *lines] if part.title else lines)
