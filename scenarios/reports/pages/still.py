"""A still of the arm of a run, where an OpenGL is there to draw it."""

import json
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from PIL import Image

from ident.support.naming import one_line
from scenarios.experiments.files.loading import load_scenario
from scenarios.reports.content import Paragraph, Picture, Report
from scenarios.results.record import RECORD
from scenarios.results.run_folder import scene_digest
from scenarios.support.errors import ScenarioError
from sim.errors import SimulationError

WIDTH = 480
"""Pixels of a picture."""
PATIENCE = 60.0
"""How long a picture may take [s]."""


def with_picture(report: Report, folder: Path) -> Report:
    """The report with a still of the arm behind its verdict, if the folder is a run's and it can be drawn.

    The still is of the scenario as it is; where that is not what was run, a sentence stands in its place.
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
    """Why a scenario may not look now as it did when it was run, None if it does."""
    if scene is None:
        return "this folder, written by another version of rx90, does not contain its scenario"
    try:
        now = scene_digest(load_scenario(named))
    except (ScenarioError, SimulationError) as error:
        return f"scenario {one_line(named)} can no longer be read: {error}"
    return None if now == scene else f"scenario {one_line(named)} has changed since it was run"


def still(named: str) -> Picture | None:
    """The arms of a scenario half-way through their motion, None if they cannot be drawn.

    `rx90 view` draws them in a process of its own: which OpenGL there is shows when MuJoCo is imported, and some end
    the process that asks for them.
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
