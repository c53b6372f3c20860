"""A still of the arm of a run, where an OpenGL is there to draw it."""

import json
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from scenarios.reports.content import Picture, Report
from scenarios.store.record import RECORD

WIDTH, HEIGHT = 480, 270
PATIENCE = 60.0
"""How long a picture may take [s]."""


def with_picture(report: Report, folder: Path) -> Report:
    """The report with a still of the arm behind its verdict, if the folder is a run's and it can be drawn."""
    try:
        named = json.loads((folder / RECORD).read_text(encoding="utf-8")).get("scenario")
    except (OSError, ValueError):
        return report
    picture = None if named is None else still(str(named))
    return report if picture is None else replace(report, parts=(report.parts[0], picture, *report.parts[1:]))


def still(named: str) -> Picture | None:
    """The arms of a scenario half-way through their motion, None if they cannot be drawn.

    `rx90 view` draws them in a process of its own: which OpenGL there is shows when MuJoCo is imported, and some end
    the process that asks for them.

    Args:
        named: The scenario, as it was called.
    """
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "still.png"
        words = ["view", named, "--render", str(path), "--width", str(WIDTH), "--height", str(HEIGHT)]
        command = [sys.executable, "-m", "scenarios", *words]
        try:
            done = subprocess.run(command, capture_output=True, timeout=PATIENCE, check=False)
        except (OSError, subprocess.TimeoutExpired):
            return None
        if done.returncode or not path.is_file():
            return None
        return Picture(
            caption=f"Scenario {named}, half-way through its motions, as rx90 view draws it",
            png=path.read_bytes(),
            width=WIDTH,
            height=HEIGHT,
        )
