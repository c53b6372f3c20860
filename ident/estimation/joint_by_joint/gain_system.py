"""The linear system of one joint: its current is linear in its base parameters, the payloads' and 1/g (paper, eq. 27).

    V = [W_a  0     0           ] [chi / g   ]      V    (r,)    current reference  [drive units]
        [W_b  W_ul  W_kl chi_kl ] [chi_ul / g]      W_*  (r, .)  regressors         [SI]
                                  [1 / g     ]

Only the last column has a unit of torque. Each further payload adds its unknown parameters as columns and the torque of
its known ones to the last column.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.estimation.problem import Problem
from ident.model.structure import RANK_TOL, Structure, independent_columns
from ident.payload.payload import KnownPayload
from ident.support.arrays import Array, Indices, Mask


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
