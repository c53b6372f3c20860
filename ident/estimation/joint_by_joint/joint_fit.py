"""Solution of one joint's system, with the influence of each row."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from ident.estimation.estimate import GainSolution
from ident.estimation.intervals import Rows
from ident.estimation.joint_by_joint.gain_system import GainSystem, gain_system
from ident.estimation.problem import Problem
from ident.numerics.least_squares import LeastSquares, least_squares
from ident.payload.payload import KnownPayload
from ident.support.arrays import Array, Indices
from ident.support.errors import NotIdentifiable


@dataclass(frozen=True, slots=True, eq=False)
class JointFit:
    """The solution of a joint's system, whose last unknown is 1/g.

    Attributes:
        system: The system.
        fit: Its solution.
        by_current: Derivative of the solution by the current of each row, shape (b, r).
    """

    system: GainSystem
    fit: LeastSquares
    by_current: Array

    @property
    def inverse(self) -> float:
        """1/g."""
        return float(self.fit.x[-1])

    @property
    def influence(self) -> Array:
        """Derivative of 1/g by the current of each of the joint's rows, shape (r,)."""
        return self.by_current[-1]

    @property
    def sensitivity(self) -> Array:
        """Relative change of g per unit of each payload parameter, shape (payloads, 10)."""
        return self.influence @ self.system.rows.W_L

    def stated(self, known: Sequence[KnownPayload]) -> Array:
        """Relative change of g per standard deviation of each specified payload value, shape (p,)."""
        return np.concatenate([own @ each.spread for own, each in zip(self.sensitivity, known, strict=True)])


@dataclass(frozen=True, slots=True)
class NoFit:
    """A joint without a solution, and the reason."""

    joint: int
    reason: str


Solver = Callable[[GainSystem, float], JointFit]
"""Solves a system, given the smallest relative singular value that counts as nonzero."""


def ordinary(system: GainSystem, rank_tol: float) -> JointFit:
    """Ordinary least squares.

    Raises:
        NotIdentifiable: If there are not more rows than unknowns, or they do not excite every unknown.
    """
    fit = least_squares(system.W, system.rows.V, rank_tol=rank_tol)
    return JointFit(system, fit, fit.cofactor @ system.W.T)


def joint_fit(
    problem: Problem, joint: int, known: Sequence[KnownPayload], solver: Solver = ordinary
) -> JointFit | NoFit:
    """Solve the system of a joint, from 0, or give the reason why it has no solution (paper, eq. 27)."""
    system = gain_system(problem, joint, known)
    if system is None:
        what = "the payload's mass alone" if all(each.names == ("M",) for each in known) else "the payload"
        return NoFit(joint, f"the torque of {what} on this joint cannot be separated from that of the arm")
    try:
        return solver(system, problem.options.rank_tol)
    except NotIdentifiable as error:
        return NoFit(joint, str(error))


def joint_by_joint(fits: Sequence[JointFit | NoFit], known: Sequence[KnownPayload], row_period: float) -> GainSolution:
    """Combine the solutions of independent joints: the influence is block diagonal.

    Args:
        fits: One per joint, in order.
        known: The known part of each payload.
        row_period: Time from one row to the next [s].
    """
    solved = [fit for fit in fits if isinstance(fit, JointFit)]
    rows = fitted_rows(solved, row_period)
    influence, friction_influence = np.zeros((len(solved), len(rows.V))), np.zeros((len(solved), 2, len(rows.V)))
    for k, each in enumerate(solved):
        own = rows.of(each.system.rows.joint)
        influence[k, own] = each.influence
        friction_influence[k, :, own] = each.system.friction @ each.by_current
    return GainSolution(
        rows=rows,
        joints=np.array([each.system.rows.joint for each in solved], dtype=np.intp),
        inverse=np.array([each.inverse for each in solved]),
        influence=influence,
        payload=np.array([each.stated(known) for each in solved]).reshape(len(solved), -1 if solved else 0),
        model=np.zeros((len(solved), 0)),
        load_rms=np.array([each.system.load_rms for each in solved]),
        friction=np.array([each.system.friction @ each.fit.x for each in solved]).reshape(len(solved), 2),
        friction_influence=friction_influence,
        unsolved={fit.joint: fit.reason for fit in fits if isinstance(fit, NoFit)},
    )


def fitted_rows(solved: Sequence[JointFit], row_period: float) -> Rows:
    """The rows of solved joints, one joint after the other."""
    nothing = np.zeros(0)

    def joined(parts: Sequence[Array]) -> Array:
        return np.concatenate([nothing, *parts])

    def numbers(parts: Sequence[Indices]) -> Indices:
        return np.concatenate([nothing.astype(np.intp), *parts])

    return Rows(
        V=joined([each.system.rows.V for each in solved]),
        residual=joined([each.fit.residual for each in solved]),
        joint=numbers([np.full(len(each.system.rows.V), each.system.rows.joint, dtype=np.intp) for each in solved]),
        motion=numbers([each.system.rows.motion for each in solved]),
        position=numbers([each.system.rows.position for each in solved]),
        row_period=row_period,
        unknowns={each.system.rows.joint: each.system.W.shape[1] for each in solved},
        weight=joined([np.ones(len(each.system.rows.V)) for each in solved]),
        explained=linalg.block_diag(*(each.fit.basis for each in solved)),
    )
