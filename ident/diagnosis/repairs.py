"""Repairs of recordings that need no guess, each with what was done; what needs none comes back as the same object.

A turn does not change where a joint is; what a gap separates are two recordings; where samples were lost while joints
moved, their steps show how many periods passed.
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
"""What positions may exceed limits by [rad]: of a zero that is not quite right."""


def repaired(
    recording: Recording, arm: Arm, observing: ObserveOptions
) -> tuple[tuple[Recording, ...], tuple[Diagnosis, ...]]:
    """All repairs, one after the other.

    Args:
        recording: As logged.
        arm: Whose limits joints keep.
        observing: Filters, which a part must be long enough for.

    Returns:
        The recording, or its parts; what was done, none if nothing was.
    """
    found = list[Diagnosis | None]()
    for repair in (unwrapped, restored, partial(turned_back, arm=arm)):
        recording, done = repair(recording)
        found.append(done)
    parts, done = split_at_gaps(recording, observing)
    return parts, tuple(each for each in (*found, done) if each is not None)


def unwrapped(recording: Recording) -> tuple[Recording, Diagnosis | None]:
    """A recording whose angles do not jump by turns."""
    repaired = continuous(recording)
    return (recording, None) if repaired is recording else (repaired, wrapped(recording)[0])


def turned_back(recording: Recording, arm: Arm) -> tuple[Recording, Diagnosis | None]:
    """A recording whose positions lie within the limits of the model, where whole turns are all that they are off by.

    Args:
        recording: Angles that do not jump.
        arm: Whose limits they are; joints without stay as they are.
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
    """The parts of a recording between gaps too long to be bridged, those that are long enough for the filters.

    Args:
        recording: With honest time stamps.
        observing: The filters; the default ones where None.
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
    """A recording whose time stamps leave out the samples that were lost, where the motion shows how many."""
    odd = timestamp_anomalies(recording)
    if not odd.plain:
        return recording, None
    later = np.zeros(len(recording.t))
    later[odd.long + 1] = odd.lost * np.median(np.diff(recording.t))
    return replace(recording, t=recording.t + np.cumsum(later)), lost_samples(recording)[0]


def _turns_back(recording: Recording, arm: Arm, j: int) -> int:
    """Turns that put a joint within its limits, 0 where it is within them, has none, or none does."""
    low, high = float(recording.q[:, j].min()), float(recording.q[:, j].max())
    lower, upper = arm.lower[j] - SLACK, arm.upper[j] + SLACK
    if not arm.revolute[j] or not np.isfinite(upper - lower):
        return 0
    least, most = int(np.ceil((lower - low) / TURN)), int(np.floor((upper - high) / TURN))
    return min(range(least, most + 1), key=abs, default=0)
