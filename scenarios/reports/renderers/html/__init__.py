"""Report as one HTML file: escaped texts, embedded plots and scripts, no network requests."""

import base64
import io
import re
from dataclasses import dataclass
from itertools import groupby

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from scenarios.reports.content import (
    Column,
    Facts,
    Figure,
    Heading,
    Line,
    Mood,
    Paragraph,
    Part,
    Picture,
    Report,
    Table,
)
from scenarios.reports.plot import Plot
from scenarios.reports.renderers import Page
from scenarios.reports.renderers.html.scripts import drawing_library, script_json
from scenarios.reports.renderers.html.specs import drawn_plots, legend

MARK = "rx90 report"
"""Generator of the page, by which a page is recognised."""
CODE = re.compile(r"`([^`\n]+)`")
"""A command or a name within a text."""
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*")
"""An option of a command."""
SHORT = 12
"""Characters of a cell of words that is not wrapped: about the width of a heading."""


KINDS: dict[type[Part], str] = {
    Paragraph: "paragraph", Line: "line", Heading: "heading", Table: "table", Figure: "figure", Plot: "plots",
    Picture: "glance", Facts: "glance",
}  # fmt: skip
"""Names of parts in the template."""


@dataclass(frozen=True, slots=True)
class Block:
    """Parts in one group: adjacent plots, facts with a picture, or a single other part."""

    kind: str
    parts: tuple[Part, ...]


@dataclass(frozen=True, slots=True)
class Section:
    """A heading, None before the first one, and the parts below it."""

    heading: Heading | None
    blocks: tuple[Block, ...]


def render(report: Report, page: Page) -> str:
    """Render title and parts; the browser draws plots from their data."""
    templates = Environment(
        loader=PackageLoader("scenarios.reports.renderers", "html"),
        autoescape=True,
        undefined=StrictUndefined,
        keep_trailing_newline=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters |= {
        "heading": heading,
        "options": options,
        "prose": prose,
        "picture": _picture,
        "figure": _figure,
    }
    plots = [each for part in report.parts if isinstance(part, Plot) for each in canvases(part)]
    return templates.get_template("page.html.j2").render(
        title=report.title,
        mood=report.mood,
        maker=MARK,
        sections=sections(report.parts),
        number={id(plot): k for k, plot in enumerate(plots)}.__getitem__,
        id=id,
        canvases=canvases,
        moods={mood: mood.value for mood in Mood},
        short=SHORT,
        legend=legend,
        style=Markup(_own("page.css")),
        plots=Markup(script_json(drawn_plots(plots))) if plots else None,
        library=Markup(drawing_library()) if plots else None,
        script=Markup(_own("page.js")) if plots else None,
        document=Markup(script_json(report.document)),
    )


def sections(parts: tuple[Part, ...]) -> list[Section]:
    """Return the parts by headings, with groups of consecutive plots, and of pictures and facts."""
    found, heading, blocks = list[Section](), None, list[Block]()
    for kind, members in groupby(parts, key=lambda part: KINDS[type(part)]):
        together = tuple(members)
        if kind in ("plots", "glance"):
            blocks.append(Block(kind, together))
            continue
        for part in together:
            if isinstance(part, Heading):
                found.append(Section(heading, tuple(blocks)))
                heading, blocks = part, []
            else:
                blocks.append(Block(kind, (part,)))
    return [*found, Section(heading, tuple(blocks))]


def canvases(plot: Plot) -> list[Plot]:
    """A plot and the strip below it."""
    return [plot] if plot.strip is None else [plot, plot.strip]


def heading(column: Column) -> str:
    """Return a column's title on one line."""
    return " ".join(column.title.split())


def options(text: str) -> Markup:
    """Return escaped text, the options of commands in it not broken at their hyphens."""
    return Markup(OPTION.sub(r'<span class="whole">\g<0></span>', str(escape(text))))


def prose(text: str) -> Markup:
    """Return escaped text with whole options, and with text in backticks as code."""
    return Markup(CODE.sub(r"<code>\1</code>", str(options(text))))


def _picture(picture: Picture) -> str:
    """Return the bytes as a data URI."""
    return f"data:image/png;base64,{base64.b64encode(picture.png).decode()}"


def _figure(figure: Figure) -> str:
    """Return a drawing as a data URI."""
    drawn = io.BytesIO()
    figure.draw().savefig(drawn, format="png", dpi=110)
    return f"data:image/png;base64,{base64.b64encode(drawn.getvalue()).decode()}"


def _own(name: str) -> str:
    from importlib.resources import files

    return files(__name__).joinpath(name).read_text(encoding="utf-8")
