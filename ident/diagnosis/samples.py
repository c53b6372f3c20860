"""Checks of the samples of one log, independent of the arm, and unambiguous repairs, each with a diagnosis.

Whole turns do not change the pose; a gap separates two recordings; where samples were lost in motion, the steps of the
joints reveal the number of missing periods. A recording that needs no repair is returned as the same object.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from ident.diagnosis import channels, motion_quality, timing
from ident.diagnosis.diagnosis import Diagnosis, finding
from ident.diagnosis.hypothesis import TURN, whole_turns
from ident.model.arm import Arm
from ident.observation.observation import ObserveOptions
from ident.recordings.recording import Recording
from ident.support.arrays import Mask

SAMPLE_CHECKS: dict[str, Callable[[Recording, ObserveOptions], list[Diagnosis]]] = {
    "values": channels.values,
    "wrapped": channels.wrapped,
    "clock": timing.clock,
    "lost samples": timing.lost_samples,
    "clipping": partial(channels.unmeasured, "clipping"),
    "frozen": partial(channels.unmeasured, "frozen"),
    "noise": motion_quality.noise,
    "columns": channels.columns,
    "motion": motion_quality.motion,
}
FILTERED = ("noise", "columns", "motion")
"""Checks of logs that can be filtered."""
OF_THE_MOTION = ("values", "noise", "motion")
"""Checks of the quality of logs: standard deviations of gains include it, and bad values are refused."""
SPOILING: dict[str, Callable[[Recording], Mask]] = {
    "clipping": partial(channels.unmeasured_samples, "clipping"),
    "frozen": partial(channels.unmeasured_samples, "frozen"),
    "values": channels.implausible,
    "lost samples": lambda log: timing.beside(log, timing.timestamp_anomalies(log).long),
    "repeated samples": lambda log: timing.beside(log, timing.timestamp_anomalies(log).still),
}
"""Functions that mark samples that each joint's gain must not use, shape (N, n), by the name of the diagnosis."""


def repaired(
    recording: Recording, arm: Arm, observing: ObserveOptions
) -> tuple[tuple[Recording, ...], tuple[Diagnosis, ...]]:
    """Return the repaired recording, or its parts that the filters can use, and the diagnoses of the repairs."""
    recording, turns = unwrapped(recording)
    recording, stamps = restored(recording)
    recording, limits = turned_back(recording, arm)
    parts, gaps = split_at_gaps(recording, observing)
    return parts, tuple(each for each in (turns, stamps, limits, gaps) if each is not None)


def unwrapped(recording: Recording) -> tuple[Recording, Diagnosis | None]:
    """Unwrap angles that jump by turns."""
    smooth = channels.continuous(recording)
    return (recording, None) if smooth is recording else (smooth, channels.wrapped(recording)[0])


def restored(recording: Recording) -> tuple[Recording, Diagnosis | None]:
    """Correct the time stamps for lost samples, if the motion reveals their number."""
    odd = timing.timestamp_anomalies(recording)
    if not odd.plain:
        return recording, None
    later = np.zeros(len(recording.t))
    later[odd.long + 1] = odd.lost * timing.intervals(recording).usual
    return replace(recording, t=recording.t + np.cumsum(later)), timing.lost_samples(recording)[0]


def turned_back(recording: Recording, arm: Arm) -> tuple[Recording, Diagnosis | None]:
    """Shift unwrapped positions by whole turns into the limits of the model; joints without limits are not changed."""
    turns = np.zeros(recording.n, np.intp)
    for j in np.flatnonzero(np.asarray(arm.revolute, np.bool_) & np.isfinite(arm.upper - arm.lower)):
        q = recording.q[:, j]
        turns[j] = min(whole_turns(arm.lower[j], arm.upper[j], q.min(), q.max()), key=abs, default=0)
    joints = np.flatnonzero(turns).tolist()
    if not joints:
        return recording, None
    listed = ", ".join(f"q{j + 1} by {turns[j]:+d}" for j in joints)
    sentence = f"positions shifted by whole turns into the model's limits: {listed}"
    advice, most = "log angles within the limits, or correct the limits", int(np.abs(turns).max())
    done = finding(recording.name, "whole turns", sentence, advice, joints=joints, value=most, unit="turns")
    return replace(recording, q=recording.q + TURN * turns), done


def split_at_gaps(
    recording: Recording, observing: ObserveOptions | None = None
) -> tuple[tuple[Recording, ...], Diagnosis | None]:
    """Split a recording at gaps that are too long to interpolate, without parts that are too short for the filters."""
    observing = observing or ObserveOptions()
    pieces = tuple(
        Recording(recording.t[part], recording.q[part], recording.v[part], f"{recording.name}, part {k}")
        for k, part in enumerate(timing.usable_parts(recording, observing), 1)
    )
    return (pieces, timing.missing_samples(recording, observing)) if pieces else ((recording,), None)
