"""Page of a result folder: its result, what the rows of its files add, and a picture of the arm."""

import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
from PIL import Image

from ident.diagnosis.motion_quality import joint_motions
from ident.recordings.recording import Recording
from ident.support.naming import one_line
from scenarios.experiments.scenario import load_scenario
from scenarios.rendering.content import Heading, Paragraph, Part, Picture, Report
from scenarios.rendering.plot import Axis, Mark, Plot, Series, values
from scenarios.results import provenance
from scenarios.results.bare import BareResult
from scenarios.results.check import Check
from scenarios.results.fit_plots import fit_parts
from scenarios.results.fit_rows import read_fit
from scenarios.results.gains import Result, ResultGain
from scenarios.results.motion import CheckLog, motion_table, range_plot, short_names
from scenarios.results.problem_folder import GivenProblem
from scenarios.results.record import (
    RECORD,
    RESULT,
    check_words,
    identify_words,
    read_record,
    read_result,
    recorded_problem,
)
from scenarios.results.run_folder import scene_digest
from scenarios.support.errors import ScenarioError
from sim.errors import SimulationError

PAGES = {
    "run": "scenarios.results.pages",
    "identification": "scenarios.results.pages",
    "check": "scenarios.results.pages",
    "bare": "scenarios.results.pages",
    "monte-carlo": "scenarios.results.monte_carlo",
    "sensitivity": "scenarios.results.sensitivity",
    "comparison": "scenarios.benchmark.comparison",
    "paper": "scenarios.benchmark.paper_result",
}
"""Kinds of results and the modules of their pages."""
STUDY, COMPARISON, PAPER = "study.json", "report.json", "paper.json"
LEAVERS = "run, identify or check --save, or monte-carlo, sensitivity, compare or paper --out"


def page_of(folder: Path) -> Report:
    """Return the page of a result folder.

    Raises:
        ScenarioError: If it holds no result, or one of another version; if it is an unfinished study; if a file is
            missing or changed.
    """
    return import_module(PAGES[kind_of(folder)]).page(folder)


def kind_of(folder: Path) -> str:
    """Return the kind of a folder, a key of `PAGES`.

    Raises:
        ScenarioError: If it holds no result.
    """
    if not folder.is_dir():
        raise ScenarioError(f"{one_line(folder)}: not a folder; expected one written by {LEAVERS}")
    for name, key, kind in ((RECORD, "kind", None), (STUDY, "study", None), (COMPARISON, None, "comparison")):
        if (folder / name).is_file():
            return kind or _stated(folder / name, key or "")
    if (folder / PAPER).is_file():
        return "paper"
    if (folder / RESULT).is_file():
        raise ScenarioError(
            f"{one_line(folder)}: contains {RESULT} but no {RECORD}: incomplete or from an older version; save it again"
        )
    if (folder / "paper.md").is_file():
        raise ScenarioError(
            f"{one_line(folder)}: contains paper.md but no {PAPER}: incomplete or from an older version; write it again"
        )
    raise ScenarioError(f"{one_line(folder)}: contains no result; expected a folder written by {LEAVERS}")


def _stated(path: Path, key: str) -> str:
    """Return the kind that a file states."""
    try:
        stated = json.loads(path.read_text(encoding="utf-8"))[key]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ScenarioError(f"{one_line(path)}: damaged, or from another version: it states no {key!r}") from error
    if stated not in PAGES:
        raise ScenarioError(f"{one_line(path)}: states {key} {one_line(stated)!r}; known: {', '.join(PAGES)}")
    if stated == "comparison":
        raise ScenarioError(
            f"{one_line(path.parent)}: is one scenario of a comparison; give the folder that contains it"
        )
    return stated


KINDS = {"run": Result, "identification": Result, "check": Check, "bare": BareResult}
"""Results by the kind that a record states."""
PIXELS = 400
"""Number of time intervals, of each of which the lowest and the highest current are drawn."""


def page(folder: Path) -> Report:
    """Return the page of a saved run, identification or check, or of bare motions: its result, and what its files add.

    Raises:
        ScenarioError: If it holds no result, or one of another version; if a file is missing or changed.
    """
    record = read_record(folder)
    result, given = read_result(folder, KINDS[record.kind]), recorded_problem(folder, record)
    planned, again = provenance.asked(folder, record), identify_words(folder, record)
    if isinstance(result, Check):
        drawn = currents(given, short_names([log.log for log in result.logs]))
        origin = provenance.origin(record, planned, given.arm, check_words(folder, record))
        return result.report(result.headline, *drawn, *origin, mood=result.mood)
    if isinstance(result, BareResult):
        logs = [
            CheckLog.of(each.recording.name, joint_motions(each.recording, given.arm, given.observing), given.arm)
            for each in given.motions
        ]
        origin = provenance.origin(record, planned, given.arm, again)
        return result.report(record.title, *motion_parts(logs), *origin)
    fit = read_fit(folder)
    names = short_names([motion.log for motion in fit.motions])
    parts = [
        *how_to_identify(result.gains, given.gains.max_rel_std),
        *fit_parts(fit, names),
        *motion_parts(fit.motions),
    ]
    payloads = provenance.payloads(record, given)
    return result.report(record.title, *parts, *provenance.origin(record, payloads, given.arm, again, result.seed))


def motion_parts(logs: Sequence[CheckLog]) -> list[Part]:
    """Return the ranges of the joints, and a table for each log."""
    names = short_names([log.log for log in logs])
    recorded = {name: log.joints for name, log in zip(names, logs, strict=True)}
    tables = [motion_table(name, joints) for name, joints in recorded.items()]
    return [Heading("Motion and joint ranges"), range_plot(recorded), *tables]


def currents(given: GivenProblem, names: Sequence[str]) -> list[Part]:
    """Return the recorded currents."""
    parts: list[Part] = []
    for name, motion in zip(names, given.motions, strict=True):
        parts += [Heading(f"Currents of {name}, as recorded")]
        parts += [current_plot(motion.recording, joint) for joint in range(given.arm.n)]
    return parts


def current_plot(log: Recording, joint: int) -> Plot:
    """Return the plot of a joint's recorded current (joint from 0): minimum and maximum of every time interval."""
    t, v = log.t, log.v[:, joint]
    size = max(1, -(-len(t) // PIXELS))
    starts = np.arange(0, len(t), size)
    low, high = np.minimum.reduceat(v, starts), np.maximum.reduceat(v, starts)
    middle = np.repeat(t[starts], 2) if size > 1 else t
    drawn = np.column_stack((low, high)).ravel() if size > 1 else v
    how = f"Minimum and maximum of every {size} samples." if size > 1 else "Every sample."
    return Plot(
        title=f"Joint {joint + 1}",
        caption=how,
        x=Axis(title="time", unit="s"),
        y=Axis(title="current", unit="drive units"),
        series=(Series(label="", mark=Mark.LINE, x=values(middle), y=values(drawn)),),
        zoom=True,
        height=110,
    )


def how_to_identify(gains: Sequence[ResultGain], allowed: float) -> list[Part]:
    """Return for each refused joint what data would identify its gain.

    `allowed` is the largest predicted relative standard deviation of a gain that is not refused.
    """
    refused = [each for each in gains if not each.identifiable]
    said = [Paragraph(f"Joint {each.joint}: {_advice(each.predicted_rel_std, allowed)}.") for each in refused]
    return [Heading("How to identify the refused gains"), *said] if said else []


def _advice(predicted: float | None, allowed: float) -> str:
    if predicted is None:
        return "the data do not determine the accuracy of its gain; mount a payload whose weight loads the joint"
    factor = predicted / allowed
    if factor <= 1.0:
        return "its standard deviation is small enough; it was refused for the reason above"
    times, rows = (f"{x:.0f}" if x >= 10.0 else f"{x:.3g}" for x in (factor, factor**2))
    return (
        f"to identify it, use a payload with {times} times the torque on it (farther from its axis, or heavier; "
        f"`rx90 payload` designs one), or record {rows} times as many rows of such motions"
    )


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
