"""The page of a check: verdict, findings, all checks, motion and currents of each log."""

from pathlib import Path

import numpy as np

from ident.recordings.recording import Recording
from scenarios.reports.check import findings, verdict
from scenarios.reports.content import Heading, Paragraph, Part, Report
from scenarios.reports.diagnoses import MOODS, every_line
from scenarios.reports.motion import coverage_plot
from scenarios.reports.pages import provenance
from scenarios.reports.plot import Axis, Mark, Plot, Series, Tone, values
from scenarios.results.models.check import Check
from scenarios.results.problem_folder import GivenProblem
from scenarios.results.record import check_words, read_saved

PIXELS = 400
"""Number of time intervals, of each of which the lowest and the highest value are drawn."""


def page(folder: Path) -> Report:
    """Return the page of a folder.

    Raises:
        ScenarioError: If it holds no check, or one of another version; if a file is missing or changed.
    """
    record, result, given = read_saved(folder, Check)
    found = result.found
    parts: list[Part] = [Paragraph(verdict(found, result.robot), MOODS[found.severity], strong=True)]
    parts += [*findings(found), Heading("All checks"), *every_line(found.diagnoses)]
    parts += _plots(result, given)
    parts += provenance.origin(record, provenance.asked(folder, record), given.arm, check_words(folder, record))
    return Report(record.title, tuple(parts), result.model_dump(mode="json"))


def _plots(result: Check, given: GivenProblem) -> list[Part]:
    """Return the joint ranges and the recorded currents."""
    names = provenance.named([log.log for log in result.logs])
    recorded = {name: log.joints for name, log in zip(names, result.logs, strict=True) if log.joints}
    parts: list[Part] = (
        [Heading("Joint ranges covered by the motion"), coverage_plot(recorded, given.arm)] if recorded else []
    )
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
        series=(Series(label="", mark=Mark.LINE, tone=Tone.FIRST, x=values(middle), y=values(drawn)),),
        zoom=True,
        height=110,
    )
