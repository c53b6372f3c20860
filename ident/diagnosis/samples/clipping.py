"""Currents that remain at one extreme value: a drive at its limit, or a clipped log."""

from collections.abc import Iterator

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Severity
from ident.numerics.neighbours import long_runs
from ident.observation.observation import ObserveOptions
from ident.recordings.recording import Recording
from ident.support.arrays import Array, Mask

LEAST = 4
"""Number of successive samples at the extreme value from which it is a limit, not a peak."""
SHARE = 0.0005
"""Smallest share of the samples at it."""


def clipped(v: Array, extreme: float) -> Mask:
    """Mask of samples of a current, shape (N,), in runs of at least `LEAST` at exactly its extreme value."""
    return long_runs(v == extreme, LEAST)


def clipping(recording: Recording, _: ObserveOptions) -> list[Diagnosis]:
    """Check currents for clipping."""
    found = [
        Diagnosis(
            name="clipping",
            severity=Severity.WRONG,
            sentence=f"v{j + 1} is clipped at its {name} value {extreme:.4g}: {int(at.sum())} samples, "
            f"first at {recording.t[int(at.argmax())]:.6g} s",
            advice="move more slowly or carry less",
            joints=(j,),
            logs=(recording.name,),
            value=100.0 * float(at.mean()),
            unit="% of the samples",
        )
        for j, name, extreme, at in _limits(recording)
    ]
    return found or [Diagnosis(name="clipping", sentence="no current is clipped", logs=(recording.name,))]


def spoilt(recording: Recording) -> Mask:
    """Mask of clipped samples of currents, shape (N, n)."""
    found = np.zeros(recording.v.shape, dtype=np.bool_)
    for j, _, _, at in _limits(recording):
        found[:, j] |= at
    return found


def _limits(recording: Recording) -> Iterator[tuple[int, str, float, Mask]]:
    """Joint, kind of limit, its value and mask of the samples at it, for each clipped current."""
    for j, v in enumerate(recording.v.T):
        for name, extreme in (("largest", float(v.max())), ("smallest", float(v.min()))):
            if clipped(v, extreme).sum() > SHARE * len(v) and not _coarse(v, extreme):
                yield j, name, extreme, v == extreme


def _coarse(v: Array, extreme: float) -> bool:
    """Whether the value before the extreme one is held equally long: a coarse or slowly logged current, not a limit."""
    others = v[v != extreme]
    if not len(others):
        return False
    near = float(others.max() if extreme > others.max() else others.min())
    return 2 * int(np.sum(v == near)) > int(np.sum(v == extreme))
