"""Whether the torque that a payload puts on a joint has the shape that its description and the kinematics imply.

The system of eq. 27 leaves the known payload one unknown, 1/g. Its other columns, which should have nothing to add, are
offered to the residual: what they explain is the part of the load that the description does not. A zero off by pi/2, a
sign, joints in another order, another base or another arm change the shape; a wrong gain alone does not. So do friction
that grows with load and joints that yield: where their columns are given, what they explain counts first.
"""

from dataclasses import dataclass

import numpy as np
from scipy import linalg, optimize

from ident.arrays import Array
from ident.base import independent_columns
from ident.joint_fit import JointFit
from ident.problem import Problem

NEW = 1e-6
"""Singular value, of unit columns, under which there is nothing new in them: the described torque is one of them."""


@dataclass(frozen=True, slots=True)
class ShapeMismatch:
    """What the other columns of the payload explain on one joint.

    Attributes:
        share: Norm of it over the norm of what of the payload's torque the arm's own parameters cannot imitate.
        F: Its mean square a column over that of the residual.
    """

    share: float
    F: float


def shape_mismatch(problem: Problem, joint: JointFit, beside: Array | None = None) -> ShapeMismatch | None:
    """What the payload's other columns explain of the residual of a joint; None if there are none.

    Args:
        problem: Motions and payloads.
        joint: The joint's solution.
        beside: The most that other causes may add to its currents [drive units], shape (r, k); what they explain by a
            share from 0 to 1 of each is none of the payload's.
    """
    system, fit = joint.system, joint.fit
    probes = problem.structure.payload_probes[system.rows.joint]
    chosen = independent_columns(probes, [np.arange(probes.shape[1])])
    new = _without(joint, _unit(np.hstack([W_L[:, chosen] for W_L in system.rows.W_L])))
    directions, size, _ = linalg.svd(new, full_matrices=False)
    directions = directions[:, size > NEW]
    other = np.zeros((len(fit.residual), 0)) if beside is None else _without(joint, beside[:, beside.any(axis=0)])
    rank = directions.shape[1]
    freedom = len(fit.residual) - system.W.shape[1] - rank - other.shape[1]
    if not rank or freedom < 1:
        return None
    before = _left(other, fit.residual)
    left = _left(*(each - directions @ (directions.T @ each) for each in (other, fit.residual)))
    explained = max(before - left, 0.0)
    own = 1.0 / float(np.sqrt(fit.cofactor[-1, -1]))  # norm of the last column's part orthogonal to the others
    F = (explained / rank) / (left / freedom) if left > 0.0 else float("inf")
    return ShapeMismatch(share=float(np.sqrt(explained)) / (own * abs(joint.inverse)), F=F)


def _unit(columns: Array) -> Array:
    norms = np.linalg.norm(columns, axis=0)
    return columns[:, norms > 0.0] / norms[norms > 0.0]


def _without(joint: JointFit, columns: Array) -> Array:
    """Columns less what those of the joint's system are of them."""
    W = joint.system.W
    return columns - W @ (joint.fit.cofactor @ (W.T @ columns))


def _left(columns: Array, V: Array) -> float:
    """Sum of squares of V that a share from 0 to 1 of each column leaves."""
    if not columns.shape[1]:
        return float(V @ V)
    return 2.0 * float(optimize.lsq_linear(columns, V, (0.0, 1.0), method="bvls").cost)
