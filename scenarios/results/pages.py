"""Page of a result folder: its result, what the rows of its files add, and a picture of the arm."""

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ident.diagnosis.motion_quality import joint_motions
from ident.recordings.recording import Recording
from ident.support.naming import one_line
from scenarios.experiments.scenario import load_scenario
from scenarios.rendering.content import Heading, Mood, Paragraph, Part, Picture, Report
from scenarios.rendering.plot import Plot
from scenarios.results.bare import BareResult
from scenarios.results.check import Check, CheckLog, motion_parts, short_names
from scenarios.results.fit import TORQUES, read_fit, torque_plot
from scenarios.results.gains import Result, ResultGain
from scenarios.results.problem_folder import read_json
from scenarios.results.record import RECORD, origin_parts, read_record, read_result, recorded_problem
from scenarios.results.run_folder import scene_digest
from scenarios.support.errors import ScenarioError
from sim.errors import SimulationError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PAGES = {
    **dict.fromkeys(("run", "identification", "check", "bare"), "scenarios.results.pages:page"),
    "monte-carlo": "scenarios.results.studies:monte_carlo_page",
    "sensitivity": "scenarios.results.sensitivity:sensitivity_page",
    "comparison": "scenarios.benchmark.comparison:page",
    "paper": "scenarios.benchmark.paper:page",
}
"""Kinds of results and the functions of their pages."""
STUDY, COMPARISON, PAPER = "study.json", "report.json", "paper.json"
LEAVERS = "run, identify or check --save, or monte-carlo, sensitivity, compare or paper --out"
KINDS = {"run": Result, "identification": Result, "check": Check, "bare": BareResult}
"""Results by the kind that a record states."""
PIXELS = 400
"""Number of time intervals, of each of which the lowest and the highest current are drawn."""


def page_of(folder: Path) -> Report:
    """Return the page of a result folder."""
    module, _, function = PAGES[kind_of(folder)].partition(":")
    return getattr(import_module(module), function)(folder)


def kind_of(folder: Path) -> str:
    """Return the kind of a folder, a key of `PAGES`."""
    place = one_line(folder)
    if not folder.is_dir():
        raise ScenarioError(f"{place}: not a folder; expected one written by {LEAVERS}")
    for name, key in ((RECORD, "kind"), (STUDY, "study")):
        if (folder / name).is_file():
            stated = read_json(folder / name)
            kind = stated.get(key) if isinstance(stated, dict) else None
            if kind == "comparison":
                raise ScenarioError(f"{place}: is one scenario of a comparison; give the folder that contains it")
            if kind not in PAGES:
                known = f"known: {', '.join(PAGES)}; damaged, or from another version"
                raise ScenarioError(f"{one_line(folder / name)}: states {key} {one_line(kind)!r}; {known}")
            return kind
    for name, kind in ((COMPARISON, "comparison"), (PAPER, "paper")):
        if (folder / name).is_file():
            return kind
    raise ScenarioError(f"{place}: contains no whole result of this version; expected a folder written by {LEAVERS}")


def page(folder: Path) -> Report:
    """Return the page of a saved run, identification, check or bare motions: its result, and what its files add."""
    record = read_record(folder)
    result, given = read_result(folder, KINDS[record.kind]), recorded_problem(folder, record)
    title, mood, parts = record.title, Mood.PLAIN, list[Part]()
    if isinstance(result, Check):
        title, mood = result.headline, result.mood
        for name, motion in zip(short_names([log.log for log in result.logs]), given.motions, strict=True):
            parts.append(Heading(f"Currents of {name}, as recorded"))
            parts += [current_plot(motion.recording, joint) for joint in range(given.arm.n)]
    elif isinstance(result, BareResult):
        logs = [(each.recording, joint_motions(each.recording, given.arm, given.observing)) for each in given.motions]
        parts += motion_parts([CheckLog.of(log.name, motions, given.arm) for log, motions in logs])
    else:
        parts += _fit_parts(folder, result, given.gains.max_rel_std)
    seed = result.seed if isinstance(result, Result) else None
    found = result.report(title, *parts, *origin_parts(folder, record, given, seed), mood=mood)
    first = next(k for k, part in enumerate(found.parts) if isinstance(part, Heading))
    made = Paragraph(f"From {', '.join(record.sources)}; made {record.created[:16].replace('T', ' ')} UTC.")
    return replace(found, parts=(*found.parts[:first], made, *found.parts[first:]))


def _fit_parts(folder: Path, result: Result, allowed: float) -> list[Part]:
    """Return what would identify each refused gain, the torques, and the motions of a saved fit."""
    fit, parts = read_fit(folder), how_to_identify(result.gains, allowed)
    names = short_names([motion.log for motion in fit.motions])
    parts += [Heading("Torques, measured and reconstructed"), Paragraph(TORQUES)]
    starts = list(zip(names, fit.begins, strict=False))
    for joint, still in fit.still.items():
        gain, at = result.gains[joint - 1], fit.joint == joint
        scale, unit = (gain.estimate, gain.unit.partition("/")[0]) if gain.estimate else (1.0, "drive units")
        t, v, residual = (fit.rows[name][at] for name in ("t", "v", "residual"))
        parts.append(torque_plot(joint - 1, unit, t, scale * v, scale * residual, fit.motion[at], starts, still))
    return parts + motion_parts(fit.motions)


def current_plot(log: Recording, joint: int) -> Plot:
    """Return the plot of a joint's recorded current (joint from 0): minimum and maximum of every time interval."""
    t, v = log.t, log.v[:, joint]
    size = max(1, -(-len(t) // PIXELS))
    if size > 1:
        starts = np.arange(0, len(t), size)
        ends = np.minimum.reduceat(v, starts), np.maximum.reduceat(v, starts)
        t, v = np.repeat(t[starts], 2), np.column_stack(ends).ravel()

    def draw(axes: "Axes") -> None:
        axes.plot(t, v)

    title, y = f"Joint {joint + 1}", "Current [drive units]"
    caption = f"Minimum and maximum of every {size} samples." if size > 1 else "Every sample."
    return Plot(title=title, caption=caption, x="Time [s]", y=y, draw=draw, wide=True, heights=(110,))


def how_to_identify(gains: Sequence[ResultGain], allowed: float) -> list[Part]:
    """Return what would identify each refused gain; `allowed` is the largest relative standard deviation of others."""
    parts: list[Part] = []
    for each in (gain for gain in gains if not gain.identifiable):
        if each.predicted_rel_std is None:
            said = "the data do not determine the accuracy of its gain; mount a payload whose weight loads the joint"
        elif each.predicted_rel_std <= allowed:
            said = "its standard deviation is small enough; it was refused for the reason above"
        else:
            factor = each.predicted_rel_std / allowed
            times, rows = (f"{x:.0f}" if x >= 10.0 else f"{x:.3g}" for x in (factor, factor**2))
            said = (
                f"to identify it, use a payload with {times} times the torque on it (farther from its axis, or "
                f"heavier; `rx90 payload` designs one), or record {rows} times as many rows of such motions"
            )
        parts.append(Paragraph(f"Joint {each.joint}: {said}."))
    return [Heading("How to identify the refused gains"), *parts] if parts else []


def with_picture(report: Report, folder: Path) -> Report:
    """Return the report with a picture of the arm after its verdict: of an unchanged scenario that can be rendered."""
    record = read_json(folder / RECORD) if (folder / RECORD).is_file() else None
    named, scene = (record.get(key) for key in ("scenario", "scene")) if isinstance(record, dict) else (None, None)
    try:
        same = scene is not None and scene_digest(load_scenario(str(named))) == scene
    except (ScenarioError, SimulationError):  # it exists no longer, or is another now
        same = False
    shown = still(str(named)) if same else None
    return report if shown is None else replace(report, parts=(report.parts[0], shown, *report.parts[1:]))


def still(named: str) -> Picture | None:
    """Return a picture of the arms of a scenario half-way through their motion, None if it cannot be rendered.

    `rx90 view` renders it in a separate process: MuJoCo selects OpenGL when it is imported, and some backends end the
    process.
    """
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "still.png"
        words = ["view", named, "--render", str(path), "--width", "480"]
        try:
            command = [sys.executable, "-m", "scenarios", *words]
            subprocess.run(command, capture_output=True, timeout=60.0, check=True)
            drawn = path.read_bytes()
        except (OSError, subprocess.SubprocessError):
            return None
        return Picture(f"Scenario {named}, half-way through its motions, as rx90 view draws it", drawn)
