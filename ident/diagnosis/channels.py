"""Content of single columns of a log: wraps, spikes, limits, stops, and columns that are not what their names say."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Severity, finding
from ident.diagnosis.motion_quality import noise_std
from ident.numerics.neighbours import long_runs, quantum, runs
from ident.numerics.signals import edge_samples, low_passed
from ident.observation.full_rate import filtered_motion
from ident.observation.observation import ObserveOptions
from ident.recordings.checks import FASTEST, jumps, log_faults, spikes
from ident.recordings.recording import Recording, resampled
from ident.support.arrays import Array, Indices, Mask

TURN = 2.0 * np.pi
NEAR_TURN = 0.1
"""Largest relative difference of a jump from a turn, due to the motion within one sample."""


def wraps(recording: Recording) -> Indices:
    """Number of turns by which each position jumps after each row, shape (N - 1, n)."""
    step, interval = np.diff(recording.q, axis=0), np.diff(recording.t)
    turned = np.abs(np.abs(step) - TURN) < NEAR_TURN * TURN
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
    """Check for angles that jump by turns because they were logged between -pi and pi."""
    turns = wraps(recording)
    joints, rows = np.flatnonzero(turns.any(axis=0)).tolist(), np.flatnonzero(turns.any(axis=1))
    if not joints:
        return [finding(recording.name, "wrapped", "no angle jumps by a turn")]
    count = int((turns != 0).sum())
    sentence = (
        f"{', '.join(f'q{j + 1}' for j in joints)} jump{'s' if len(joints) == 1 else ''} by 2 pi {times(count)}, "
        f"first after row {rows[0] + 1}, {recording.t[rows[0]]:.6g} s; unwrapped"
    )
    return [
        finding(recording.name, "wrapped", sentence, "log continuous angles", joints=joints, value=count, unit="jumps")
    ]


def times(count: int) -> str:
    """A number of events in words."""
    return "once" if count == 1 else f"{count} times"


def values(recording: Recording, _: ObserveOptions) -> list[Diagnosis]:
    """Check for jumps and spikes, after unwrapping."""
    found, wrong = list[Diagnosis](), Severity.WRONG
    for each in log_faults(continuous(recording)):
        joints = () if each.joint is None else (each.joint,)
        found.append(finding(recording.name, "values", each.sentence, each.advice, severity=wrong, joints=joints))
    return found or [finding(recording.name, "values", "positions have no jumps, currents no spikes")]


def implausible(recording: Recording) -> Mask:
    """Mask of samples with a spike of each joint's current, or of any position, shape (N, n)."""
    recording = continuous(recording)
    q, v = spikes(recording)
    jumped = np.column_stack([jumps(recording, j) for j in range(recording.n)])
    q[:-1] |= jumped
    q[1:] |= jumped
    return v | q.any(axis=1, keepdims=True)


LEAST_CLIPPED, CLIPPED_SHARE = 4, 0.0005
"""Number of successive samples at the extreme value from which it is a limit, not a peak, and smallest share at it."""


def limits(recording: Recording) -> Iterator[tuple[int, str, float, Mask]]:
    """Joint, kind of limit, its value and mask of the samples at it, for each clipped current.

    If the value beside the extreme one is held equally long, the current is coarse or slowly logged, not limited.
    """
    for j, v in enumerate(recording.v.T):
        for name, extreme in (("largest", float(v.max())), ("smallest", float(v.min()))):
            at = v == extreme
            if long_runs(at, LEAST_CLIPPED).sum() <= CLIPPED_SHARE * len(v):
                continue
            others = v[~at]
            beside = (others.max() if name == "largest" else others.min()) if len(others) else None
            if beside is None or 2 * int(np.sum(v == beside)) <= int(at.sum()):
                yield j, name, extreme, at


def clipping(recording: Recording, _: ObserveOptions) -> list[Diagnosis]:
    """Check currents that remain at one extreme value: a drive at its limit, or a clipped log."""
    return [
        finding(
            recording.name, "clipping",
            f"v{j + 1} is clipped at its {name} value {extreme:.4g}: {int(at.sum())} samples, first at "
            f"{recording.t[int(at.argmax())]:.6g} s",
            "move more slowly or carry less",
            joints=(j,), severity=Severity.WRONG, value=100.0 * float(at.mean()), unit="% of the samples",
        )
        for j, name, extreme, at in limits(recording)
    ] or [finding(recording.name, "clipping", "no current is clipped")]  # fmt: skip


def clipped(recording: Recording) -> Mask:
    """Mask of clipped samples of currents, shape (N, n)."""
    found = np.zeros(recording.v.shape, dtype=np.bool_)
    for j, _, _, at in limits(recording):
        found[:, j] |= at
    return found


LEAST_FROZEN = 10
"""Smallest number of constant rows of a frozen column; fewer are held samples with hardly an effect on gains."""
AHEAD, BESIDE = 5.0, 5
"""Ratio of a step to its neighbours, and number of these to each side."""
AT_SPEED, MOVES = 0.5, 0.1
"""Speeds, as shares of the root mean square, from which a joint does not stop between two samples, and above which it
moves, as for the mask of reversals."""
CHANCE = 1e-9
"""False-alarm probability for a current in a fault-free log."""


def frozen(recording: Recording, _: ObserveOptions | None = None) -> list[Diagnosis]:
    """Check for positions and currents that remain exactly constant while the arm moves: a channel that stopped."""
    found = list[Diagnosis]()
    for kind, per_joint in (("q", frozen_positions(recording)), ("v", frozen_currents(recording))):
        for j, at in per_joint:
            first, last = recording.t[np.flatnonzero(at)[[0, -1]]]
            sentence = (
                f"{kind}{j + 1} stays constant for {int(at.sum())} samples while the arm moves, {first:.5g} to "
                f"{last:.5g} s"
            )
            found.append(
                finding(recording.name, "frozen", sentence, "leave out that part", joints=(j,), severity=Severity.WRONG,
                        value=100.0 * float(at.mean()), unit="% of the samples")
            )  # fmt: skip
    return found or [finding(recording.name, "frozen", "no column is frozen while the arm moves")]


def stopped(recording: Recording) -> Mask:
    """Mask of samples of frozen currents, and of all joints where a position is frozen, shape (N, n)."""
    found = np.zeros(recording.q.shape, dtype=np.bool_)
    for _, at in frozen_positions(recording):
        found |= at[:, None]
    for j, at in frozen_currents(recording):
        found[:, j] |= at
    return found


def frozen_positions(recording: Recording) -> Iterator[tuple[int, Mask]]:
    """Joints with the mask of samples with a frozen position.

    It remains constant and then jumps by `AHEAD` times its neighbouring steps, or stops at speed and remains constant
    to the end, while other joints move. A joint that comes to rest decelerates before, and starts slowly; the steps of
    a coarse encoder, or of a column that is logged at a lower rate, are as large as their neighbours.
    """
    step = np.diff(recording.q, axis=0)  # (N - 1, n)
    rms = np.sqrt(np.mean(step**2, axis=0))
    for j, q in enumerate(recording.q.T):
        at = np.zeros(len(q), dtype=np.bool_)
        rows = np.flatnonzero(step[:, j])  # the position changes after these
        edges = np.concatenate(([-1], rows, [len(q) - 1]))
        sizes = np.abs(step[rows, j])
        for k in np.flatnonzero(np.diff(edges) >= LEAST_FROZEN):
            start, end = int(edges[k]) + 1, int(edges[k + 1]) + 1
            if k == len(rows):  # to the end
                before = int(edges[max(0, k - 2)]) + 1
                stops = np.abs(q[start] - q[before]) > AT_SPEED * rms[j] * (start - before)
            else:
                near = np.r_[max(0, k - BESIDE) : k, k + 1 : min(len(sizes), k + 1 + BESIDE)]
                stops = len(near) > 0 and sizes[k] > AHEAD * np.median(sizes[near])
            if stops:
                others = np.delete(step[start : end - 1], j, axis=1) != 0.0
                at[start:end] = others.any(axis=1).mean() > 0.5
        if at.any():
            yield j, at


def frozen_currents(recording: Recording) -> Iterator[tuple[int, Mask]]:
    """Joints with the mask of samples with a current that is constant in motion for longer than by chance.

    A current that changes with probability p from row to row of a moving joint is constant for L rows somewhere with
    probability N (1 - p)^L.
    """
    for j, (q, v) in enumerate(zip(recording.q.T, recording.v.T, strict=True)):
        rate = np.gradient(q)
        moving = (np.abs(rate) > MOVES * np.sqrt(np.mean(rate**2)))[1:]
        at, step = np.zeros(len(v), dtype=np.bool_), np.diff(v)
        starts, ends = runs(step == 0.0)
        counted = moving.copy()
        if len(starts):  # possibly frozen samples are not used for p
            longest = int((ends - starts).argmax())
            counted[starts[longest] : ends[longest]] = False
        changing = float(np.mean(step[counted] != 0.0)) if counted.any() else 0.0
        if changing <= 0.0:
            continue
        least = LEAST_FROZEN + np.log(CHANCE / len(v)) / np.log1p(-min(changing, 1.0 - 1e-6))
        stayed = np.concatenate(([0], np.cumsum(moving)))
        long = stayed[ends] - stayed[starts] >= least  # at rest a current may be constant
        coarse, extremes = quantum(v) if long.any() else None, (float(v.min()), float(v.max()))
        for start, end in zip(starts[long].tolist(), ends[long].tolist(), strict=True):
            # never changes again, or by more than a step of a coarse sensor; clipping is reported by another check
            jumps_on = coarse is None or end >= len(step) or np.abs(step[end]) > 1.5 * coarse
            if float(v[start]) not in extremes and jumps_on:
                at[start : end + 1] = True
        if at.any():
            yield j, at


ALIKE = 0.01
"""Residual of a column after a fit of another one, with factor and offset, below which it is a copy.

After a fit of viscous friction, a current retains noise and steps of Coulomb friction of some per cent.
"""
NEAR_ZERO = 0.25
"""Size of a current, in standard deviations of its noise, below which noise makes a third of the samples negative or
more, however large the current usually is."""
TOUCHES = 22
"""Smallest number of such samples without a negative one for which the current has no sign: one chance in four million
where every second one would be negative, as 5 standard deviations are."""


def columns(recording: Recording, observing: ObserveOptions) -> list[Diagnosis]:
    """Check for columns that are copies of others, and for currents without signs."""
    n, v, wrong = recording.n, recording.v, list[tuple[tuple[int, ...], str]]()
    step = np.diff(recording.q, axis=0)
    to_and_fro = ((step > 0.0).any(axis=0) & (step < 0.0).any(axis=0)).all()  # where friction has both signs
    if n > 1 and to_and_fro and (v >= 0.0).all():
        every = tuple(range(n))
        wrong.append(
            (every, "v is never negative on any joint, though all joints move in both directions: v has no sign")
        )
    else:
        one_sided, little = (v >= 0.0).all(axis=0) | (v <= 0.0).all(axis=0), NEAR_ZERO * noise_std(v)
        on = np.abs(np.diff(v, axis=0)) > little  # while a drive is off, its current has no noise
        near = on & (np.abs(v[1:]) < little)
        unsigned = np.flatnonzero(one_sided & (near.sum(axis=0) >= TOUCHES)).tolist()
        wrong += [((j,), f"v{j + 1} often is near zero, but never changes its sign: it has none") for j in unsigned]
    for kind, x in (("q", recording.q), ("v", v)):
        left = _unexplained(x, x)
        wrong += [
            ((i, j), f"{kind}{j + 1} is a copy of {kind}{i + 1}, up to a factor and an offset")
            for i, j in combinations(range(n), 2)
            if left[j, i] < 1e-6
        ]
    even = resampled(recording)
    edge = edge_samples(even.period, observing.cutoff_hz)
    inner = slice(edge, max(edge + 2, len(even.t) - edge))
    smooth = filtered_motion(even, observing.cutoff_hz)
    v = low_passed(even.v, even.period, observing.cutoff_hz)[inner]
    left = np.array([np.diag(_unexplained(v, x[inner])) for x in smooth])  # (3, n)
    for j in range(n):
        for what, share in zip(("position", "speed", "acceleration"), left[:, j], strict=True):
            if share < ALIKE:
                wrong.append(((j,), f"v{j + 1} is the {what} of joint {j + 1}, times a factor"))
    found, current = list[Diagnosis](), "log the current, measured or commanded, with its sign"
    for joints, sentence in wrong:
        advice = current if sentence[0] == "v" else "log the position of each joint"
        severity = Severity.WEAK if "acceleration" in sentence else Severity.WRONG  # that of an inertia alone
        found.append(finding(recording.name, "columns", sentence, advice, severity=severity, joints=joints))
    return found or [finding(recording.name, "columns", "no column is a copy of another")]


def _unexplained(y: Array, x: Array) -> Array:
    """Residual share of each column of y after a fit of each of x, with offset: sqrt(1 - r^2), r their correlation."""
    unit = list[Array]()
    for each in (y, x):
        rows = np.ascontiguousarray(each.T)
        rows = rows - rows.mean(axis=1, keepdims=True)
        size = np.linalg.norm(rows, axis=1, keepdims=True)
        unit.append(np.divide(rows, size, out=np.zeros_like(rows), where=size > 0.0))
    return np.sqrt(np.maximum(1.0 - (unit[0] @ unit[1].T) ** 2, 0.0))
