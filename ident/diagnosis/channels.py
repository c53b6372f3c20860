"""Content of single columns of a log: wraps, spikes, limits, stops, and columns that are not what their names say."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.diagnosis import Diagnosis, Severity, finding
from ident.diagnosis.motion_quality import by_joint, current_noise
from ident.numerics.neighbours import long_runs, quantum, runs
from ident.numerics.signals import edge_samples, group_means, low_passed
from ident.observation.full_rate import filtered_motion
from ident.observation.observation import ObserveOptions
from ident.recordings.checks import FASTEST, foreign_unit, jumps, log_faults, spikes
from ident.recordings.recording import Recording, resampled
from ident.support.arrays import Array, Indices, Mask, once_per_object

TURN = 2.0 * np.pi
NEAR_TURN = 0.1
"""Largest relative difference of a jump from a turn, due to the motion within one sample."""


@once_per_object
def wraps(recording: Recording) -> NDArray[np.int8]:
    """Number of turns by which each position jumps after each row, shape (n, N - 1)."""
    step, interval = by_joint(recording).dq, np.diff(recording.t)
    turned = np.abs(np.abs(step) - TURN) < NEAR_TURN * TURN
    if turned.any():
        turned &= np.abs(step) > FASTEST * np.maximum(interval, np.median(interval))
        turned &= np.array([[foreign_unit(q) == 1.0] for q in recording.q.T])
    return np.where(turned, np.sign(step), 0.0).astype(np.int8)


def continuous(recording: Recording) -> Recording:
    """Return the recording with unwrapped angles; the same object if none jumps."""
    turns = wraps(recording)
    if not turns.any():
        return recording
    q = recording.q.copy()
    q[1:] -= TURN * np.cumsum(turns, axis=1).T
    return replace(recording, q=q)


def wrapped(recording: Recording, _: ObserveOptions | None = None) -> list[Diagnosis]:
    """Check for angles that jump by turns because they were logged between -pi and pi."""
    turns, name = wraps(recording), recording.name
    joints, rows = np.flatnonzero(turns.any(axis=1)).tolist(), np.flatnonzero(turns.any(axis=0))
    if not joints:
        return [finding(name, "wrapped", "no angle jumps by a turn")]
    count = int((turns != 0).sum())
    sentence = (
        f"{', '.join(f'q{j + 1}' for j in joints)} jump{'s' if len(joints) == 1 else ''} by 2 pi {times(count)}, "
        f"{first(recording, rows)}; unwrapped"
    )
    return [finding(name, "wrapped", sentence, "log continuous angles", joints=joints, value=count, unit="jumps")]


def times(count: int) -> str:
    """A number of events in words."""
    return "once" if count == 1 else f"{count} times"


def first(recording: Recording, rows: Indices) -> str:
    """The place of the first of some rows in words."""
    return f"first after row {rows[0] + 1}, {recording.t[rows[0]]:.6g} s"


def values(recording: Recording, _: ObserveOptions) -> list[Diagnosis]:
    """Check for jumps and spikes, after unwrapping."""
    found = [
        finding(
            recording.name, "values", each.sentence, each.advice, severity=Severity.WRONG,
            joints=() if each.joint is None else (each.joint,),
        )
        for each in log_faults(continuous(recording))
    ]  # fmt: skip
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

Unmeasured = tuple[str, int, str, Mask]
"""A column, as `q` or `v` and the joint from 0, with the fault in words, and the mask of its samples (N,)."""


def clipped(recording: Recording) -> Iterator[Unmeasured]:
    """Currents at a limit of the drive or the log; a coarse one holds the value beside it equally long."""
    least = CLIPPED_SHARE * len(recording.t)
    for j, v in enumerate(by_joint(recording).v):
        for name, extreme in (("largest", float(v.max())), ("smallest", float(v.min()))):
            at = v == extreme
            count = int(at.sum())
            if count <= least or long_runs(at, LEAST_CLIPPED).sum() <= least:
                continue
            others = v[~at]
            beside = (others.max() if name == "largest" else others.min()) if len(others) else None
            if beside is None or 2 * int(np.sum(v == beside)) <= count:
                when = f"{count} samples, first at {recording.t[int(at.argmax())]:.6g} s"
                yield "v", j, f"is clipped at its {name} value {extreme:.4g}: {when}", at


LEAST_FROZEN = 10
"""Smallest number of constant rows of a frozen column; fewer are held samples with hardly an effect on gains."""
AHEAD, BESIDE = 5.0, 5
"""Ratio of a step to its neighbours, and number of these to each side."""
AT_SPEED, MOVES = 0.5, 0.1
"""Speeds, as shares of the root mean square, from which a joint does not stop between two samples, and above which it
moves, as for the mask of reversals."""
CHANCE = 1e-9
"""False-alarm probability for a current in a fault-free log."""


def frozen(recording: Recording) -> Iterator[Unmeasured]:
    """Positions and currents that remain exactly constant while the arm moves: a channel that stopped."""
    samples = by_joint(recording)
    for kind, steps, one in (("q", samples.dq, _frozen_position), ("v", samples.dv, _frozen_current)):
        for j, step in enumerate(steps):
            starts, ends = runs(step == 0.0)
            if (ends - starts).max(initial=0) + 1 < LEAST_FROZEN:
                continue
            at = one(recording, j)
            if at.any():
                start, end = recording.t[np.flatnonzero(at)[[0, -1]]]
                place = f"{int(at.sum())} samples while the arm moves, {start:.5g} to {end:.5g} s"
                yield kind, j, f"stays constant for {place}", at


def _frozen_position(recording: Recording, j: int) -> Mask:
    """Mask of the samples of a frozen position, which then jumps, or stops at speed, while other joints move.

    A joint that comes to rest decelerates before, and starts slowly; steps of a coarse encoder, or of a column logged
    at a lower rate, are as large as their neighbours.
    """
    samples = by_joint(recording)
    q, step, at = samples.q[j], samples.dq[j], np.zeros(len(recording.t), dtype=np.bool_)
    rows = np.flatnonzero(step)  # the position changes after these
    edges = np.concatenate(([-1], rows, [len(q) - 1]))
    for k in np.flatnonzero(np.diff(edges) >= LEAST_FROZEN):
        start, end = int(edges[k]) + 1, int(edges[k + 1]) + 1
        if k == len(rows):  # to the end
            before = int(edges[max(0, k - 2)]) + 1
            stops = np.abs(q[start] - q[before]) > AT_SPEED * np.sqrt(np.mean(step**2)) * (start - before)
        else:
            near = rows[np.r_[max(0, k - BESIDE) : k, k + 1 : min(len(rows), k + 1 + BESIDE)]]
            stops = len(near) > 0 and np.abs(step[rows[k]]) > AHEAD * np.median(np.abs(step[near]))
        if stops:
            others = np.delete(samples.dq[:, start : end - 1], j, axis=0) != 0.0
            at[start:end] = others.any(axis=0).mean() > 0.5
    return at


def _frozen_current(recording: Recording, j: int) -> Mask:
    """Mask of the samples of a current that is constant in motion for longer than by chance, N (1 - p)^L for L rows.

    p is the probability of a change from row to row of a moving joint.
    """
    samples = by_joint(recording)
    v, step, at = samples.v[j], samples.dv[j], np.zeros(len(recording.t), dtype=np.bool_)
    starts, ends = runs(step == 0.0)
    rate = np.gradient(samples.q[j])
    moving = (np.abs(rate) > MOVES * np.sqrt(np.mean(rate**2)))[1:]
    counted, longest = moving.copy(), int((ends - starts).argmax())
    counted[starts[longest] : ends[longest]] = False  # possibly frozen samples are not used for p
    changing = float(np.mean(step[counted] != 0.0)) if counted.any() else 0.0
    if changing <= 0.0:
        return at
    least = LEAST_FROZEN + np.log(CHANCE / len(v)) / np.log1p(-min(changing, 1.0 - 1e-6))
    stayed = np.concatenate(([0], np.cumsum(moving)))
    long = stayed[ends] - stayed[starts] >= least  # at rest a current may be constant
    coarse, extremes = quantum(v) if long.any() else None, (float(v.min()), float(v.max()))
    for start, end in zip(starts[long].tolist(), ends[long].tolist(), strict=True):
        # never changes again, or by more than a step of a coarse sensor; clipping is reported by another check
        jumps_on = coarse is None or end >= len(step) or np.abs(step[end]) > 1.5 * coarse
        if float(v[start]) not in extremes and jumps_on:
            at[start : end + 1] = True
    return at


UNMEASURED: dict[str, tuple[Callable[[Recording], Iterator[Unmeasured]], str, str]] = {
    "clipping": (clipped, "move more slowly or carry less", "no current is clipped"),
    "frozen": (frozen, "leave out that part", "no column is frozen while the arm moves"),
}
"""Faults of columns for some time: what finds them, advice, and the sentence without one."""


def unmeasured(name: str, recording: Recording, _: ObserveOptions | None = None) -> list[Diagnosis]:
    """Check for a fault of `UNMEASURED`."""
    find, advice, good = UNMEASURED[name]
    return [
        finding(
            recording.name, name, f"{kind}{j + 1} {words}", advice, severity=Severity.WRONG, joints=(j,),
            value=100.0 * float(at.mean()), unit="% of the samples",
        )
        for kind, j, words, at in find(recording)
    ] or [finding(recording.name, name, good)]  # fmt: skip


def unmeasured_samples(name: str, recording: Recording) -> Mask:
    """Mask of the samples with a fault of `UNMEASURED`, of a position for all joints, shape (N, n)."""
    found = np.zeros(recording.q.shape, dtype=np.bool_)
    for kind, j, _, at in UNMEASURED[name][0](recording):
        found[:, slice(None) if kind == "q" else slice(j, j + 1)] |= at[:, None]
    return found


ALIKE = 0.01
"""Residual of a column after a fit of another one, with factor and offset, below which it is a copy; of viscous
friction, noise and steps of Coulomb friction of some per cent remain."""
COARSE_RATE = 16.0
"""Rate of the samples that are compared, in multiples of the cut-off: there the filter differs by less than .2 %."""
NEAR_ZERO = 0.25
"""Size of a current, in standard deviations of its noise, below which noise makes a third of the samples negative or
more, however large the current usually is."""
TOUCHES = 22
"""Smallest number of such samples without a negative one for which the current has no sign: one chance in four million
where every second one would be negative, as 5 standard deviations are."""


def columns(recording: Recording, observing: ObserveOptions) -> list[Diagnosis]:
    """Check for columns that are copies of others, and for currents without signs."""
    (q, v, dq, dv), wrong = by_joint(recording), list[tuple[tuple[int, ...], str]]()
    n, low, high = len(q), v.min(axis=1), v.max(axis=1)
    to_and_fro = (dq.max(axis=1) > 0.0).all() and (dq.min(axis=1) < 0.0).all()  # where friction has both signs
    if n > 2 and to_and_fro and (low >= 0.0).all():  # gravity may exceed friction on both joints of two
        sentence = "v is never negative on any joint, though all joints move in both directions: v has no sign"
        wrong.append((tuple(range(n)), sentence))
    else:
        for j in np.flatnonzero((low >= 0.0) | (high <= 0.0)).tolist():
            little = NEAR_ZERO * current_noise(recording)[j]
            on = np.abs(dv[j]) > little  # while a drive is off, its current has no noise
            if np.sum(on & (np.abs(v[j, 1:]) < little)) >= TOUCHES:
                wrong.append(((j,), f"v{j + 1} often is near zero, but never changes its sign: it has none"))
    for kind, unit in (("q", _unit(q)), ("v", _unit(v))):
        left = _unexplained(unit @ unit.T)
        wrong += [
            ((i, j), f"{kind}{j + 1} is a copy of {kind}{i + 1}, up to a factor and an offset")
            for i, j in combinations(range(n), 2)
            if left[j, i] < 1e-6
        ]
    even = resampled(recording)
    group = max(1, int(1.0 / (COARSE_RATE * observing.cutoff_hz * even.period)))
    current = low_passed(group_means(even.v, group), group * even.period, observing.cutoff_hz)
    edge = -(-edge_samples(even.period, observing.cutoff_hz) // group)
    inner = slice(edge, max(edge + 2, len(current) - edge))
    unit, whole, left = _unit(current[inner].T), len(current) * group, list[Array]()
    for x in filtered_motion(even, observing.cutoff_hz):  # positions, speeds, accelerations
        sums = x.T[:, :whole].reshape(n, -1, group) @ np.ones(group)
        left.append(_unexplained(np.einsum("jk,jk->j", unit, _unit(sums[:, inner]))))
    wrong += [
        ((j,), f"v{j + 1} is the {('position', 'speed', 'acceleration')[k]} of joint {j + 1}, times a factor")
        for j, k in np.argwhere(np.transpose(left) < ALIKE).tolist()
    ]
    found = list[Diagnosis]()
    for joints, sentence in wrong:
        of_v = "log the current, measured or commanded, with its sign"
        advice = of_v if sentence[0] == "v" else "log the position of each joint"
        severity = Severity.WEAK if "acceleration" in sentence else Severity.WRONG  # that of an inertia alone
        found.append(finding(recording.name, "columns", sentence, advice, severity=severity, joints=joints))
    return found or [finding(recording.name, "columns", "no column is a copy of another")]


def _unit(x: Array) -> Array:
    """Rows without their mean, of unit norm, zero if they are constant."""
    rows = np.ascontiguousarray(x - x.mean(axis=1, keepdims=True))
    size = np.linalg.norm(rows, axis=1, keepdims=True)
    return np.divide(rows, size, out=np.zeros_like(rows), where=size > 0.0)


def _unexplained(r: Array) -> Array:
    """Residual share of a fit of one signal by another, with offset, from their correlation."""
    return np.sqrt(np.maximum(1.0 - r**2, 0.0))
