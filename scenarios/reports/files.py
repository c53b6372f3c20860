"""Writing of reports to files: figures and text."""

from pathlib import Path

from scenarios.rendering import Page, renderer
from scenarios.rendering.content import Figure, Report

DPI = 110


def write_figures(report: Report, folder: Path) -> list[Path]:
    """Draw every figure and save it.

    Raises:
        OSError: If one cannot be written.
    """
    written: list[Path] = []
    for part in report.parts:
        if isinstance(part, Figure):
            drawing = part.draw()
            for ending in part.endings:
                written.append(folder / f"{part.name}.{ending}")
                drawing.savefig(written[-1], dpi=DPI)
    return written


def write_markdown(report: Report, path: Path) -> Path:
    """Write the text with every row of every table.

    Raises:
        OSError: If it cannot be written.
    """
    path.write_text(renderer("markdown")(report, Page()), encoding="utf-8", errors="backslashreplace")
    return path


def write_json(report: Report, path: Path) -> Path:
    """Write the JSON document.

    Raises:
        OSError: If it cannot be written.
    """
    path.write_text(renderer("json")(report, Page()), encoding="utf-8")
    return path
