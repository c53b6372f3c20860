"""A picture of the arm of a run, if OpenGL is available."""

import json
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from PIL import Image

from ident.support.naming import one_line
from scenarios.experiments.scenario import load_scenario
from scenarios.rendering.content import Paragraph, Picture, Report
from scenarios.results.record import RECORD
from scenarios.results.run_folder import scene_digest
from scenarios.support.errors import ScenarioError
from sim.errors import SimulationError

WIDTH = 480
"""Pixels of a picture."""
PATIENCE = 60.0
"""Timeout of a picture [s]."""


def with_picture(report: Report, folder: Path) -> Report:
    """Return the report with a picture of the arm after its verdict, if the folder is of a run and it can be rendered.

    The picture shows the current scenario; if it has changed since the run, a sentence replaces the picture.
    """
    try:
        record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return report
    named = record.get("scenario")
    if named is None:
        return report
    changed = why_another(str(named), record.get("scene"))
    shown = still(str(named)) if changed is None else Paragraph(f"No picture of the arm: {changed}.")
    return report if shown is None else replace(report, parts=(report.parts[0], shown, *report.parts[1:]))


def why_another(named: str, scene: str | None) -> str | None:
    """Return why the scenario may have changed since it was run, None if it has not."""
    if scene is None:
        return "this folder, written by another version of rx90, does not contain its scenario"
    try:
        now = scene_digest(load_scenario(named))
    except (ScenarioError, SimulationError) as error:
        return f"scenario {one_line(named)} can no longer be read: {error}"
    return None if now == scene else f"scenario {one_line(named)} has changed since it was run"


def still(named: str) -> Picture | None:
    """Return a picture of the arms of a scenario half-way through their motion, None if it cannot be rendered.

    `rx90 view` renders it in a separate process: MuJoCo selects OpenGL when it is imported, and some backends end the
    process.
    """
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "still.png"
        words = ["view", named, "--render", str(path), "--width", str(WIDTH)]
        command = [sys.executable, "-m", "scenarios", *words]
        try:
            done = subprocess.run(command, capture_output=True, timeout=PATIENCE, check=False)
        except (OSError, subprocess.TimeoutExpired):
            return None
        if done.returncode or not path.is_file():
            return None
        with Image.open(path) as drawn:
            width, height = drawn.size
        return Picture(
            caption=f"Scenario {named}, half-way through its motions, as rx90 view draws it",
            png=path.read_bytes(),
            width=width,
            height=height,
        )
