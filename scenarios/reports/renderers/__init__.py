"""How reports are drawn: one file a form, whose `render` turns a report into text."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module

from scenarios.reports.content import Report

RENDERERS = {
    "text": "aligned tables for a terminal",
    "markdown": "Markdown, with every row",
    "json": "one JSON object for programs",
    "html": "a page for a browser, whole in one file",
}
"""Names with what they are; each is a module here, imported when it is used."""


@dataclass(frozen=True, slots=True)
class Page:
    """What a report is drawn on.

    Attributes:
        width: Characters a line, None where lines may be of any length.
        colour: Whether moods are shown in colours.
    """

    width: int | None = None
    colour: bool = False


def renderer(name: str) -> Callable[[Report, Page], str]:
    """The function that draws a report in a form of `RENDERERS`."""
    return import_module(f"{__name__}.{name}").render
