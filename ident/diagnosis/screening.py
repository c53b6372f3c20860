"""Fast selection of hypotheses for the exact comparison: on subsampled states, by normal equations, wrist first.

Currents are filtered, but the regressor is evaluated at single samples: it lacks the effect of the filter on products
and on friction steps (the latter are masked with the reversals), which may imitate a small fault. Selected hypotheses
are therefore compared on the estimator's rows (`ident.diagnosis.evidence`) before they are reported.

The equations of the last joints have few columns. A hypothesis that these contradict by far is looked at no further.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple, TypeAlias

import numpy as np

from ident.diagnosis.hypothesis import Alternative, Hypothesis, Logs
from ident.estimation.sweep import own_rotors
from ident.model.arm import Arm, with_transmission
from ident.model.parameters import STANDARD
from ident.model.regressor import regressor_blocks
from ident.model.structure import Structure, independent_columns, structure_of
from ident.numerics.signals import delayed, edge_samples, low_passed_at
from ident.observation.full_rate import filtered_motion
from ident.observation.observation import ObserveOptions
from ident.recordings.recording import Recording, resampled
from ident.support.arrays import Array, Indices, Mask

MOST_STATES = 90
"""Number of subsampled states of each log."""
SLOW = 0.2
"""Speed below which a joint's sample is not used, as a share of its rms speed."""
RIDGE = 1e-10
"""Prior precision as in the comparison, for fewer rows."""
ASLANT = np.array([3.6, -4.8, 8.0])
"""Gravity [m/s^2] in a general direction: what is unidentifiable with it is so with any gravity."""
TOGETHER = 24
"""Number of hypotheses on a log whose regressors are computed in one recursion; more exceed the processor's cache."""
NOTHING = 1e-3
"""Residual share of a current below which nothing is left to explain: filters cause as much with exact data."""
SURELY_WORSE = 30.0
"""Loss of log-likelihood by which a large alternative is excluded: twice that of z = 4."""
MARGIN = 100.0
"""Further loss on the last joints beyond which the other joints are not compared."""
DRIFTING = np.array([STANDARD.index(name) for name in ("Fv", "Fc", "off")])


@dataclass(frozen=True, slots=True, eq=False)
class SubsampledStates:
    """States of one motion at N samples: less accurate than decimation, and a hundred times as fast."""

    motion: Array  # positions, velocities and accelerations [rad, s], shape (3, N, n)
    v: Array  # currents, low-passed [drive units], shape (N, n)
    moving: Mask  # mask of joints away from a reversal, shape (N, n)


def subsampled_states(recording: Recording, most: int, options: ObserveOptions) -> SubsampledStates:
    """Return states at most `most` samples, distributed evenly, not closer than `options.rows_per_second`."""
    recording = resampled(recording)
    edge = edge_samples(recording.period, min(options.cutoff_hz, options.decimation_cutoff_hz))
    inner = slice(edge, len(recording.t) - edge)
    samples = inner.stop - inner.start
    step = max(1, -(-samples // most), round(1.0 / (recording.period * options.rows_per_second)))
    chosen = slice(inner.start, inner.stop, step)
    q, dq, ddq = filtered_motion(recording, options.cutoff_hz)
    v = delayed(recording.v, options.current_delay / recording.period)
    v = low_passed_at(v, recording.period, options.decimation_cutoff_hz, chosen)
    slow = SLOW * np.sqrt(np.mean(dq[inner] ** 2, axis=0))
    return SubsampledStates(np.stack((q[chosen], dq[chosen], ddq[chosen])), v, np.abs(dq[chosen]) > slow)


def looked_at(logs: Logs) -> list[SubsampledStates]:
    """Subsampled states of each log."""
    return [subsampled_states(each, MOST_STATES, logs.observing) for each in logs.recordings]


@dataclass(frozen=True, slots=True, eq=False)
class Screened:
    """Improvement by an alternative on subsampled states over the logs as they are."""

    alternative: Alternative  # the alternative
    gain: float  # improvement of the log-likelihood of white residuals; of the last joints alone if these exclude it

    @property
    def excluded(self) -> bool:
        """Whether it is so much worse that no other change can compensate."""
        return self.gain < -SURELY_WORSE


def screened(logs: Logs, alternatives: Sequence[Alternative]) -> list[Screened]:
    """Return the improvements by alternatives on subsampled states, the best first."""
    if not alternatives:
        return []
    at, hypotheses = looked_at(logs), [logs.given, *(each.hypothesis for each in alternatives)]
    *_, (left, freedom) = unexplained(logs, hypotheses, at, least=-SURELY_WORSE - MARGIN)
    found = map(Screened, alternatives, improvements(left, freedom, at)[1:].tolist())
    return sorted(found, key=lambda each: -each.gain)


def improvements(left: Array, freedom: Array, at: Sequence[SubsampledStates]) -> Array:
    """Improvement of the log-likelihood over the first hypothesis by residuals (K, n, logs), shape (K,)."""
    noise = NOTHING**2 * np.column_stack([np.mean(each.v**2, axis=0) for each in at])  # (n, logs)
    known = np.isfinite(left[0]) & np.isfinite(left)
    ratio = np.maximum(left[0], noise) / np.maximum(np.where(known, left, 1.0), noise)
    return np.sum(0.5 * np.minimum(freedom[0], freedom) * np.log(np.where(known, ratio, 1.0)), axis=(1, 2))


def unexplained(
    logs: Logs, hypotheses: Sequence[Hypothesis], at: Sequence[SubsampledStates], least: float = -np.inf
) -> Iterator[tuple[Array, Array]]:
    """Yield the residuals of the currents under K hypotheses, with the equations of ever more joints.

    They are mean squares of each column of currents in each log, in its own unit, infinite if not (yet) known, and
    degrees of freedom, both of shape (K, n, logs), changed by the next step. A hypothesis that improves on the first
    one by less than `least` is looked at no further.
    """
    arm, K = logs.structure.arm, len(hypotheses)
    left, freedom = np.full((K, arm.n, len(at)), np.inf), np.zeros((K, arm.n, len(at)))
    alive, columns_of = np.ones(K, np.bool_), dict[bytes, tuple[Arm, list[list[_Columns]]]]()
    alike = np.array([_of_model(logs, each, columns_of) for each in hypotheses])
    order = np.array([[how.v_order for how in each.logs] for each in hypotheses])  # (K, logs, n)
    unit = np.array([[how.v_factor for how in each.logs] for each in hypotheses])
    for joints in filter(len, (range(arm.n // 2, arm.n), range(arm.n // 2))):  # a stage repeats the links' motions
        for which, (turned, columns) in enumerate(columns_of.values()):
            if not len(own := np.flatnonzero(alive & (alike == which))):
                continue
            number, normals = _normals(turned, at, [hypotheses[k] for k in own.tolist()], columns, joints)
            for j, of_logs in zip(joints, normals, strict=True):
                equations = np.column_stack((number, order[own, :, j], unit[own, :, j]))
                _, once, again = np.unique(equations, axis=0, return_index=True, return_inverse=True)
                chosen = own[once]
                lost, rows, free = _solved(of_logs, number[once], order[chosen, :, j], unit[chosen, :, j])
                total, enough = rows.sum(axis=1, keepdims=True), free >= 1.0
                share = np.where(enough, total / np.maximum(free, 1.0) / np.maximum(rows, 1.0), np.inf)
                many = np.where(enough, rows * free / np.maximum(total, 1.0), 0.0)
                for k in range(len(at)):
                    column = own, order[own, k, j], k
                    left[column] = (lost * share)[again, k] / unit[own, k, j] ** 2
                    freedom[column] = many[again, k]
        yield left, freedom
        alive &= improvements(left, freedom, at) >= least


class _Normal(NamedTuple):
    """Normal equations of a joint in a log under S hypotheses on positions, without the log's own columns."""

    gram: Array  # Gram matrices of the p shared columns, shape (S, p, p)
    rhs: Array  # shared columns times all currents, shape (S, p, n)
    size: Array  # sums of squares of the shared columns before the elimination, shape (S, p)
    square: Array  # sum of squares of each current on the joint's samples after the elimination, shape (S, n)
    rows: Array  # number of samples, shape (S,)
    felt: Array  # number of own columns that are not zero, shape (S,)


_Columns: TypeAlias = tuple[Indices, Indices]
"""Indices of the columns of a joint in a log: those common to all logs, shape (p,), and its own, shape (o,)."""


def _normals(
    arm: Arm,
    at: Sequence[SubsampledStates],
    hypotheses: Sequence[Hypothesis],
    columns: Sequence[Sequence[_Columns]],
    joints: range,
) -> tuple[Indices, list[list[_Normal]]]:
    """Return the index of each hypothesis' equations, (K, logs), and the distinct equations of each joint and log."""
    number, found = np.empty((len(hypotheses), len(at)), np.intp), [list[_Normal]() for _ in joints]
    for k, log in enumerate(at):
        distinct, N = dict[tuple[bytes, ...], tuple[int, Hypothesis]](), len(log.v)
        for which, each in enumerate(hypotheses):
            key = each.gravity.tobytes(), each.length_factors.tobytes(), each.logs[k].of_positions
            number[which, k], _ = distinct.setdefault(key, (len(distinct), each))
        states = [each for _, each in distinct.values()]
        own = [each.logs[k] for each in states]
        moving = np.array([log.moving[:, how.q_order] for how in own], np.float64)  # (S, N, n)
        motion = np.concatenate([how.mixed(log.motion) for how in own], axis=1)  # (3, S N, n)
        clock = np.repeat([how.clock for how in own], N)[:, None]
        blocks = regressor_blocks(
            arm,
            motion[0] + np.repeat([how.zero for how in own], N, axis=0),
            motion[1] / clock,
            motion[2] / clock**2,
            weight=moving.reshape(-1, arm.n),
            size=TOGETHER * N,
            first=joints[0],
            gravity=np.repeat([each.gravity for each in states], N, axis=0),
            length=np.repeat([each.length_factors for each in states], N, axis=0),
        )
        equations = [list[_Normal]() for _ in joints]
        for block, W in blocks:
            some = slice(block.start // N, block.stop // N)
            for j, each in zip(joints, equations, strict=True):
                X, Y = (W[j - joints[0], c].reshape(len(c), len(moving[some]), N).swapaxes(0, 1) for c in columns[k][j])
                each.append(_normal(X, Y, log.v, moving[some, :, j]))
        for each, all_of_log in zip(equations, found, strict=True):
            all_of_log.append(_Normal(*map(np.concatenate, zip(*each, strict=True))))
    return number, found


def _normal(X: Array, own: Array, v: Array, moving: Array) -> _Normal:
    """Equations of shared columns (S, p, N) and own ones (S, o, N), currents (N, n) and a mask of motion (S, N)."""
    gram, rhs, square, p = X @ X.swapaxes(1, 2), X @ v, moving @ v**2, X.shape[1]
    size, felt = np.einsum("spp->sp", gram).copy(), np.zeros(len(X))
    if own.shape[1]:
        scale = np.linalg.norm(own, axis=2)
        own = own / np.where(scale > 0.0, scale, 1.0)[..., None]
        beside = np.concatenate((own @ X.swapaxes(1, 2), own @ v), axis=2)  # (S, o, p + n)
        explained = np.linalg.solve(_with_ridge(own @ own.swapaxes(1, 2), scale > 0.0), beside)
        gram -= beside[..., :p].swapaxes(1, 2) @ explained[..., :p]
        rhs -= beside[..., :p].swapaxes(1, 2) @ explained[..., p:]
        square -= np.sum(beside[..., p:] * explained[..., p:], axis=1)
        felt = np.count_nonzero(scale, axis=1).astype(np.float64)
    return _Normal(gram, rhs, size, square, moving.sum(axis=1), felt)


def _solved(normals: Sequence[_Normal], number: Indices, current: Indices, unit: Array) -> tuple[Array, Array, Array]:
    """Fit one joint's currents by the columns of all logs, for u combinations of equations, currents and their factors.

    These have shape (u, logs); so have the sums of squared residuals and samples; degrees of freedom have (u, 1).
    """
    positions, which = np.unique(number, axis=0, return_inverse=True)  # currents do not change the matrix
    gram = np.sum([own.gram[positions[:, k]] for k, own in enumerate(normals)], axis=0)
    scale = np.sqrt(np.sum([own.size[positions[:, k]] for k, own in enumerate(normals)], axis=0))
    felt = scale > 0.0
    scale[~felt] = 1.0
    gram = _with_ridge(gram / (scale[:, :, None] * scale[:, None, :]), felt)
    rhs = [own.rhs[number[:, k], :, current[:, k]] * unit[:, k, None] for k, own in enumerate(normals)]
    x = _of_each(_solution, gram, np.sum(rhs, axis=0) / scale[which], which) / scale[which]
    left, rows, free = (np.empty(number.shape) for _ in range(3))
    for k, (own, products) in enumerate(zip(normals, rhs, strict=True)):
        explained = np.sum(x * (2.0 * products - _of_each(np.matmul, own.gram, x, number[:, k])), axis=1)
        left[:, k] = own.square[number[:, k], current[:, k]] * unit[:, k] ** 2 - explained
        rows[:, k] = own.rows[number[:, k]]
        free[:, k] = rows[:, k] - own.felt[number[:, k]]
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


def _with_ridge(gram: Array, felt: Mask) -> Array:
    """Gram matrices of unit columns, (..., p, p), regularised for dependent and for zero columns."""
    return gram + np.where(felt, RIDGE, 1.0)[..., None] * np.eye(gram.shape[-1])


def _of_model(logs: Logs, hypothesis: Hypothesis, known: dict[bytes, tuple[Arm, list[list[_Columns]]]]) -> int:
    """Number of the arm and the columns of a hypothesis among the known ones, to which new ones are added."""
    arm, A = logs.structure.arm, hypothesis.transmission
    upright = bool((hypothesis.gravity == arm.gravity).all())
    key = bytes([upright]) if A is None else A.tobytes()
    if key not in known:
        of_arm, of_payload = _unknowns(logs.structure, upright=upright)
        if A is not None:  # a motor moves the links of several joints: more columns than are independent
            arm, base = with_transmission(arm, A), np.union1d(logs.structure.base.columns, own_rotors(logs.structure))
            of_arm, of_payload = (base,) * arm.n, (logs.structure.payload_columns,) * arm.n
        (first, *_), columns = logs.problem.motions, list[list[_Columns]]()
        for motion in logs.problem.motions:  # columns of the arm are common; later logs have friction and payload
            own = [len(STANDARD) * j + (DRIFTING if motion is not first else DRIFTING[:0]) for j in range(arm.n)]
            if motion.payload is not first.payload:
                own = [np.concatenate(each) for each in zip(own, of_payload, strict=True)]
            columns.append(list(zip(of_arm, own, strict=True)))
        known[key] = arm, columns
    return [*known].index(key)


@lru_cache(maxsize=8)
def _unknowns(structure: Structure, *, upright: bool) -> tuple[tuple[Indices, ...], tuple[Indices, ...]]:
    """Base columns of each joint alone, and independent ones of the payload, for the model's or for any gravity."""
    if not upright and structure.arm.gravity.any():
        structure = structure_of(replace(structure.arm, gravity=ASLANT))
    ten = np.arange(len(structure.payload_columns))
    payload = (structure.payload_columns[independent_columns(each, [ten])] for each in structure.payload_probes)
    return tuple(structure.base.columns[chosen] for chosen in structure.joint_independent), tuple(payload)
