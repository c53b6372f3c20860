"""Writing of reports to files: figures and text."""

from pathlib import Path

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
