"""Angles that jump by a turn because they were logged between -pi and pi."""

from dataclasses import replace

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Severity
from ident.observation.observation import ObserveOptions
from ident.recordings.checks import FASTEST
from ident.recordings.recording import Recording
from ident.support.arrays import Indices

TURN = 2.0 * np.pi
NEAR = 0.1
"""Largest relative difference of a jump from a turn, due to the motion within one sample."""


def wraps(recording: Recording) -> Indices:
    """Number of turns by which each position jumps after each row, shape (N - 1, n)."""
    step, interval = np.diff(recording.q, axis=0), np.diff(recording.t)
    turned = np.abs(np.abs(step) - TURN) < NEAR * TURN
    if not turned.any():
        return turned.astype(np.intp)
    fast = np.abs(step) > FASTEST * np.maximum(interval, np.median(interval))[:, None]
    return (np.sign(step) * (turned & fast)).astype(np.intp)


def continuous(recording: Recording) -> Recording:
    """Return the recording with unwrapped angles; the same object if none jumps."""
    turns = wraps(recording)
    if not turns.any():
        return recording
    q = recording.q.copy()
    q[1:] -= TURN * np.cumsum(turns, axis=0)
    return replace(recording, q=q)


def wrapped(recording: Recording, _: ObserveOptions | None = None) -> list[Diagnosis]:
    """Check for angles that jump by turns."""
    turns = wraps(recording)
    joints, rows = np.flatnonzero(turns.any(axis=0)).tolist(), np.flatnonzero(turns.any(axis=1))
    if not joints:
        return [Diagnosis(name="wrapped", sentence="no angle jumps by a turn", logs=(recording.name,))]
    jumps = int((turns != 0).sum())
    named = ", ".join(f"q{j + 1}" for j in joints)
    times = "once" if jumps == 1 else f"{jumps} times"
    return [
        Diagnosis(
            name="wrapped",
            severity=Severity.WEAK,
            sentence=f"{named} jump{'s' if len(joints) == 1 else ''} by 2 pi {times}, first after row {rows[0] + 1}, "
            f"{recording.t[rows[0]]:.6g} s; unwrapped",
            advice="log continuous angles",
            joints=tuple(joints),
            logs=(recording.name,),
            value=float(jumps),
            unit="jumps",
        )
    ]
