"""One joint's gain from its own rows (paper, eq. 27), and the rows of all joints (eq. 15, 16 and 25).

A joint's current is linear in its base parameters, the payloads' and 1/g:

    V = [W_a  0     0           ] [chi / g   ]      V    (r,)    current reference  [drive units]
        [W_b  W_ul  W_kl chi_kl ] [chi_ul / g]      W_*  (r, .)  regressors         [SI]
                                  [1 / g     ]

Only the last column has a unit of torque. Each further payload adds its unknown parameters as columns and the torque of
its known ones to the last column.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from ident.estimation.estimate import GainSolution
from ident.estimation.intervals import Rows
from ident.estimation.problem import ObservedMotion, Problem
from ident.model.structure import RANK_TOL, Structure, independent_columns
from ident.numerics.least_squares import LeastSquares, least_squares
from ident.payload.payload import KnownPayload
from ident.support.arrays import Array, Indices, Mask
from ident.support.errors import NotIdentifiable


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointRows:
    """The rows of one joint, the motions one after the other.

    Attributes:
        joint: The joint, from 0.
        names: Names of the arm's base parameters that are identifiable from this joint alone, b strings.
        W: Columns of these, shape (r, b).
        W_L: Columns of each payload, zero in the rows of other motions, shape (payloads, r, 10).
        V: Currents [drive units], shape (r,).
        weight: Remaining filter weight of each row, below 1 near reversals, shape (r,).
        motion: Motion of each row, shape (r,).
        position: Number of each row in its motion, including omitted rows, shape (r,).
        loaded: Mask of the rows with a payload, shape (r,).
    """

    joint: int
    names: tuple[str, ...]
    W: Array
    W_L: Array
    V: Array
    weight: Array
    motion: Indices
    position: Indices
    loaded: Mask


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GainSystem:
    """Joint j's linear system `V = W @ x`, x ending with 1/g.

    Attributes:
        rows: The joint's rows.
        W: Observation matrix, shape (r, b); the last column is the torque of the known payload [N m].
        friction: Weights of x that give the friction torque over g at typical speed, total and Coulomb alone, shape (2,
            b).
    """

    rows: JointRows
    W: Array
    friction: Array

    @property
    def load_rms(self) -> float:
        """Root mean square of the known payload's torque on the loaded rows [N m]."""
        return float(np.sqrt(np.mean(self.W[self.rows.loaded, -1] ** 2)))


def joint_rows(problem: Problem, joint: int) -> JointRows:
    """Return the rows of a joint, from 0, of all motions."""
    structure = problem.structure
    names = structure.base.names
    parts = [motion.observation.joints[joint] for motion in problem.motions]
    arm = np.isin(parts[0].columns, structure.joint_independent[joint])
    lengths = [len(part.V) for part in parts]
    W_L = np.array(
        [
            np.vstack(
                [
                    part.W_L if motion.payload is payload else np.zeros_like(part.W_L)
                    for part, motion in zip(parts, problem.motions, strict=True)
                ]
            )
            for payload in problem.payloads
        ]
    )
    return JointRows(
        joint=joint,
        names=tuple(names[column] for column in parts[0].columns[arm]),
        W=np.vstack([part.W[:, arm] for part in parts]),
        W_L=W_L,
        V=np.concatenate([part.V for part in parts]),
        weight=np.concatenate([part.weight for part in parts]),
        motion=np.repeat(np.arange(len(parts)), lengths),
        position=np.concatenate([part.position for part in parts]),
        loaded=np.repeat([motion.payload is not None for motion in problem.motions], lengths),
    )


def gain_system(problem: Problem, joint: int, known: Sequence[KnownPayload]) -> GainSystem | None:
    """Build the linear system of a joint (paper, eq. 27).

    Args:
        problem: Motions and payloads.
        joint: The joint, from 0.
        known: The known part of each of `problem.payloads`.

    Returns:
        The system, None if the torque of the known parameters cannot be separated from that of the unknown ones.
    """
    structure = problem.structure
    unknown = [_unknown_columns(structure, joint, each) for each in known]
    if not any(_own_torque(structure, joint, each, free) for each, free in zip(known, unknown, strict=True)):
        return None
    rows = joint_rows(problem, joint)
    torque = sum(rows.W_L[k][:, each.mask] @ each.chi[each.mask] for k, each in enumerate(known))
    W = np.column_stack([rows.W, *(rows.W_L[k][:, free] for k, free in enumerate(unknown)), torque])
    names, size = np.array(rows.names), np.sqrt(np.mean(rows.W**2, axis=0))
    friction = np.zeros((2, W.shape[1]))
    friction[0, : len(names)] = np.where(np.isin(names, (f"Fv{joint + 1}", f"Fc{joint + 1}")), size, 0.0)
    friction[1, : len(names)] = np.where(names == f"Fc{joint + 1}", size, 0.0)
    return GainSystem(rows=rows, W=W, friction=friction)


def _unknown_columns(structure: Structure, joint: int, known: KnownPayload) -> Indices:
    """Independent columns of a payload's unknown parameters on this joint."""
    return independent_columns(structure.payload_probes[joint], [np.flatnonzero(~known.mask)])


def _own_torque(structure: Structure, joint: int, known: KnownPayload, unknown: Indices) -> bool:
    """Whether the torque of a payload's known parameters is outside the column space of the unknown ones."""
    probes = structure.payload_probes[joint]
    torque = probes[:, known.mask] @ known.chi[known.mask]
    left = torque - probes[:, unknown] @ np.linalg.lstsq(probes[:, unknown], torque)[0]
    scale = np.linalg.norm(probes) * np.linalg.norm(known.chi[known.mask])
    return bool(np.linalg.norm(left) > RANK_TOL * scale)


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


@dataclass(frozen=True, slots=True, eq=False)
class PooledSystem:
    """`g V = W @ chi + W_L @ chi_L + rho`, rows in order of joints (eq. 16), then of motions.

    Attributes:
        V: Currents [drive units], shape (r,).
        W: Base columns of the arm, shape (r, b).
        W_L: The payload's ten columns, zero in unloaded rows, shape (r, 10).
        joint: Joint of each row, from 0, shape (r,).
        motion: Motion of each row, in the order given, shape (r,).
        loaded: Mask of the rows of loaded motions, shape (r,).
        t: Time of each row [s], shape (r,).
    """

    V: Array
    W: Array
    W_L: Array
    joint: Indices
    motion: Indices
    loaded: Mask
    t: Array


def pooled_system(motions: Sequence[ObservedMotion]) -> PooledSystem:
    """Stack motions of one structure, one or more."""
    structure = motions[0].observation.structure
    parts = [(j, k, motion.observation.joints[j]) for j in range(structure.arm.n) for k, motion in enumerate(motions)]
    heavy = [motion.payload is not None for motion in motions]
    W = np.zeros((sum(len(joint.V) for _, _, joint in parts), len(structure.base.columns)))
    start = 0
    for _, _, joint in parts:
        W[start : start + len(joint.V), joint.columns] = joint.W
        start += len(joint.V)
    return PooledSystem(
        V=np.concatenate([joint.V for _, _, joint in parts]),
        W=W,
        W_L=np.vstack([joint.W_L if heavy[k] else np.zeros_like(joint.W_L) for _, k, joint in parts]),
        joint=np.concatenate([np.full(len(joint.V), j) for j, _, joint in parts]),
        motion=np.concatenate([np.full(len(joint.V), k) for _, k, joint in parts]),
        loaded=np.concatenate([np.full(len(joint.V), heavy[k]) for _, k, joint in parts]),
        t=np.concatenate([joint.t for _, _, joint in parts]),
    )
