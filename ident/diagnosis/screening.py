"""Which of many readings are worth a full comparison: all of them on few instants, through normal equations.

Currents are filtered, the regressor is taken at single instants: it lacks what the filter does to products and to
friction steps, so that a small fault may be imitated. What is found here is compared on the estimator's rows
(`ident.diagnosis.comparison`) before anything is said of it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ident.diagnosis.alternative import Alternative
from ident.diagnosis.logs import Hypothesis, LogHypothesis, Logs
from ident.diagnosis.subsampled_states import SubsampledStates, subsampled_states
from ident.model.arm import Arm
from ident.model.base import independent_columns
from ident.model.parameters import STANDARD
from ident.model.regressor import regressor_blocks
from ident.model.structure import Structure, structure_of
from ident.support.arrays import Array, Indices, Mask

MOST_STATES = 90
"""Instants of each log."""
RIDGE = 1e-10
"""As in the comparison, of instants that are fewer."""
ASLANT = np.array([3.6, -4.8, 8.0])
"""Gravity [m/s^2] along no axis: what no torque shows under it, none shows under any."""
TOGETHER = 16
"""Readings of a log whose regressors are found in one recursion; more leave the processor's cache."""
NOTHING = 1e-3
"""Share of a current below which nothing is left to explain: filters leave as much of exact data."""
DRIFTING = np.array([STANDARD.index(name) for name in ("Fv", "Fc", "off")])


@dataclass(frozen=True, slots=True, eq=False)
class Screened:
    """What an alternative leaves of each column of currents on the instants, beside the logs as they are.

    Attributes:
        alternative: Which.
        gain: Log likelihood of white residuals that it gains, of each column of currents, shape (n,).
    """

    alternative: Alternative
    gain: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Normal:
    """Normal equations of one log under S readings of its positions, once the columns of that log alone are eliminated.

    Attributes:
        gram: Of the columns that all logs share, n arrays (S, p, p).
        rhs: These columns times all currents, n arrays (S, p, n).
        size: Sums of squares of the shared columns, the log's own not eliminated, n arrays (S, p).
        square: Sum of squares of each current that the log's own columns leave on each joint's instants, joint first,
            shape (S, n, n).
        rows: Instants of each joint, shape (S, n).
        felt: Own columns of each joint that are not zero, shape (S, n).
    """

    gram: list[Array]
    rhs: list[Array]
    size: list[Array]
    square: Array
    rows: Array
    felt: Array


@dataclass(frozen=True, slots=True)
class _Columns:
    """Columns of one joint in one log, out of the standard regressor.

    Attributes:
        shared: Those that all logs have in common, shape (p,).
        own: Those of the log alone, shape (o,).
    """

    shared: Indices
    own: Indices


State = tuple[int, bytes, bytes]
"""A log, and what tells readings of its positions and of the arm apart."""


def screened(logs: Logs, alternatives: Sequence[Alternative]) -> list[Screened]:
    """What alternatives gain on few instants, the best first."""
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
    """The instants of each log."""
    return [subsampled_states(each, MOST_STATES, logs.observing) for each in logs.recordings]


def unexplained(logs: Logs, hypotheses: Sequence[Hypothesis], at: Sequence[SubsampledStates]) -> tuple[Array, Array]:
    """What readings leave of the currents.

    Args:
        logs: The logs.
        hypotheses: Of them.
        at: Their instants.

    Returns:
        Mean squares of each column of currents in each log, in its own unit, infinite where instants are too few, and
        degrees of freedom, each of shape (readings, n, logs).
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
    """Mean square that readings leave of each column of each log in its own unit, and instants, (K, n, logs) each."""
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
    """Fit one joint's currents to the columns of all logs, by each of u combinations of readings.

    Args:
        normals: Of each log.
        j: The joint.
        number: Reading of the positions of each log, shape (u, logs).
        current: Column of the joint's currents in each log, shape (u, logs).
        unit: What these are multiplied by, shape (u, logs).

    Returns:
        Squares left in each log and its instants, each of shape (u, logs), and degrees of freedom, shape (u, 1).
    """
    positions, which = np.unique(number, axis=0, return_inverse=True)  # other currents leave the matrix as it is
    gram = np.sum([own.gram[j][positions[:, k]] for k, own in enumerate(normals)], axis=0)
    scale = np.sqrt(np.sum([own.size[j][positions[:, k]] for k, own in enumerate(normals)], axis=0))
    felt = scale > 0.0
    scale[~felt] = 1.0
    gram = _with_ridge(gram / (scale[:, :, None] * scale[:, None, :]), felt)
    rhs = [own.rhs[j][number[:, k], :, current[:, k]] * unit[:, k, None] for k, own in enumerate(normals)]
    x = (
        _of_each(
            lambda A, b: np.asarray(np.linalg.solve(A, b), np.float64), gram, np.sum(rhs, axis=0) / scale[which], which
        )
        / scale[which]
    )
    left, rows, free = (np.empty(number.shape) for _ in range(3))
    for k, (own, products) in enumerate(zip(normals, rhs, strict=True)):
        explained = np.sum(x * (2.0 * products - _of_each(np.matmul, own.gram[j], x, number[:, k])), axis=1)
        left[:, k] = own.square[number[:, k], j, current[:, k]] * unit[:, k] ** 2 - explained
        rows[:, k] = own.rows[number[:, k], j]
        free[:, k] = rows[:, k] - own.felt[number[:, k], j]
    return np.maximum(left, 0.0), rows, free.sum(axis=1, keepdims=True) - felt.sum(axis=1)[which, None]


def _of_each(act: Callable[[Array, Array], Array], matrices: Array, x: Array, which: Indices) -> Array:
    """A matrix each, and a product or a solution with it, of many vectors (u, p) that mostly share one of them."""
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
    """Normal equations of every log under every reading of it, each once; those of one arm in one recursion.

    Returns:
        Which of its equations are those of each reading, shape (K, logs), and the equations of each log.
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
    """Each joint's row of the regressor, zero where it does not move, instants last, shape (n, p, N)."""
    ((_, columns),) = regressor_blocks(arm, q, dq, ddq, weight=moving, size=len(q))
    return columns


def _by_gravity(
    arm: Arm, known: dict[bytes, tuple[Array, Array]], q: Array, dq: Array, ddq: Array, moving: Array
) -> Array:
    """The same, in which gravity is linear: of the same states under many gravities four are found."""
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
    """States of the arm at the instants of a log that is read so, and which joints move."""
    q, dq, ddq = (how.q_factor * each[:, how.q_order] for each in (at.q, at.dq, at.ddq))
    return q + how.zero, dq / how.clock, ddq / how.clock**2, at.moving[:, how.q_order].astype(np.float64)


def _normal(W: Array, v: Array, moving: Array, columns: Sequence[_Columns]) -> _Normal:
    """Equations of a log, (N, n) currents, under S readings: columns (n, p, S N), instants that move (S, N, n)."""
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
    """Equations of unit columns, (..., p, p), that have a solution whatever columns are dependent or not felt."""
    return gram + np.where(felt, RIDGE, 1.0)[..., None] * np.eye(gram.shape[-1])


def _joined(parts: Sequence[_Normal]) -> _Normal:
    """Equations of one log under more readings."""
    return _Normal(
        gram=[np.concatenate(each) for each in zip(*(part.gram for part in parts), strict=True)],
        rhs=[np.concatenate(each) for each in zip(*(part.rhs for part in parts), strict=True)],
        size=[np.concatenate(each) for each in zip(*(part.size for part in parts), strict=True)],
        square=np.concatenate([part.square for part in parts]),
        rows=np.concatenate([part.rows for part in parts]),
        felt=np.concatenate([part.felt for part in parts]),
    )


def _columns_of(logs: Logs, *, upright: bool) -> list[list[_Columns]]:
    """Columns of each log and joint: the arm's own are common, friction and payload are a later log's own."""
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
    """Base columns of each joint alone, and those of the payload that it can tell apart, under any gravity if not its.

    What no torque shows under gravity along no axis, none shows under any.
    """
    if not upright and structure.arm.gravity.any():
        structure = structure_of(replace(structure.arm, gravity=ASLANT))
    ten = np.arange(len(structure.payload_columns))
    payload = (structure.payload_columns[independent_columns(each, [ten])] for each in structure.payload_probes)
    return tuple(structure.base.columns[chosen] for chosen in structure.joint_independent), tuple(payload)
