"""Renderers of reports: one file per format, whose `render` converts a report to text."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from scenarios.rendering.content import Report

RENDERERS = {
    "text": "aligned tables for a terminal",
    "markdown": "Markdown, with every row",
    "json": "one JSON object for programs",
    "html": "a page for a browser, whole in one file",
}
"""Names with descriptions; each is a module here, imported when used."""


@dataclass(frozen=True, slots=True)
class Page:
    """Properties of the output."""

    width: int | None = None  # characters per line, None for unlimited lines
    colour: bool = False  # whether assessments are shown in colours


def renderer(name: str) -> Callable[[Report, Page], str]:
    """Return the function that renders a report in a format of `RENDERERS`."""
    return import_module(f"{__name__}.{name}").render


def write_report(report: Report, path: Path) -> None:
    """Write a report; the ending of the file's name, .md, .json or .html, is its format."""
    name = {".md": "markdown", ".json": "json", ".html": "html"}[path.suffix]
    path.write_text(renderer(name)(report, Page()), encoding="utf-8", errors="backslashreplace")
