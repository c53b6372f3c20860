"""How late currents are logged: logs of two controllers merged, a current that is logged after its position.

A current that is logged late by a time d is `V = W x - d dV/dt`, so that d is linear in what is left of it. What stands
beside it in the fit is all that the arm may be: its own parameters, friction and offset anew in each loaded motion, any
payload. Two signals know how the current changes: its own filtered rate, which has the right size, but noise of its
own; and the rate of the fitted current from row to row, without noise, but blind beside reversals. The second is the
instrument of the first:

    d = -(Z' D)^-1 Z' r      Z, D  (r, motions) what the fit leaves of the fitted and of the logged rate, r of V.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from ident.arrays import Array, readonly
from ident.gain_system import JointRows
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
    smooth = (W[:, ~steps] @ x[~steps]) / np.where(rows.weight > 0.0, rows.weight, np.nan)
    motions = np.arange(len(problem.motions))
    of_motion = rows.motion[:, None] == motions  # (r, motions)
    fitted = (rows.weight * _rate(smooth, rows, problem.row_period))[:, None] * of_motion
    logged = np.concatenate([motion.observation.joints[rows.joint].V_rate for motion in problem.motions])
    r, Z, D = (_left(basis, each) for each in (rows.V, fitted, logged[:, None] * of_motion))
    if np.linalg.cond(Z.T @ D) > BLIND:
        return None
    influence = readonly(-np.linalg.solve(Z.T @ D, Z.T))  # (motions, r)
    value = influence @ r
    left = Rows(
        V=rows.V, residual=r + D @ value, joint=np.full(len(r), rows.joint), motion=rows.motion,
        position=rows.position, row_period=problem.row_period,
        unknowns={rows.joint: len(r) - freedom}, weight=np.ones(len(r)), explained=np.zeros((len(r), 0)),
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
