"""Which of many readings are worth a full comparison: all of them on few instants, through normal equations.

Currents are filtered, the regressor is taken at single instants: it lacks what the filter does to products and to
friction steps, so that a small fault may be imitated. What is found here is compared on the estimator's rows
(`ident.diagnosis.comparison`) before anything is said of it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ident.arm import Arm
from ident.arrays import Array, Indices
from ident.base import independent_columns
from ident.diagnosis.alternative import Alternative
from ident.diagnosis.instants import Instants, instants
from ident.diagnosis.logs import Logs
from ident.diagnosis.reading import LogReading, Reading, as_logged
from ident.parameters import STANDARD
from ident.regressor import regressor
from ident.structure import Structure, structure_of

INSTANTS = 90
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
    """Normal equations of one log under one reading of its positions.

    Attributes:
        gram: Of the columns that the log has, n arrays (p_k, p_k).
        rhs: Columns times all currents, n arrays (p_k, n).
        square: Sum of squares of each current on each joint's instants, joint first, shape (n, n).
        rows: Instants of each joint, shape (n,).
    """

    gram: list[Array]
    rhs: list[Array]
    square: Array
    rows: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Columns:
    """Where the columns of one log stand among those of all logs, for one joint.

    Attributes:
        chosen: Of the standard regressor, shape (p_k,).
        place: Among the columns of all logs, shape (p_k,).
        count: Columns of all logs.
    """

    chosen: Indices
    place: Indices
    count: int


State = tuple[int, bytes, bytes]
"""A log, and what tells readings of its positions and of the arm apart."""


def screened(logs: Logs, alternatives: Sequence[Alternative]) -> list[Screened]:
    """What alternatives gain on few instants, the best first."""
    given = as_logged(logs.structure.arm, len(logs.recordings))
    left, freedom = unexplained(logs, [given, *(each.reading for each in alternatives)])
    rms = [np.mean(each.v**2, axis=0) for each in looked_at(logs)]
    noise = NOTHING**2 * np.column_stack(rms)  # (n, logs)
    known = np.isfinite(left[0]) & np.isfinite(left[1:])
    ratio = np.maximum(left[0], noise) / np.maximum(np.where(known, left[1:], 1.0), noise)
    gain = 0.5 * np.minimum(freedom[0], freedom[1:]) * np.log(np.where(known, ratio, 1.0))
    found = [Screened(each, own.sum(axis=1)) for each, own in zip(alternatives, gain, strict=True)]
    return sorted(found, key=lambda each: -float(each.gain.sum()))


def looked_at(logs: Logs) -> list[Instants]:
    """The instants of each log."""
    return [instants(each, INSTANTS, logs.observing) for each in logs.recordings]


def unexplained(logs: Logs, readings: Sequence[Reading]) -> tuple[Array, Array]:
    """What readings leave of the currents.

    Returns:
        Mean squares of each column of currents in each log, in its own unit, infinite where instants are too few, and
        degrees of freedom, each of shape (readings, n, logs).
    """
    at = looked_at(logs)
    left, freedom = np.empty((2, len(readings), logs.structure.arm.n, len(at)))
    upright = np.array([bool((each.gravity == logs.structure.arm.gravity).all()) for each in readings])
    for which in (True, False):
        own = np.flatnonzero(upright == which)
        if len(own):
            left[own], freedom[own] = _left(logs, at, [readings[int(k)] for k in own], upright=which)
    return left, freedom


def _left(logs: Logs, at: Sequence[Instants], readings: Sequence[Reading], *, upright: bool) -> tuple[Array, Array]:
    """Mean square that readings leave of each column of each log in its own unit, and instants, (K, n, logs) each."""
    n, count = logs.structure.arm.n, len(at)
    columns = _placed(logs, upright=upright)
    normals = _normals(logs.structure.arm, at, readings, columns)
    states = [[_state(k, each) for k in range(count)] for each in readings]
    order = np.array([[how.v_order for how in each.logs] for each in readings])  # (K, logs, n)
    unit = np.array([[how.v_factor for how in each.logs] for each in readings])
    left, many = np.full((len(readings), n, count), np.inf), np.zeros((len(readings), n, count))
    every = np.arange(len(readings))
    for j in range(n):
        size = columns[0][j].count
        gram, b = np.zeros((len(readings), size, size)), np.zeros((len(readings), size))
        rhs, square, rows = list[Array](), list[Array](), list[Array]()
        for k in range(count):
            own = [normals[each[k]] for each in states]
            place, current = columns[k][j].place, order[:, k, j]
            grams = np.array([each.gram[j] for each in own])
            gram[:, place[:, None], place] += grams
            rhs.append(np.array([each.rhs[j] for each in own])[every, :, current] * unit[:, k, j, None])
            b[:, place] += rhs[-1]
            square.append(np.array([each.square[j] for each in own])[every, current] * unit[:, k, j] ** 2)
            rows.append(np.array([each.rows[j] for each in own]))
        scale = np.sqrt(np.einsum("kpp->kp", gram))
        felt = scale > 0.0
        scale[~felt] = 1.0
        gram /= scale[:, :, None] * scale[:, None, :]
        gram[:, np.arange(size), np.arange(size)] += np.where(felt, RIDGE, 1.0)
        x = np.linalg.solve(gram, (b / scale)[..., None])[..., 0] / scale
        total = np.sum(rows, axis=0)
        free = total - felt.sum(axis=1)
        for k in range(count):
            place, mine = columns[k][j].place, [normals[each[k]] for each in states]
            own = x[:, place]
            fitted = np.einsum("kp,kpq,kq->k", own, np.array([each.gram[j] for each in mine]), own)
            lost = np.maximum(square[k] - 2.0 * np.einsum("kp,kp->k", own, rhs[k]) + fitted, 0.0)
            enough = free >= 1.0
            share = np.where(enough, total / np.maximum(free, 1.0) / np.maximum(rows[k], 1.0), np.inf)
            left[every, order[:, k, j], k] = lost / unit[:, k, j] ** 2 * share
            many[every, order[:, k, j], k] = np.where(enough, rows[k] * free / np.maximum(total, 1.0), 0.0)
    return left, many


def _state(k: int, reading: Reading) -> State:
    how = reading.logs[k]
    read = how.q_factor.tobytes() + how.zero.tobytes() + how.q_order.tobytes() + np.float64(how.clock).tobytes()
    return k, read, reading.gravity.tobytes() + reading.stretch.tobytes()


def _normals(
    own_arm: Arm, at: Sequence[Instants], readings: Sequence[Reading], columns: Sequence[Sequence[_Columns]]
) -> dict[State, _Normal]:
    """Normal equations of every log under every reading of it, each once; those of one arm in one recursion."""
    wanted = {_state(k, each): each for each in readings for k in range(len(at))}
    found, known = dict[State, _Normal](), dict[bytes, tuple[Array, Array]]()
    arms = dict[bytes, list[State]]()
    for state in wanted:
        arms.setdefault(state[2], []).append(state)
    for own in arms.values():
        for start in range(0, len(own), TOGETHER):
            part = own[start : start + TOGETHER]
            states = [_read(at[state[0]], wanted[state].logs[state[0]]) for state in part]
            arm = wanted[part[0]].of_arm(own_arm)
            at_once = [np.concatenate(each) for each in zip(*states, strict=True)]
            tilted = (arm.gravity != own_arm.gravity).any()
            W = _by_gravity(arm, known, *at_once) if tilted else regressor(arm, *at_once)
            ends = np.cumsum([0, *(len(each[0]) for each in states)])
            for state, first, last in zip(part, ends, ends[1:], strict=False):
                k, how = state[0], wanted[state].logs[state[0]]
                moving = at[k].moving[:, how.q_order].astype(np.float64)
                found[state] = _normal(W[first:last], at[k].v, moving, columns[k])
    return found


def _by_gravity(arm: Arm, known: dict[bytes, tuple[Array, Array]], q: Array, dq: Array, ddq: Array) -> Array:
    """The regressor of states, in which gravity is linear: of the same states under many gravities four are found."""
    key = arm.translation.tobytes() + q.tobytes() + dq.tobytes()
    if key not in known:
        still = np.zeros_like(q)
        weightless = regressor(replace(arm, gravity=np.zeros(3)), q, dq, ddq)
        steady = regressor(replace(arm, gravity=np.zeros(3)), q, still, still)
        along = np.stack([regressor(replace(arm, gravity=axis), q, still, still) - steady for axis in np.eye(3)])
        known.clear()
        known[key] = (weightless, along)
    weightless, along = known[key]
    return weightless + np.tensordot(arm.gravity, along, axes=1)


def _read(at: Instants, how: LogReading) -> tuple[Array, Array, Array]:
    """States of the arm at the instants of a log that is read so."""
    q, dq, ddq = (how.q_factor * each[:, how.q_order] for each in (at.q, at.dq, at.ddq))
    return q + how.zero, dq / how.clock, ddq / how.clock**2


def _normal(W: Array, v: Array, moving: Array, columns: Sequence[_Columns]) -> _Normal:
    gram, rhs, square = list[Array](), list[Array](), np.empty((len(columns), v.shape[1]))
    for j, each in enumerate(columns):
        X = W[:, j, each.chosen] * moving[:, j, None]
        seen = v * moving[:, j, None]
        gram.append(X.T @ X)
        rhs.append(X.T @ seen)
        square[j] = np.sum(seen**2, axis=0)
    return _Normal(gram, rhs, square, moving.sum(axis=0))


def _placed(logs: Logs, *, upright: bool) -> list[list[_Columns]]:
    """Columns of each log and joint: the arm's own are common, friction and payload are a later log's own."""
    unknowns = _unknowns(logs.structure, upright=upright)
    motions = logs.problem.motions
    found = list[list[_Columns]]()
    ends = [len(each) for each in unknowns.arm]
    for k, motion in enumerate(motions):
        own = list[_Columns]()
        for j, arm in enumerate(unknowns.arm):
            more = [np.zeros(0, dtype=np.intp)]
            if k > 0:
                more.append(len(STANDARD) * j + DRIFTING)
                if motion.payload is not motions[0].payload:
                    more.append(unknowns.payload[j])
            again = np.concatenate(more)
            place = np.concatenate((np.arange(len(arm)), ends[j] + np.arange(len(again))))
            own.append(_Columns(np.concatenate((arm, again)), place, 0))
            ends[j] += len(again)
        found.append(own)
    return [[replace(each, count=ends[j]) for j, each in enumerate(own)] for own in found]


@dataclass(frozen=True, slots=True, eq=False)
class _Unknowns:
    """Columns of the standard regressor that are solved for on each joint: of the arm, and of a payload."""

    arm: tuple[Indices, ...]
    payload: tuple[Indices, ...]


@lru_cache(maxsize=8)
def _unknowns(structure: Structure, *, upright: bool) -> _Unknowns:
    """Base columns of each joint alone, and those of the payload that it can tell apart, under any gravity if not its.

    What no torque shows under gravity along no axis, none shows under any.
    """
    if not upright and structure.arm.gravity.any():
        structure = structure_of(replace(structure.arm, gravity=ASLANT))
    ten = np.arange(len(structure.payload_columns))
    return _Unknowns(
        arm=tuple(structure.base.columns[chosen] for chosen in structure.joint_independent),
        payload=tuple(
            structure.payload_columns[independent_columns(probes, [ten])] for probes in structure.payload_probes
        ),
    )
