"""Pages of saved logs: a run, an identification, a check or bare motions, each its result and what its files add."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ident.diagnosis.samples.motion import joint_motions
from ident.recordings.recording import Recording
from scenarios.rendering.content import Heading, Paragraph, Part, Report
from scenarios.rendering.plot import Axis, Mark, Plot, Series, values
from scenarios.results import provenance
from scenarios.results.bare import BareResult
from scenarios.results.check import Check
from scenarios.results.fit_plots import fit_parts
from scenarios.results.fit_rows import read_fit
from scenarios.results.gains import Result, ResultGain
from scenarios.results.motion import CheckLog, motion_table, range_plot, short_names
from scenarios.results.problem_folder import GivenProblem
from scenarios.results.record import check_words, identify_words, read_record, read_result, recorded_problem

KINDS = {"run": Result, "identification": Result, "check": Check, "bare": BareResult}
"""Results by the kind that a record states."""
PIXELS = 400
"""Number of time intervals, of each of which the lowest and the highest current are drawn."""


def page(folder: Path) -> Report:
    """Return the page of a folder.

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
