"""Columns with another content than their names: copies, a speed in place of a current, currents without signs."""

from dataclasses import replace
from itertools import combinations

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Severity
from ident.diagnosis.samples.noise import noise_std
from ident.numerics.signals import edge_samples, low_passed
from ident.observation.full_rate import filtered_motion
from ident.observation.observation import ObserveOptions
from ident.recordings.recording import Recording, resampled
from ident.support.arrays import Array

ALIKE = 0.01
"""Residual of a column after a fit of another one, with factor and offset, below which it is a copy.

After a fit of viscous friction, a current retains noise and steps of Coulomb friction of some per cent.
"""
NEAR = 0.25
"""Size of a current, in standard deviations of its noise, below which noise makes a third of the samples negative or
more, however large the current usually is."""
TOUCHES = 22
"""Smallest number of such samples without a negative one for which the current has no sign: one chance in four million
where every second one would be negative, as 5 standard deviations are."""


def columns(recording: Recording, observing: ObserveOptions) -> list[Diagnosis]:
    """Check for columns that are copies of others, and for currents without signs."""
    found: list[Diagnosis] = []
    step = np.diff(recording.q, axis=0)
    to_and_fro = ((step > 0.0).any(axis=0) & (step < 0.0).any(axis=0)).all()  # where friction has both signs
    if recording.n > 1 and to_and_fro and (recording.v >= 0.0).all():
        sentence = "v is never negative on any joint, though all joints move in both directions: v has no sign"
        found.append(_wrong(recording, tuple(range(recording.n)), sentence))
    else:
        found += [
            _wrong(recording, (j,), f"v{j + 1} often is near zero, but never changes its sign: it has none")
            for j in _without_sign(recording.v)
        ]
    for kind, x in (("q", recording.q), ("v", recording.v)):
        left = _left(x, x)
        found += [
            _wrong(recording, (i, j), f"{kind}{j + 1} is a copy of {kind}{i + 1}, up to a factor and an offset")
            for i, j in combinations(range(recording.n), 2)
            if left[j, i] < 1e-6
        ]
    even = resampled(recording)
    edge = edge_samples(even.period, observing.cutoff_hz)
    inner = slice(edge, max(edge + 2, len(even.t) - edge))
    smooth = filtered_motion(even, observing.cutoff_hz)
    v = low_passed(even.v, even.period, observing.cutoff_hz)[inner]
    left = np.array([np.diag(_left(v, x[inner])) for x in smooth])  # (3, n)
    for j in range(recording.n):
        for what, share in zip(("position", "speed", "acceleration"), left[:, j], strict=True):
            if share < ALIKE:
                sentence = f"v{j + 1} is the {what} of joint {j + 1}, times a factor"
                copied = _wrong(recording, (j,), sentence)  # of an inertia alone
                found.append(replace(copied, severity=Severity.WEAK) if what == "acceleration" else copied)
    return found or [Diagnosis(name="columns", sentence="no column is a copy of another", logs=(recording.name,))]


def _without_sign(v: Array) -> list[int]:
    """Columns that noise would make negative now and then, or positive, if they had signs."""
    one_sided, little = (v >= 0.0).all(axis=0) | (v <= 0.0).all(axis=0), NEAR * noise_std(v)
    on = np.abs(np.diff(v, axis=0)) > little  # while a drive is off, its current has no noise
    near = on & (np.abs(v[1:]) < little)
    return np.flatnonzero(one_sided & (near.sum(axis=0) >= TOUCHES)).tolist()


def _wrong(recording: Recording, joints: tuple[int, ...], sentence: str) -> Diagnosis:
    advice = (
        "log the current, measured or commanded, with its sign"
        if sentence[0] == "v"
        else "log the position of each joint"
    )
    return Diagnosis(
        name="columns",
        severity=Severity.WRONG,
        sentence=sentence,
        advice=advice,
        joints=joints,
        logs=(recording.name,),
    )


def _left(y: Array, x: Array) -> Array:
    """Residual share of each column of y after a fit of each of x, with offset: sqrt(1 - r^2), r their correlation."""
    return np.sqrt(np.maximum(1.0 - (_unit(y) @ _unit(x).T) ** 2, 0.0))


def _unit(x: Array) -> Array:
    """Columns minus their means, normalised, as rows, shape (n, N); zero for constant columns."""
    x = np.ascontiguousarray(x.T)
    x = x - x.mean(axis=1, keepdims=True)
    size = np.linalg.norm(x, axis=1, keepdims=True)
    return np.divide(x, size, out=np.zeros_like(x), where=size > 0.0)
