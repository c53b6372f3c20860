"""Report as Markdown: all rows of all tables, without plots and pictures."""

from scenarios.rendering import Page
from scenarios.rendering.content import Heading, Line, Paragraph, Picture, Report, Table
from scenarios.rendering.plot import Plot


def render(report: Report, page: Page) -> str:
    """Render title and parts, separated by empty lines."""
    drawn = [f"# {report.title}"]
    for part in report.parts:
        match part:
            case Paragraph(text, strong=strong):
                drawn.append(f"**{text}**" if strong else text)
            case Line(text):
                drawn.append(f"    {text}")
            case Heading(text):
                drawn.append(f"## {text}")
            case Table():
                heads = [each.heading + (f" [{each.unit}]" if each.unit else "") for each in part.columns]
                rows = [heads, ["---" if each.words else "---:" for each in part.columns]]
                rows += [[cell.text.replace("|", "\\|") for cell in row] for row in part.rows]
                title = [f"**{part.title}**", ""] if part.title else []
                drawn.append("\n".join([*title, *(f"| {' | '.join(row)} |" for row in rows)]))
            case Plot() | Picture():
                pass  # only pages show these
    return "\n\n".join(drawn) + "\n"
