"""One joint's gain from its own rows (paper, eq. 27).

A joint's current is linear in its base parameters, the payloads' and 1/g:

    V = [W_a  0     0           ] [chi / g   ]      V    (r,)    current reference  [drive units]
        [W_b  W_ul  W_kl chi_kl ] [chi_ul / g]      W_*  (r, .)  regressors         [SI]
                                  [1 / g     ]

Only the last column has a unit of torque. Each further payload adds its unknown parameters as columns and the torque of
its known ones to the last column. If the kinematics make that column zero, or its coefficient is too uncertain, the
joint is refused, with the reason and the predicted standard deviation.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from ident.estimation.estimate import GainEstimate, GainSolution, judge_identifiability
from ident.estimation.intervals import Basis, Rows, rms
from ident.estimation.problem import Columns, NoOptions, Problem, joint_rows
from ident.model.structure import RANK_TOL, independent_columns
from ident.numerics.least_squares import LeastSquares, least_squares
from ident.payload.payload import KnownPayload
from ident.support.arrays import Array
from ident.support.errors import NotIdentifiable

NAME = "ls-2011"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GainSystem:
    """Joint j's linear system `V = W @ x`, x ending with 1/g."""

    joint: int  # the joint, from 0
    rows: Columns  # its rows
    W: Array  # observation matrix, shape (r, b); the last column is the torque of the known payload [N m]
    # weights of x that give the friction torque over g at typical speed, total and Coulomb alone, shape (2, b):
    friction: Array

    @property
    def load_rms(self) -> float:
        """Root mean square of the known payload's torque on the loaded rows [N m]."""
        return rms(self.W[self.rows.loaded, -1])


def gain_system(problem: Problem, joint: int, known: Sequence[KnownPayload]) -> GainSystem | None:
    """Build the linear system of a joint, from 0, with the known part of each of `problem.payloads` (paper, eq. 27).

    None if the torque of the known parameters cannot be separated from that of the unknown ones.
    """
    probes = problem.structure.payload_probes[joint]
    unknown = [independent_columns(probes, [np.flatnonzero(~each.mask)]) for each in known]

    def own_torque(each: KnownPayload, free: Array) -> bool:
        torque = probes[:, each.mask] @ each.chi[each.mask]
        left = torque - free @ np.linalg.lstsq(free, torque)[0]
        return bool(np.linalg.norm(left) > RANK_TOL * np.linalg.norm(probes) * np.linalg.norm(each.chi[each.mask]))

    if not any(own_torque(each, probes[:, free]) for each, free in zip(known, unknown, strict=True)):
        return None
    rows = joint_rows(problem, joint)
    torque = sum(rows.W_L[k][:, each.mask] @ each.chi[each.mask] for k, each in enumerate(known))
    W = np.column_stack([rows.W, *(rows.W_L[k][:, free] for k, free in enumerate(unknown)), torque])
    size = np.sqrt(np.mean(rows.W**2, axis=0)) * np.array((rows.of_parameter("Fv", "Fc"), rows.of_parameter("Fc")))
    friction = np.hstack((size, np.zeros((2, W.shape[1] - rows.W.shape[1]))))
    return GainSystem(joint=joint, rows=rows, W=W, friction=friction)


@dataclass(frozen=True, slots=True, eq=False)
class JointFit:
    """The solution of a joint's system, whose last unknown is 1/g."""

    system: GainSystem  # the system
    fit: LeastSquares  # its solution
    by_current: Array  # derivative of the solution by the current of each row, shape (b, r)

    @property
    def inverse(self) -> float:
        """1/g."""
        return float(self.fit.x[-1])

    @property
    def influence(self) -> Array:
        """Derivative of 1/g by the current of each of the joint's rows, shape (r,)."""
        return self.by_current[-1]

    def stated(self, known: Sequence[KnownPayload]) -> Array:
        """Relative change of g per standard deviation of each specified payload value, shape (p,)."""
        by_parameter = self.influence @ self.system.rows.W_L  # (payloads, 10)
        return np.concatenate([own @ each.spread for own, each in zip(by_parameter, known, strict=True)])


Solver = Callable[[GainSystem, float], JointFit]
"""Solves a system, given the smallest relative singular value that counts as nonzero."""


def ordinary(system: GainSystem, rank_tol: float) -> JointFit:
    """Ordinary least squares; raises `NotIdentifiable`."""
    fit = least_squares(system.W, system.rows.V, rank_tol=rank_tol)
    return JointFit(system, fit, fit.cofactor @ system.W.T)


def joint_fit(problem: Problem, joint: int, known: Sequence[KnownPayload], solver: Solver = ordinary) -> JointFit | str:
    """Solve the system of a joint, from 0, or return the reason why it has no solution (paper, eq. 27)."""
    system = gain_system(problem, joint, known)
    if system is None:
        what = "the payload's mass alone" if all(each.names == ("M",) for each in known) else "the payload"
        return f"the torque of {what} on this joint cannot be separated from that of the arm"
    try:
        return solver(system, problem.options.rank_tol)
    except NotIdentifiable as error:
        return str(error)


def joint_by_joint(problem: Problem, fits: Sequence[JointFit | str], known: Sequence[KnownPayload]) -> GainSolution:
    """Combine the solutions of all joints, in order, which are independent: the influence is block diagonal."""
    solved = [fit for fit in fits if isinstance(fit, JointFit)]
    joints = [each.system.joint for each in solved]
    columns = Columns.of(problem.motions, joints)
    rows = Rows(
        V=columns.V, residual=np.concatenate([np.zeros(0), *(each.fit.residual for each in solved)]),
        joint=columns.joint, motion=columns.motion, position=columns.position,
        unknowns={each.system.joint: each.system.W.shape[1] for each in solved}, weight=np.ones(len(columns.V)),
        explained=Basis.of(*(each.fit.basis for each in solved)),
    )  # fmt: skip
    k, r = len(solved), len(rows.V)
    of_friction = linalg.block_diag(*(each.system.friction @ each.by_current for each in solved))
    return GainSolution(
        rows=rows,
        joints=np.array(joints, dtype=np.intp),
        inverse=np.array([each.inverse for each in solved]),
        influence=linalg.block_diag(*(each.influence for each in solved)).reshape(k, r),
        payload=np.array([each.stated(known) for each in solved]).reshape(k, -1 if solved else 0),
        model=np.zeros((k, 0)),
        load_rms=np.array([each.system.load_rms for each in solved]),
        friction=np.array([each.system.friction @ each.fit.x for each in solved]).reshape(k, 2),
        friction_influence=of_friction.reshape(k, 2, r),
        unsolved={joint: fit for joint, fit in enumerate(fits) if isinstance(fit, str)},
    )


def joint_by_joint_gains(problem: Problem, _: NoOptions | None = None) -> GainEstimate:
    """Estimate each joint's drive gain independently (paper, eq. 27), with all known parameters of a payload."""
    problem.check_difference()
    known = [payload.known_part() for payload in problem.payloads]
    fits = [joint_fit(problem, joint, known) for joint in range(problem.structure.arm.n)]
    return judge_identifiability(NAME, problem, joint_by_joint(problem, fits, known))
