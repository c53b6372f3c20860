"""Report as one HTML file: escaped texts, static plots, no script and no network requests."""

import base64
import json
import re
from importlib.resources import files
from itertools import groupby

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from scenarios.rendering import Page
from scenarios.rendering.content import Heading, Mood, Part, Report
from scenarios.rendering.plot import Plot

MARK = "rx90 report"
"""Generator of the page, by which a page is recognised."""
CODE = re.compile(r"`([^`\n]+)`")
"""A command or a name within a text."""
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*")
"""An option of a command."""
SHORT = 12
"""Characters of a cell of words that is not wrapped: about the width of a heading."""


def render(report: Report, page: Page) -> str:
    """Render title and parts."""
    templates = Environment(
        loader=PackageLoader("scenarios.rendering", ""),
        autoescape=True,
        undefined=StrictUndefined,
        keep_trailing_newline=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters |= {"options": options, "prose": prose, "base64": base64.b64encode}
    plots = [part for part in report.parts if isinstance(part, Plot)]
    return templates.get_template("page.html.j2").render(
        title=report.title,
        mood=report.mood.value,
        maker=MARK,
        sections=sections(report.parts),
        drawn={id(plot): Markup(plot.svg(number)) for number, plot in enumerate(plots)},
        id=id,
        moods={mood: mood.value for mood in Mood},
        short=SHORT,
        style=Markup(files("scenarios.rendering").joinpath("page.css").read_text(encoding="utf-8")),
        document=Markup(script_json(report.document)),
    )


def sections(parts: tuple[Part, ...]) -> list[tuple[Heading | None, list[tuple[str, list[Part]]]]]:
    """Return the parts by headings, None before the first one; adjacent plots are one group of parts."""
    found: list[tuple[Heading | None, list[tuple[str, list[Part]]]]] = [(None, [])]
    for kind, members in groupby(parts, key=lambda part: type(part).__name__.lower()):
        for part in [list(members)] if kind == "plot" else ([each] for each in members):
            if isinstance(part[0], Heading):
                found.append((part[0], []))
            else:
                found[-1][1].append((kind, part))
    return found


def options(text: str) -> Markup:
    """Return escaped text, the options of commands in it not broken at their hyphens."""
    return Markup(OPTION.sub(r'<span class="whole">\g<0></span>', str(escape(text))))


def prose(text: str) -> Markup:
    """Return escaped text with whole options, text in backticks as code, and no break in `1 %`, `2 sigma` and `N m`."""
    code = CODE.sub(r"<code>\1</code>", str(options(text)))
    return Markup(code.replace(" %", "&nbsp;%").replace("2 sigma", "2&nbsp;sigma").replace("N m", "N&nbsp;m"))


def script_json(value: object) -> str:
    """Return JSON without `<`, `>` and `&`, which are escaped in strings, so that it cannot end its element."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
