"""Fast selection of hypotheses for the exact comparison: all of them on subsampled states, by normal equations.

Currents are filtered, but the regressor is evaluated at single samples: it lacks the effect of the filter on products
and on friction steps, which may imitate a small fault. Selected hypotheses are therefore compared on the estimator's
rows (`ident.diagnosis.comparison`) before they are reported.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ident.diagnosis.alternative import Alternative
from ident.diagnosis.logs import Hypothesis, LogHypothesis, Logs
from ident.diagnosis.subsampled_states import SubsampledStates, subsampled_states
from ident.model.arm import Arm
from ident.model.parameters import STANDARD
from ident.model.regressor import regressor_blocks
from ident.model.structure import Structure, independent_columns, structure_of
from ident.support.arrays import Array, Indices, Mask

MOST_STATES = 90
"""Number of subsampled states of each log."""
RIDGE = 1e-10
"""Prior precision as in the comparison, for fewer rows."""
ASLANT = np.array([3.6, -4.8, 8.0])
"""Gravity [m/s^2] in a general direction: what is unidentifiable with it is so with any gravity."""
TOGETHER = 16
"""Number of hypotheses on a log whose regressors are computed in one recursion; more exceed the processor's cache."""
NOTHING = 1e-3
"""Residual share of a current below which nothing is left to explain: filters cause as much with exact data."""
DRIFTING = np.array([STANDARD.index(name) for name in ("Fv", "Fc", "off")])


@dataclass(frozen=True, slots=True, eq=False)
class Screened:
    """Improvement by an alternative on subsampled states over the logs as they are.

    Attributes:
        alternative: The alternative.
        gain: Improvement of the log-likelihood of white residuals, of each column of currents, shape (n,).
    """

    alternative: Alternative
    gain: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Normal:
    """Normal equations of one log under S hypotheses on its positions, after elimination of the log's own columns.

    Attributes:
        gram: Gram matrices of the shared columns, n arrays (S, p, p).
        rhs: Shared columns times all currents, n arrays (S, p, n).
        size: Sums of squares of the shared columns before the elimination, n arrays (S, p).
        square: Sum of squares of each current after the elimination on each joint's samples, joint first, shape
            (S, n, n).
        rows: Number of samples of each joint, shape (S, n).
        felt: Number of own columns of each joint that are not zero, shape (S, n).
    """

    gram: list[Array]
    rhs: list[Array]
    size: list[Array]
    square: Array
    rows: Array
    felt: Array


@dataclass(frozen=True, slots=True)
class _Columns:
    """Columns of the standard regressor of one joint in one log, as indices.

    Attributes:
        shared: Columns common to all logs, shape (p,).
        own: Columns of this log only, shape (o,).
    """

    shared: Indices
    own: Indices


State = tuple[int, bytes, bytes]
"""A log, and the values that distinguish hypotheses on its positions and the arm."""


def screened(logs: Logs, alternatives: Sequence[Alternative]) -> list[Screened]:
    """Return the improvements by alternatives on subsampled states, the best first."""
    at = looked_at(logs)
    left, freedom = unexplained(logs, [logs.given, *(each.hypothesis for each in alternatives)], at)
    rms = [np.mean(each.v**2, axis=0) for each in at]
    noise = NOTHING**2 * np.column_stack(rms)  # (n, logs)
    known = np.isfinite(left[0]) & np.isfinite(left[1:])
    ratio = np.maximum(left[0], noise) / np.maximum(np.where(known, left[1:], 1.0), noise)
    gain = 0.5 * np.minimum(freedom[0], freedom[1:]) * np.log(np.where(known, ratio, 1.0))
    found = [Screened(each, own.sum(axis=1)) for each, own in zip(alternatives, gain, strict=True)]
    return sorted(found, key=lambda each: -float(each.gain.sum()))


def looked_at(logs: Logs) -> list[SubsampledStates]:
    """Subsampled states of each log."""
    return [subsampled_states(each, MOST_STATES, logs.observing) for each in logs.recordings]


def unexplained(logs: Logs, hypotheses: Sequence[Hypothesis], at: Sequence[SubsampledStates]) -> tuple[Array, Array]:
    """Return the residuals of the currents under hypotheses.

    Returns:
        Mean squares of each column of currents in each log, in its own unit, infinite with too few samples, and degrees
        of freedom, each of shape (hypotheses, n, logs).
    """
    left, freedom = np.empty((2, len(hypotheses), logs.structure.arm.n, len(at)))
    upright = np.array([bool((each.gravity == logs.structure.arm.gravity).all()) for each in hypotheses])
    for which in (True, False):
        own = np.flatnonzero(upright == which)
        if len(own):
            left[own], freedom[own] = _left(logs, at, [hypotheses[int(k)] for k in own], upright=which)
    return left, freedom


def _left(
    logs: Logs, at: Sequence[SubsampledStates], hypotheses: Sequence[Hypothesis], *, upright: bool
) -> tuple[Array, Array]:
    """Mean squared residual of each column of each log in its own unit, and numbers of samples, (K, n, logs) each."""
    n, count = logs.structure.arm.n, len(at)
    columns = _columns_of(logs, upright=upright)
    number, normals = _normals(logs.structure.arm, at, hypotheses, columns)
    order = np.array([[how.v_order for how in each.logs] for each in hypotheses])  # (K, logs, n)
    unit = np.array([[how.v_factor for how in each.logs] for each in hypotheses])
    left, many = np.full((len(hypotheses), n, count), np.inf), np.zeros((len(hypotheses), n, count))
    every = np.arange(len(hypotheses))
    for j in range(n):
        equations = np.column_stack((number, order[..., j], unit[..., j]))
        _, once, again = np.unique(equations, axis=0, return_index=True, return_inverse=True)
        lost, rows, free = _solved(normals, j, number[once], order[once, :, j], unit[once, :, j])
        total = rows.sum(axis=1, keepdims=True)
        enough = free >= 1.0
        share = np.where(enough, total / np.maximum(free, 1.0) / np.maximum(rows, 1.0), np.inf)
        freedom = np.where(enough, rows * free / np.maximum(total, 1.0), 0.0)
        for k in range(count):
            left[every, order[:, k, j], k] = (lost * share)[again, k] / unit[:, k, j] ** 2
            many[every, order[:, k, j], k] = freedom[again, k]
    return left, many


def _solved(
    normals: Sequence[_Normal], j: int, number: Indices, current: Indices, unit: Array
) -> tuple[Array, Array, Array]:
    """Fit one joint's currents by the columns of all logs, for each of u combinations of hypotheses.

    Args:
        normals: Normal equations of each log.
        j: The joint.
        number: Hypothesis on the positions of each log, shape (u, logs).
        current: Column of the joint's currents in each log, shape (u, logs).
        unit: Factor of these, shape (u, logs).

    Returns:
        Sum of squared residuals and number of samples of each log, each of shape (u, logs), and degrees of freedom,
        shape (u, 1).
    """
    positions, which = np.unique(number, axis=0, return_inverse=True)  # currents do not change the matrix
    gram = np.sum([own.gram[j][positions[:, k]] for k, own in enumerate(normals)], axis=0)
    scale = np.sqrt(np.sum([own.size[j][positions[:, k]] for k, own in enumerate(normals)], axis=0))
    felt = scale > 0.0
    scale[~felt] = 1.0
    gram = _with_ridge(gram / (scale[:, :, None] * scale[:, None, :]), felt)
    rhs = [own.rhs[j][number[:, k], :, current[:, k]] * unit[:, k, None] for k, own in enumerate(normals)]
    x = _of_each(_solution, gram, np.sum(rhs, axis=0) / scale[which], which) / scale[which]
    left, rows, free = (np.empty(number.shape) for _ in range(3))
    for k, (own, products) in enumerate(zip(normals, rhs, strict=True)):
        explained = np.sum(x * (2.0 * products - _of_each(np.matmul, own.gram[j], x, number[:, k])), axis=1)
        left[:, k] = own.square[number[:, k], j, current[:, k]] * unit[:, k] ** 2 - explained
        rows[:, k] = own.rows[number[:, k], j]
        free[:, k] = rows[:, k] - own.felt[number[:, k], j]
    return np.maximum(left, 0.0), rows, free.sum(axis=1, keepdims=True) - felt.sum(axis=1)[which, None]


def _solution(A: Array, b: Array) -> Array:
    return np.asarray(np.linalg.solve(A, b), np.float64)


def _of_each(act: Callable[[Array, Array], Array], matrices: Array, x: Array, which: Indices) -> Array:
    """Products or solutions of vectors (u, p) with one matrix each; most vectors have the same matrix."""
    found, times = np.empty_like(x), np.bincount(which, minlength=len(matrices))
    alone = np.flatnonzero(times[which] == 1)
    found[alone] = act(matrices[which[alone]], x[alone][..., None])[..., 0]
    for k in np.flatnonzero(times > 1):
        own = which == k
        found[own] = act(matrices[k], x[own].T).T
    return found


def _state(k: int, hypothesis: Hypothesis) -> State:
    how = hypothesis.logs[k]
    read = how.q_factor.tobytes() + how.zero.tobytes() + how.q_order.tobytes() + np.float64(how.clock).tobytes()
    return k, read, hypothesis.gravity.tobytes() + hypothesis.length_factors.tobytes()


def _normals(
    own_arm: Arm,
    at: Sequence[SubsampledStates],
    hypotheses: Sequence[Hypothesis],
    columns: Sequence[Sequence[_Columns]],
) -> tuple[Indices, list[_Normal]]:
    """Return the normal equations of every log under every distinct hypothesis; those of one arm in one recursion.

    Returns:
        Index of the equations of each hypothesis, shape (K, logs), and the equations of each log.
    """
    asked = [[_state(k, each) for k in range(len(at))] for each in hypotheses]
    wanted = {state: each for each, own in zip(hypotheses, asked, strict=True) for state in own}
    arms = dict[bytes, list[State]]()
    for state in wanted:
        arms.setdefault(state[2], []).append(state)
    known = dict[bytes, tuple[Array, Array]]()
    listed, parts = [list[State]() for _ in at], [list[_Normal]() for _ in at]
    for own in arms.values():
        for start in range(0, len(own), TOGETHER):
            part = sorted(own[start : start + TOGETHER], key=lambda state: state[0])
            states = [_read(at[state[0]], wanted[state].logs[state[0]]) for state in part]
            arm = wanted[part[0]].of_arm(own_arm)
            q, dq, ddq, moving = (np.concatenate(each) for each in zip(*states, strict=True))
            tilted = (arm.gravity != own_arm.gravity).any()
            W = _by_gravity(arm, known, q, dq, ddq, moving) if tilted else _columns(arm, q, dq, ddq, moving)
            first = 0
            for k, log in enumerate(at):
                mine = [state for state in part if state[0] == k]
                last = first + len(mine) * len(log.v)
                if mine:
                    own_moving = moving[first:last].reshape(len(mine), len(log.v), -1)
                    parts[k].append(_normal(W[..., first:last], log.v, own_moving, columns[k]))
                first = last
                listed[k] += mine
    number = {state: place for own in listed for place, state in enumerate(own)}
    return np.array([[number[state] for state in each] for each in asked]), [_joined(each) for each in parts]


def _columns(arm: Arm, q: Array, dq: Array, ddq: Array, moving: Array) -> Array:
    """Each joint's row of the regressor, zero where it does not move, samples last, shape (n, p, N)."""
    ((_, columns),) = regressor_blocks(arm, q, dq, ddq, weight=moving, size=len(q))
    return columns


def _by_gravity(
    arm: Arm, known: dict[bytes, tuple[Array, Array]], q: Array, dq: Array, ddq: Array, moving: Array
) -> Array:
    """The same for many gravities, by linearity: four regressors per state are sufficient."""
    key = arm.translation.tobytes() + q.tobytes() + dq.tobytes()
    if key not in known:
        still = np.zeros_like(q)
        weightless = _columns(replace(arm, gravity=np.zeros(3)), q, dq, ddq, moving)
        steady = _columns(replace(arm, gravity=np.zeros(3)), q, still, still, moving)
        along = [_columns(replace(arm, gravity=axis), q, still, still, moving) - steady for axis in np.eye(3)]
        known.clear()
        known[key] = (weightless, np.stack(along))
    weightless, along = known[key]
    return weightless + np.tensordot(arm.gravity, along, axes=1)


def _read(at: SubsampledStates, how: LogHypothesis) -> tuple[Array, Array, Array, Array]:
    """Subsampled states of a log under a hypothesis, and a mask of the joints that move."""
    q, dq, ddq = (how.q_factor * each[:, how.q_order] for each in (at.q, at.dq, at.ddq))
    return q + how.zero, dq / how.clock, ddq / how.clock**2, at.moving[:, how.q_order].astype(np.float64)


def _normal(W: Array, v: Array, moving: Array, columns: Sequence[_Columns]) -> _Normal:
    """Equations of a log, currents (N, n), under S hypotheses: columns (n, p, S N), mask of motion (S, N, n)."""
    readings, n = len(moving), v.shape[1]
    found = _Normal([], [], [], moving.swapaxes(1, 2) @ v**2, moving.sum(axis=1), np.zeros((readings, n)))
    for j, each in enumerate(columns):
        X, own = (
            W[j, which].reshape(len(which), readings, len(v)).swapaxes(0, 1) for which in (each.shared, each.own)
        )  # (S, p, N) and (S, o, N), zero where the joint does not move
        gram, rhs = X @ X.swapaxes(1, 2), X @ v
        found.size.append(np.einsum("spp->sp", gram).copy())
        if len(each.own):
            scale = np.linalg.norm(own, axis=2)
            felt = scale > 0.0
            own = own / np.where(felt, scale, 1.0)[..., None]
            beside = np.concatenate((own @ X.swapaxes(1, 2), own @ v), axis=2)  # (S, o, p + n)
            explained = np.linalg.solve(_with_ridge(own @ own.swapaxes(1, 2), felt), beside)
            p = len(each.shared)
            gram -= beside[..., :p].swapaxes(1, 2) @ explained[..., :p]
            rhs -= beside[..., :p].swapaxes(1, 2) @ explained[..., p:]
            found.square[:, j] -= np.sum(beside[..., p:] * explained[..., p:], axis=1)
            found.felt[:, j] = felt.sum(axis=1)
        found.gram.append(gram)
        found.rhs.append(rhs)
    return found


def _with_ridge(gram: Array, felt: Mask) -> Array:
    """Gram matrices of unit columns, (..., p, p), regularised for dependent and for zero columns."""
    return gram + np.where(felt, RIDGE, 1.0)[..., None] * np.eye(gram.shape[-1])


def _joined(parts: Sequence[_Normal]) -> _Normal:
    """Concatenate equations of one log under several sets of hypotheses."""
    return _Normal(
        gram=[np.concatenate(each) for each in zip(*(part.gram for part in parts), strict=True)],
        rhs=[np.concatenate(each) for each in zip(*(part.rhs for part in parts), strict=True)],
        size=[np.concatenate(each) for each in zip(*(part.size for part in parts), strict=True)],
        square=np.concatenate([part.square for part in parts]),
        rows=np.concatenate([part.rows for part in parts]),
        felt=np.concatenate([part.felt for part in parts]),
    )


def _columns_of(logs: Logs, *, upright: bool) -> list[list[_Columns]]:
    """Columns of each log and joint: those of the arm are common; later logs have their own friction and payload."""
    of_arm, of_payload = _unknowns(logs.structure, upright=upright)
    motions, found = logs.problem.motions, list[list[_Columns]]()
    for motion in motions:
        own = [np.zeros(0, dtype=np.intp) for _ in of_arm]
        if motion is not motions[0]:
            own = [len(STANDARD) * j + DRIFTING for j in range(len(of_arm))]
        if motion.payload is not motions[0].payload:
            own = [np.concatenate(each) for each in zip(own, of_payload, strict=True)]
        found.append([_Columns(*each) for each in zip(of_arm, own, strict=True)])
    return found


@lru_cache(maxsize=8)
def _unknowns(structure: Structure, *, upright: bool) -> tuple[tuple[Indices, ...], tuple[Indices, ...]]:
    """Base columns of each joint alone, and independent ones of the payload, for the model's or for any gravity.

    Parameters that are unidentifiable with a general gravity are so with any.
    """
    if not upright and structure.arm.gravity.any():
        structure = structure_of(replace(structure.arm, gravity=ASLANT))
    ten = np.arange(len(structure.payload_columns))
    payload = (structure.payload_columns[independent_columns(each, [ten])] for each in structure.payload_probes)
    return tuple(structure.base.columns[chosen] for chosen in structure.joint_independent), tuple(payload)
