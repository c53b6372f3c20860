"""Implausible values: positions that jump, currents with spikes, time in other units."""

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Severity
from ident.diagnosis.samples.wrapped import continuous
from ident.observation.observation import ObserveOptions
from ident.recordings.checks import jumps, log_faults, spikes
from ident.recordings.recording import Recording
from ident.support.arrays import Mask


def values(recording: Recording, _: ObserveOptions) -> list[Diagnosis]:
    """Check for jumps and spikes, after unwrapping."""
    found = [
        Diagnosis(
            name="values",
            severity=Severity.WRONG,
            sentence=each.sentence,
            advice=each.advice,
            joints=() if each.joint is None else (each.joint,),
            logs=(recording.name,),
        )
        for each in log_faults(continuous(recording))
    ]
    return found or [
        Diagnosis(name="values", sentence="positions have no jumps, currents no spikes", logs=(recording.name,))
    ]


def spoilt(recording: Recording) -> Mask:
    """Mask of samples with a spike of each joint's current, or of any position, shape (N, n)."""
    recording = continuous(recording)
    q, v = spikes(recording)
    jumped = np.column_stack([jumps(recording, j) for j in range(recording.n)])
    q[:-1] |= jumped
    q[1:] |= jumped
    return v | q.any(axis=1, keepdims=True)
