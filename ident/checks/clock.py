"""The clock of a log: rate, jitter, samples that its time stamps say are missing."""

import numpy as np

from ident.checks.remark import Grade, Remark
from ident.intervals import Intervals, intervals_of
from ident.observation import ObserveOptions
from ident.recording import JITTER_TOL, LARGEST_GAP, Recording

FEW = 0.02
"""Share of missing samples that straight lines between the others stand in for."""
ROOM = 4.0
"""Samples in a period of the highest cut-off below which filters have little room."""
JITTERED = 0.5
"""Largest deviation of an interval, as a share, that does not come of missing samples but is worth a word."""


def slowest_hz(observing: ObserveOptions) -> float:
    """Rate of a log [Hz] below which filters have little room."""
    return ROOM * max(observing.cutoff_hz, observing.decimation_cutoff_hz)


SLOW = slowest_hz(ObserveOptions())
"""Likewise of the default filters."""


def clock_remarks(recording: Recording) -> list[Remark]:
    """What the time stamps say."""
    found = intervals_of(recording.t)
    jitter = found.jitter
    duration = float(recording.t[-1] - recording.t[0])
    hertz = 1.0 / found.mean  # controllers that log every 10 or 12 ms do so at a rate between the two
    rate = Remark(
        topic="rate",
        log=recording.name,
        seen=f"{hertz:.4g} Hz, {len(recording.t)} samples, {duration:.4g} s",
        grade=Grade.WEAK if hertz < SLOW else Grade.GOOD,
        advice=f"log at {SLOW:g} Hz or more, or lower --cutoff-hz" if hertz < SLOW else None,
    )
    uneven = jitter > JITTERED
    steady = Remark(
        topic="jitter",
        log=recording.name,
        seen="none" if jitter <= JITTER_TOL else f"intervals vary by up to {100.0 * jitter:.3g} %",
        grade=Grade.WEAK if uneven else Grade.GOOD,
        advice="log the time at which a sample was taken, not at which it arrived" if uneven else None,
    )
    return [rate, steady, _gaps(recording, found)]


def _gaps(recording: Recording, found: Intervals) -> Remark:
    intervals, lost = np.diff(recording.t), found.lost
    if not lost:
        return Remark(topic="missing samples", log=recording.name, seen="none by the time stamps")
    at = int(intervals.argmax())
    hole = intervals[at] > LARGEST_GAP * found.usual
    many = lost > FEW * (len(recording.t) + lost)
    where = f"{lost} in {found.gaps} gap{'s' if found.gaps > 1 else ''}"
    return Remark(
        topic="missing samples",
        log=recording.name,
        seen=f"{where}, the longest {intervals[at]:.3g} s at t = {recording.t[at]:.6g} s",
        grade=Grade.WRONG if hole or many else Grade.WEAK,
        advice="use one side of the hole" if hole else "record again with less else to do for the logging computer",
    )
