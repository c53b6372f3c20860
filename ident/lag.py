"""Whether currents and positions are of the same time: logs of two controllers merged, a current that is logged late.

A current that is logged late by a time d is `V = W x - d dV/dt`, so that d is linear in what is left of it. What stands
beside it in the fit is all that the arm may be: its own parameters, friction and offset anew in each loaded motion, any
payload. Two signals know how the current changes: its own filtered rate, which has the right size, but noise of its
own; and the rate of the fitted current from row to row, without noise, but blind beside reversals. The second is the
instrument of the first:

    d = -(Z' D)^-1 Z' r      Z, D  (r, motions) what the fit leaves of the fitted and of the logged rate, r of V.

What d does to a gain follows from the influence of each row. Motions that are late alike cost little, motions that are
not cost much.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from ident.arrays import Array, readonly
from ident.errors import NotIdentifiable
from ident.estimate import GainEstimate, IdentifiedGain, RefusedGain
from ident.gain_system import JointRows, joint_rows
from ident.problem import Problem
from ident.rows import Rows
from ident.uncertainty.larger import larger

NEW = 1e-6
"""Diagonal of the factor, of unit columns, under which there is nothing new in them."""
FREEDOM = 20
"""Rows more than unknowns that a delay takes."""
BLIND = 1e8
"""Condition of `Z' D` above which a joint does not show a delay of each motion."""
SURE = 60.0
"""Squared deviations from no delay above which a delay is no accident; clean logs reach 20 (`docs/derivations.md`)."""
SEEN, MOST = 0.01, 0.05
"""Relative changes of a gain by it that are not worth a word, and that no gain survives."""


@dataclass(frozen=True, slots=True, eq=False)
class Delay:
    """How late the currents of some joints are logged.

    Attributes:
        value: Of each motion [s], shape (motions,); negative where the current is logged early.
        covariance: Of it [s^2], shape (motions, motions).
    """

    value: Array
    covariance: Array

    @property
    def sure(self) -> bool:
        """Whether it is no accident."""
        return float(self.value @ np.linalg.solve(self.covariance, self.value)) > SURE


@dataclass(frozen=True, slots=True, kw_only=True)
class Lag:
    """A gain that a delay moves.

    Attributes:
        joint: The joint, from 0.
        change: Relative change of the gain that it makes.
        words: How late which motion is.
    """

    joint: int
    change: float
    words: str


def lags(problem: Problem, estimate: GainEstimate) -> tuple[Lag, ...]:
    """The gains that sure delays move by more than `SEEN`.

    The delay of all joints together is taken where it is sure, a joint's own elsewhere.
    """
    if not problem.payloads:
        return ()
    found = {joint: joint_delay(problem, joint_rows(problem, joint)) for joint in estimate.solution.rows.unknowns}
    own = {joint: delay for joint, delay in found.items() if delay is not None}
    late = _late(own)
    solution = estimate.solution
    change = -(solution.influence @ _correction(problem, solution.rows, late)) / solution.inverse
    return tuple(
        Lag(joint=joint, change=float(moved), words=_words(problem, estimate, late, k))
        for k, (joint, moved) in enumerate(zip(solution.joints.tolist(), change, strict=True))
        if estimate.identifiable[joint] and abs(moved) > SEEN
    )


def joint_delay(problem: Problem, rows: JointRows) -> Delay | None:
    """How late a joint's currents are logged in each motion; None if its rows do not show it."""
    own = [f"{name}{rows.joint + 1}" for name in ("Fv", "Fc", "off")]
    friction = [k for k, name in enumerate(rows.names) if name in own]
    anew = [rows.W[:, friction] * (rows.motion == m)[:, None] for m in np.unique(rows.motion[rows.loaded])]
    W = np.hstack((rows.W, *rows.W_L, *anew))
    dry = np.array([*(name.startswith("Fc") for name in rows.names)])
    steps = np.concatenate((dry, np.zeros(10 * len(rows.W_L), bool), *(dry[friction] for _ in anew)))
    basis, x = _solved(W, rows.V)
    freedom = len(rows.V) - basis.shape[1] - len(problem.motions)
    if freedom < FREEDOM:
        return None
    weight = rows.W[:, rows.names.index(own[-1])]
    smooth = (W[:, ~steps] @ x[~steps]) / np.where(weight > 0.0, weight, np.nan)
    motions = np.arange(len(problem.motions))
    of_motion = rows.motion[:, None] == motions  # (r, motions)
    fitted = (weight * _rate(smooth, rows, problem.row_period))[:, None] * of_motion
    logged = np.concatenate([motion.observation.joints[rows.joint].V_rate for motion in problem.motions])
    r, Z, D = (_left(basis, each) for each in (rows.V, fitted, logged[:, None] * of_motion))
    if np.linalg.cond(Z.T @ D) > BLIND:
        return None
    influence = readonly(-np.linalg.solve(Z.T @ D, Z.T))  # (motions, r)
    value = influence @ r
    left = Rows(
        V=rows.V, residual=r + D @ value, joint=np.full(len(r), rows.joint), motion=rows.motion,
        position=rows.position, row_period=problem.row_period,
        unknowns={rows.joint: len(r) - freedom},
    )  # fmt: skip
    return Delay(value, larger(left, influence, problem.options.serial_s))


def common_delay(delays: Sequence[Delay]) -> Delay:
    """The weighted mean of several joints' delays; what they differ more than by accident makes it less certain."""
    weights = [np.linalg.inv(each.covariance) for each in delays]
    covariance = np.linalg.inv(sum(weights))
    value = covariance @ sum(weight @ each.value for weight, each in zip(weights, delays, strict=True))
    spread = sum(
        float((each.value - value) @ weight @ (each.value - value))
        for weight, each in zip(weights, delays, strict=True)
    )
    freedom = len(value) * (len(delays) - 1)
    return Delay(value, readonly(covariance * max(1.0, spread / freedom if freedom else 1.0)))


def in_time(estimate: GainEstimate, found: Sequence[Lag]) -> GainEstimate:
    """The estimate without the gains that a delay moves too much.

    Raises:
        NotIdentifiable: If no gain is left.
    """
    joints = list(estimate.joints)
    for each in found:
        gain = joints[each.joint]
        if abs(each.change) > MOST and isinstance(gain, IdentifiedGain):
            joints[each.joint] = RefusedGain(
                joint=gain.joint, reason=_sentence(each), predicted_rel_std=gain.predicted_rel_std
            )
    if found and not any(isinstance(joint, IdentifiedGain) for joint in joints):
        raise NotIdentifiable(f"no drive gain can be identified; joint {found[0].joint + 1}: {_sentence(found[0])}")
    return replace(estimate, joints=tuple(joints))


def lag_notes(found: Sequence[Lag]) -> tuple[str, ...]:
    """A note on every gain that a delay moves, though not so much that it is refused."""
    return tuple(f"joint {each.joint + 1}: {_sentence(each)}" for each in found if abs(each.change) <= MOST)


def with_suspects(message: str, found: Sequence[Lag]) -> str:
    """A complaint about data that contradict themselves, with the delay that may be why."""
    late = [each for each in found if abs(each.change) > MOST]
    return f"{message}; or else, on joint {late[0].joint + 1}, {_sentence(late[0])}" if late else message


def _late(own: Mapping[int, Delay]) -> dict[int, Delay]:
    """The delays that are sure: that of all joints together for each of them, else those of single joints."""
    if not own:
        return {}
    common = common_delay(list(own.values()))
    return dict.fromkeys(own, common) if common.sure else {joint: each for joint, each in own.items() if each.sure}


def _correction(problem: Problem, rows: Rows, late: Mapping[int, Delay]) -> Array:
    """What the currents of each row change by if they are moved to where they belong, shape (r,)."""
    correction = np.zeros(len(rows.V))
    for run in rows.runs():
        joint, motion = int(rows.joint[run.start]), int(rows.motion[run.start])
        if joint in late:
            observed = problem.motions[motion].observation.joints[joint]
            at = np.searchsorted(observed.position, rows.position[run])
            correction[run] = late[joint].value[motion] * observed.V_rate[at]
    return correction


def _words(problem: Problem, estimate: GainEstimate, late: Mapping[int, Delay], k: int) -> str:
    """How late the currents that gain k rests on are, motion by motion; of its own joint if that one is late."""
    joint = int(estimate.solution.joints[k])
    worst = late[joint] if joint in late else next(iter(late.values()))
    pair = [motion.payload is None for motion in problem.motions] == [True, False]
    names = ("the bare motion", "the loaded motion") if pair else [f"motion {m + 1}" for m in range(len(worst.value))]
    return " and ".join(
        f"{1e3 * value:.2g} ms in {name}" for value, name in zip(worst.value.tolist(), names, strict=True)
    )


def _sentence(each: Lag) -> str:
    return (
        f"the currents come later than the positions, by {each.words} (less than 0: earlier), which moves this gain by "
        f"{100.0 * abs(each.change):.2g} %; shift v against q in the logs, or log both with one clock"
    )


def _solved(W: Array, V: Array) -> tuple[Array, Array]:
    """Orthonormal basis of the columns, shape (r, rank), and a solution of `W @ x = V`, zero where columns depend."""
    size = np.linalg.norm(W, axis=0)
    size[size == 0.0] = 1.0
    Q, R, pivots = linalg.qr(W / size, mode="economic", pivoting=True, check_finite=False)
    rank = int((np.abs(np.diag(R)) > NEW).sum())
    x = np.zeros(W.shape[1])
    x[pivots[:rank]] = linalg.solve_triangular(R[:rank, :rank], Q[:, :rank].T @ V)
    return readonly(Q[:, :rank]), x / size


def _left(basis: Array, columns: Array) -> Array:
    return columns - basis @ (basis.T @ columns)


def _rate(values: Array, rows: JointRows, period: float) -> Array:
    """Rate of change of a value a row by five-point differences, zero where a neighbour was left out, shape (r,)."""
    rate = np.zeros(len(values))
    for motion in np.unique(rows.motion):
        own = rows.motion == motion
        at = rows.position[own]
        full = np.full(at[-1] + 5, np.nan)
        full[2 + at] = values[own]
        m2, m1, p1, p2 = full[:-4], full[1:-3], full[3:-1], full[4:]
        rate[own] = np.nan_to_num((8.0 * (p1 - m1) - (p2 - m2)) / (12.0 * period))[at]
    return rate
