"""Unambiguous repairs of recordings, each with a diagnosis; a recording that needs none is returned as the same object.

Whole turns do not change the pose; a gap separates two recordings; where samples were lost in motion, the steps of the
joints reveal the number of missing periods.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Severity
from ident.diagnosis.samples.clock import missing_samples, usable_parts
from ident.diagnosis.samples.lost_samples import lost_samples, timestamp_anomalies
from ident.diagnosis.samples.wrapped import TURN, continuous, wrapped
from ident.model.arm import Arm
from ident.observation.observation import ObserveOptions
from ident.recordings.recording import Recording

SLACK = 0.1
"""Tolerance of limits for an error of the zero [rad]."""


def repaired(
    recording: Recording, arm: Arm, observing: ObserveOptions
) -> tuple[tuple[Recording, ...], tuple[Diagnosis, ...]]:
    """Apply all repairs.

    Args:
        recording: The recording as logged.
        arm: The arm with its limits.
        observing: Filters, which determine the shortest usable part.

    Returns:
        The recording, or its parts, and the diagnoses of the repairs.
    """
    found = list[Diagnosis | None]()
    for repair in (unwrapped, restored, partial(turned_back, arm=arm)):
        recording, done = repair(recording)
        found.append(done)
    parts, done = split_at_gaps(recording, observing)
    return parts, tuple(each for each in (*found, done) if each is not None)


def unwrapped(recording: Recording) -> tuple[Recording, Diagnosis | None]:
    """Unwrap angles that jump by turns."""
    repaired = continuous(recording)
    return (recording, None) if repaired is recording else (repaired, wrapped(recording)[0])


def turned_back(recording: Recording, arm: Arm) -> tuple[Recording, Diagnosis | None]:
    """Shift positions by whole turns into the limits of the model.

    Args:
        recording: A recording with unwrapped angles.
        arm: The arm; joints without limits are not changed.
    """
    turns = np.array([_turns_back(recording, arm, j) for j in range(recording.n)])
    joints = np.flatnonzero(turns).tolist()
    if not joints:
        return recording, None
    listed = ", ".join(f"q{j + 1} by {turns[j]:+d}" for j in joints)
    found = Diagnosis(
        name="whole turns",
        severity=Severity.WEAK,
        sentence=f"positions shifted by whole turns into the model's limits: {listed}",
        advice="log angles within the limits, or correct the limits",
        joints=tuple(joints),
        logs=(recording.name,),
        value=float(np.abs(turns).max()),
        unit="turns",
    )
    return replace(recording, q=recording.q + TURN * turns), found


def split_at_gaps(
    recording: Recording, observing: ObserveOptions | None = None
) -> tuple[tuple[Recording, ...], Diagnosis | None]:
    """Split a recording at gaps that are too long to interpolate; parts that are too short for the filters are omitted.

    Args:
        recording: A recording with correct time stamps.
        observing: The filters, or None for the default ones.
    """
    observing = observing or ObserveOptions()
    parts = usable_parts(recording, observing)
    if not parts:
        return (recording,), None
    pieces = tuple(
        Recording(recording.t[part], recording.q[part], recording.v[part], f"{recording.name}, part {k}")
        for k, part in enumerate(parts, 1)
    )
    return pieces, missing_samples(recording, observing)


def restored(recording: Recording) -> tuple[Recording, Diagnosis | None]:
    """Correct the time stamps for lost samples, if the motion reveals their number."""
    odd = timestamp_anomalies(recording)
    if not odd.plain:
        return recording, None
    later = np.zeros(len(recording.t))
    later[odd.long + 1] = odd.lost * np.median(np.diff(recording.t))
    return replace(recording, t=recording.t + np.cumsum(later)), lost_samples(recording)[0]


def _turns_back(recording: Recording, arm: Arm, j: int) -> int:
    """Number of turns that shift a joint into its limits; 0 if it is within them, has none, or no number does."""
    low, high = float(recording.q[:, j].min()), float(recording.q[:, j].max())
    lower, upper = arm.lower[j] - SLACK, arm.upper[j] + SLACK
    if not arm.revolute[j] or not np.isfinite(upper - lower):
        return 0
    least, most = int(np.ceil((lower - low) / TURN)), int(np.floor((upper - high) / TURN))
    return min(range(least, most + 1), key=abs, default=0)
