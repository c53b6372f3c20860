"""Fast selection of hypotheses for the exact comparison: all of them on subsampled states, by normal equations.

Currents are filtered, but the regressor is evaluated at single samples: it lacks the effect of the filter on products
and on friction steps, which may imitate a small fault. Selected hypotheses are therefore compared on the estimator's
rows (`ident.diagnosis.comparison`) before they are reported.
"""

from collections.abc import Sequence
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
from ident.support.arrays import Array, Indices

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
    """Normal equations of one log under S hypotheses on its positions.

    Attributes:
        gram: Gram matrices of the log's columns, n arrays (S, p_k, p_k).
        rhs: Columns times all currents, n arrays (S, p_k, n).
        square: Sum of squares of each current on each joint's samples, joint first, shape (S, n, n).
        rows: Number of samples of each joint, shape (S, n).
    """

    gram: list[Array]
    rhs: list[Array]
    square: Array
    rows: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Columns:
    """Indices of the columns of one log among those of all logs, for one joint.

    Attributes:
        chosen: Columns of the standard regressor, shape (p_k,).
        runs: Contiguous groups of them, and their places among the columns of all logs.
        count: Number of columns of all logs.
    """

    chosen: Indices
    runs: tuple[tuple[slice, slice], ...]
    count: int


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
    columns = _placed(logs, upright=upright)
    number, normals = _normals(logs.structure.arm, at, hypotheses, columns)
    order = np.array([[how.v_order for how in each.logs] for each in hypotheses])  # (K, logs, n)
    unit = np.array([[how.v_factor for how in each.logs] for each in hypotheses])
    left, many = np.full((len(hypotheses), n, count), np.inf), np.zeros((len(hypotheses), n, count))
    every = np.arange(len(hypotheses))
    for j in range(n):
        equations = np.column_stack((number, order[..., j], unit[..., j]))
        _, once, again = np.unique(equations, axis=0, return_index=True, return_inverse=True)
        own = [each[j] for each in columns]
        lost, rows, free = _solved(normals, own, j, number[once], order[once, :, j], unit[once, :, j])
        total = rows.sum(axis=1, keepdims=True)
        enough = free >= 1.0
        share = np.where(enough, total / np.maximum(free, 1.0) / np.maximum(rows, 1.0), np.inf)
        freedom = np.where(enough, rows * free / np.maximum(total, 1.0), 0.0)
        for k in range(count):
            left[every, order[:, k, j], k] = (lost * share)[again, k] / unit[:, k, j] ** 2
            many[every, order[:, k, j], k] = freedom[again, k]
    return left, many


def _solved(
    normals: Sequence[_Normal], columns: Sequence[_Columns], j: int, number: Indices, current: Indices, unit: Array
) -> tuple[Array, Array, Array]:
    """Fit one joint's currents by the columns of all logs, for each of u combinations of hypotheses.

    Args:
        normals: Normal equations of each log.
        columns: Columns of each log.
        j: The joint.
        number: Hypothesis on the positions of each log, shape (u, logs).
        current: Column of the joint's currents in each log, shape (u, logs).
        unit: Factor of these, shape (u, logs).

    Returns:
        Sum of squared residuals and number of samples of each log, each of shape (u, logs), and degrees of freedom,
        shape (u, 1).
    """
    size = columns[0].count
    gram, b, parts = np.zeros((len(number), size, size)), np.zeros((len(number), size)), list[tuple[Array, Array]]()
    for k, (own, each) in enumerate(zip(normals, columns, strict=True)):
        mine = own.gram[j][number[:, k]]
        rhs = own.rhs[j][number[:, k], :, current[:, k]] * unit[:, k, None]
        for here, rows in each.runs:
            for there, across in each.runs:
                gram[:, rows, across] += mine[:, here, there]
            b[:, rows] += rhs[:, here]
        parts.append((mine, rhs))
    scale = np.sqrt(np.einsum("kpp->kp", gram))
    felt = scale > 0.0
    scale[~felt] = 1.0
    gram /= scale[:, :, None]
    gram /= scale[:, None, :]
    gram[:, np.arange(size), np.arange(size)] += np.where(felt, RIDGE, 1.0)
    x = np.linalg.solve(gram, (b / scale)[..., None])[..., 0] / scale
    square = np.column_stack([own.square[number[:, k], j, current[:, k]] for k, own in enumerate(normals)]) * unit**2
    fitted = list[Array]()
    for each, (mine, rhs) in zip(columns, parts, strict=True):
        y = np.hstack([x[:, rows] for _, rows in each.runs])
        fitted.append(np.sum(y * ((mine @ y[..., None])[..., 0] - 2.0 * rhs), axis=1))
    rows = np.column_stack([own.rows[number[:, k], j] for k, own in enumerate(normals)])
    free = rows.sum(axis=1, keepdims=True) - felt.sum(axis=1, keepdims=True)
    return np.maximum(square + np.column_stack(fitted), 0.0), rows, free


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
    gram, rhs = list[Array](), list[Array]()
    for j, each in enumerate(columns):
        X = W[j, each.chosen].reshape(len(each.chosen), *moving.shape[:2]).swapaxes(0, 1)  # (S, p_k, N)
        gram.append(X @ X.swapaxes(1, 2))
        rhs.append(X @ v)  # X is zero where the joint does not move
    return _Normal(gram, rhs, moving.swapaxes(1, 2) @ v**2, moving.sum(axis=1))


def _joined(parts: Sequence[_Normal]) -> _Normal:
    """Concatenate equations of one log under several sets of hypotheses."""
    return _Normal(
        gram=[np.concatenate(each) for each in zip(*(part.gram for part in parts), strict=True)],
        rhs=[np.concatenate(each) for each in zip(*(part.rhs for part in parts), strict=True)],
        square=np.concatenate([part.square for part in parts]),
        rows=np.concatenate([part.rows for part in parts]),
    )


def _placed(logs: Logs, *, upright: bool) -> list[list[_Columns]]:
    """Columns of each log and joint: those of the arm are common; later logs have their own friction and payload."""
    of_arm, of_payload = _unknowns(logs.structure, upright=upright)
    motions = logs.problem.motions
    found = list[list[_Columns]]()
    ends = [len(each) for each in of_arm]
    for k, motion in enumerate(motions):
        own = list[_Columns]()
        for j, arm in enumerate(of_arm):
            more = [np.zeros(0, dtype=np.intp)]
            if k > 0:
                more.append(len(STANDARD) * j + DRIFTING)
                if motion.payload is not motions[0].payload:
                    more.append(of_payload[j])
            again = np.concatenate(more)
            first, last = slice(0, len(arm)), slice(len(arm), len(arm) + len(again))
            runs = ((first, first), (last, slice(ends[j], ends[j] + len(again))))
            own.append(_Columns(np.concatenate((arm, again)), runs, 0))
            ends[j] += len(again)
        found.append(own)
    return [[replace(each, count=ends[j]) for j, each in enumerate(own)] for own in found]


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
