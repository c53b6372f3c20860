"""Positions and currents that remain exactly constant while the arm moves: a channel that stopped.

A position is frozen if it remains constant and then jumps by `AHEAD` times its neighbouring steps, or if it stops at
speed and remains constant to the end, while other joints move. A joint that comes to rest decelerates before, and
starts slowly; the steps of a coarse encoder, or of a column that is logged at a lower rate, are as large as their
neighbours.

A current is frozen if it remains constant while its joint moves, for longer than is plausible by chance: a current that
changes with probability p from row to row of a moving joint is constant for L rows somewhere with probability N (1 -
p)^L.
"""

from collections.abc import Iterator

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Severity
from ident.numerics.neighbours import quantum, runs
from ident.observation.observation import ObserveOptions
from ident.recordings.recording import Recording
from ident.support.arrays import Array, Mask

LEAST = 10
"""Smallest number of constant rows of a frozen column; fewer are held samples with hardly an effect on gains."""
AHEAD = 5.0
"""Ratio of a step to its neighbours."""
BESIDE = 5
"""Number of steps to each side that a step is compared with."""
AT_SPEED = 0.5
"""Speed, as a share of its root mean square, from which a joint does not stop between two samples."""
CHANCE = 1e-9
"""False-alarm probability for a current in a fault-free log."""
MOVES = 0.1
"""Speed, as a share of its root mean square, above which a joint moves: as for the mask of reversals."""


def frozen(recording: Recording, _: ObserveOptions | None = None) -> list[Diagnosis]:
    """Check for positions and currents that freeze."""
    found = list[Diagnosis]()
    for kind, per_joint in (("q", _frozen_positions(recording)), ("v", _frozen_currents(recording))):
        for j, at in per_joint:
            first, last = recording.t[np.flatnonzero(at)[[0, -1]]]
            found.append(
                Diagnosis(
                    name="frozen",
                    severity=Severity.WRONG,
                    sentence=f"{kind}{j + 1} stays constant for {int(at.sum())} samples while the arm moves, "
                    f"{first:.5g} to {last:.5g} s",
                    advice="leave out that part",
                    joints=(j,),
                    logs=(recording.name,),
                    value=100.0 * float(at.mean()),
                    unit="% of the samples",
                )
            )
    return found or [
        Diagnosis(name="frozen", sentence="no column is frozen while the arm moves", logs=(recording.name,))
    ]


def spoilt(recording: Recording) -> Mask:
    """Mask of samples of frozen currents, and of all joints where a position is frozen, shape (N, n)."""
    found = np.zeros(recording.q.shape, dtype=np.bool_)
    for _, at in _frozen_positions(recording):
        found |= at[:, None]
    for j, at in _frozen_currents(recording):
        found[:, j] |= at
    return found


def _frozen_positions(recording: Recording) -> Iterator[tuple[int, Mask]]:
    """Joints with the mask of samples with a frozen position."""
    changes = np.diff(recording.q, axis=0) != 0.0  # (N - 1, n)
    rms = np.sqrt(np.mean(np.diff(recording.q, axis=0) ** 2, axis=0))  # a row
    for j in range(recording.n):
        at = np.zeros(len(recording.t), dtype=np.bool_)
        for start, end in _stops(recording.q[:, j], AT_SPEED * float(rms[j])):
            others = np.delete(changes[start : end - 1], j, axis=1).any(axis=1)
            at[start:end] = others.mean() > 0.5
        if at.any():
            yield j, at


def _stops(q: Array, at_speed: float) -> Iterator[tuple[int, int]]:
    """First sample, and the one after the last, of each interval with a frozen position."""
    steps = np.diff(q)
    rows = np.flatnonzero(steps)  # the position changes after these
    edges = np.concatenate(([-1], rows, [len(q) - 1]))
    sizes, lengths = np.abs(steps[rows]), np.diff(edges)  # n steps have n + 1 times between them
    for k in np.flatnonzero(lengths >= LEAST):
        if k == len(rows):  # to the end
            before = edges[k] - edges[max(0, k - 2)]
            stops = float(np.abs(q[edges[k] + 1] - q[edges[max(0, k - 2)] + 1])) > at_speed * before
        else:
            near = np.r_[max(0, k - BESIDE) : k, k + 1 : min(len(sizes), k + 1 + BESIDE)]
            stops = bool(len(near)) and sizes[k] > AHEAD * np.median(sizes[near])
        if stops:
            yield int(edges[k]) + 1, int(edges[k + 1]) + 1


def _frozen_currents(recording: Recording) -> Iterator[tuple[int, Mask]]:
    """Joints with the mask of samples with a frozen current."""
    for j, v in enumerate(recording.v.T):
        moving = _moving(recording.q[:, j])
        at = np.zeros(len(v), dtype=np.bool_)
        for start, end in _long_stays(v, moving):
            at[start:end] = True
        if at.any():
            yield j, at


def _long_stays(v: Array, moving: Mask) -> Iterator[tuple[int, int]]:
    """First sample, and the one after the last, of each interval with a current that is constant for too long."""
    step = np.diff(v)
    starts, ends = runs(step == 0.0)
    counted = moving[1:].copy()
    longest = int((ends - starts).argmax()) if len(starts) else 0  # possibly frozen samples are not used for p
    if len(starts):
        counted[starts[longest] : ends[longest]] = False
    changing = float(np.mean(step[counted] != 0.0)) if counted.any() else 0.0
    if changing <= 0.0:
        return
    least = LEAST + np.log(CHANCE / len(v)) / np.log1p(-min(changing, 1.0 - 1e-6))
    stayed = np.concatenate(([0], np.cumsum(moving[1:])))
    long = stayed[ends] - stayed[starts] >= least  # at rest a current may be constant
    if not long.any():
        return
    coarse = quantum(v)
    extremes = (float(v.min()), float(v.max()))
    for start, end in zip(starts[long], ends[long], strict=True):
        clipped = float(v[start]) in extremes  # reported by another check
        if not clipped and _jumps(step, start, end, coarse):
            yield int(start), int(end) + 1


def _jumps(step: Array, start: int, end: int, coarse: float | None) -> bool:
    """Whether a current never changes again, or does so by more than a step of a coarse sensor."""
    return coarse is None or end >= len(step) or bool(np.abs(step[end]) > 1.5 * coarse)


def _moving(q: Array) -> Mask:
    """Mask of samples at which a joint moves, shape (N,)."""
    rate = np.gradient(q)
    return np.abs(rate) > MOVES * np.sqrt(np.mean(rate**2))
