"""Whether the torque that a payload puts on a joint has the shape that its description and the kinematics imply.

The system of eq. 27 leaves the known payload one unknown, 1/g. Its other columns, which should have nothing to add, are
offered to the residual: what they explain is the part of the load that the description does not. A zero off by pi/2, a
sign, joints in another order, another base or another arm change the shape; a wrong gain alone does not.
"""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

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


def shape_mismatch(problem: Problem, joint: JointFit) -> ShapeMismatch | None:
    """What the payload's other columns explain of the residual of a joint; None if there are none."""
    system, fit = joint.system, joint.fit
    probes = problem.structure.payload_probes[system.rows.joint]
    chosen = independent_columns(probes, [np.arange(probes.shape[1])])
    columns = np.hstack([W_L[:, chosen] for W_L in system.rows.W_L])
    norms = np.linalg.norm(columns, axis=0)
    unit = columns[:, norms > 0.0] / norms[norms > 0.0]
    new = unit - system.W @ (fit.cofactor @ (system.W.T @ unit))
    directions, size, _ = linalg.svd(new, full_matrices=False)
    directions = directions[:, size > NEW]
    rank = directions.shape[1]
    freedom = len(fit.residual) - system.W.shape[1] - rank
    if not rank or freedom < 1:
        return None
    explained = float(np.linalg.norm(directions.T @ fit.residual))
    left = float(np.linalg.norm(fit.residual - directions @ (directions.T @ fit.residual)))
    own = 1.0 / float(np.sqrt(fit.cofactor[-1, -1]))  # norm of the last column's part orthogonal to the others
    F = (explained**2 / rank) / (left**2 / freedom) if left > 0.0 else float("inf")
    return ShapeMismatch(share=explained / (own * abs(joint.inverse)), F=F)
