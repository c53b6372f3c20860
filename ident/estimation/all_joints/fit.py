"""The model of all joints at what was found, linearised: what each row's current does to each unknown."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from ident.estimation.all_joints.columns import JointColumns
from ident.estimation.all_joints.friction import OwnColumns
from ident.estimation.all_joints.reduction import ReducedJoint
from ident.estimation.all_joints.search import Found, Prior
from ident.estimation.rows import Rows
from ident.numerics.least_squares import factors
from ident.support.arrays import Array

RANK_TOL = 1e-10
"""Relative size of a unit column's new part under which the rows do not show an unknown."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AllJointsFit:
    """The fitted model.

    Attributes:
        found: Gains and shared parameters.
        phi: Values of each joint's own columns [drive units], n arrays of shape (f_j,).
        rows: Rows of all joints with their residuals.
        log_influence: Derivative of each log|h| by each row's current, shape (n, r).
        theta_influence: Derivative of each shared parameter, zero for those that the rows do not show, shape (p, r).
        phi_influence: Derivative of each joint's own values, n arrays of shape (f_j, r).
        log_belief: Change of each log|h| per deviation of everything that is believed beforehand, of own coefficients,
            of log|h| and of shared parameters, shape (n, beliefs).
        theta_belief: The same of each shared parameter, shape (p, beliefs).
        phi_belief: The same of each joint's own values, n arrays of shape (f_j, beliefs).
    """

    found: Found
    phi: tuple[Array, ...]
    rows: Rows
    log_influence: Array
    theta_influence: Array
    phi_influence: tuple[Array, ...]
    log_belief: Array
    theta_belief: Array
    phi_belief: tuple[Array, ...]


def fitted(
    columns: Sequence[JointColumns],
    own: Sequence[OwnColumns],
    joints: Sequence[ReducedJoint],
    found: Found,
    prior: Prior,
    row_period: float,
) -> AllJointsFit:
    """Linearise the model where the search ended.

    The unknowns are log|h|, theta and phi, in that order; their Jacobian is taken in each joint's reduced rows.
    """
    n, p = len(joints), joints[0].A.shape[1]
    f = [each.F.shape[1] for each in joints]
    first = n + p + np.cumsum([0, *f])
    sizes = [len(each.V) for each in joints]
    starts = np.cumsum([0, *sizes])
    J = np.zeros((starts[-1] + n + len(prior.rows), first[-1]))
    residual, phi = np.zeros(starts[-1]), list[Array]()
    for j, each in enumerate(joints):
        rows = slice(starts[j], starts[j + 1])
        torque = each.A @ found.theta + each.k
        left = each.V - found.h[j] * torque
        phi.append(linalg.solve_triangular(each.F[: f[j]], left[: f[j]], check_finite=False))
        J[rows, j] = found.h[j] * torque
        J[rows, n : n + p] = found.h[j] * each.A
        J[rows, first[j] : first[j + 1]] = each.F
        residual[rows] = left - each.F @ phi[j]
    J[starts[-1] + np.arange(n), np.arange(n)] = 1.0 / prior.std
    J[starts[-1] + n :, n : n + p] = prior.rows
    solved, pseudo = factors(J, rank_tol=RANK_TOL), np.zeros((J.shape[1], J.shape[0]))
    pseudo[solved.columns] = linalg.solve_triangular(solved.R, solved.Q.T, check_finite=False)
    spread, explained = pseudo[:, : starts[-1]], solved.Q[: starts[-1]]
    whole = [spread[:, starts[j] : starts[j + 1]] @ each.Q.T for j, each in enumerate(joints)]
    influence = np.hstack([part[:, : each.rows] / each.sigma for part, each in zip(whole, joints, strict=True)])
    belief = np.hstack(
        [*(part[:, each.rows :] for part, each in zip(whole, joints, strict=True)), pseudo[:, starts[-1] :]]
    )
    data = [each.Q[: each.rows] for each in joints]
    hat = np.vstack([Q @ explained[starts[j] : starts[j + 1]] for j, Q in enumerate(data)])
    lengths = [len(each.V) for each in columns]
    ends = np.cumsum([0, *lengths])
    return AllJointsFit(
        found=found,
        phi=tuple(phi),
        rows=Rows(
            V=np.concatenate([each.V for each in columns]),
            residual=np.concatenate(
                [each.sigma * (data[j] @ residual[starts[j] : starts[j + 1]]) for j, each in enumerate(joints)]
            ),
            joint=np.repeat(np.arange(n), lengths),
            motion=np.concatenate([each.motion for each in columns]),
            position=np.concatenate([each.position for each in columns]),
            row_period=row_period,
            unknowns={j: float(np.sum(hat[ends[j] : ends[j + 1]] ** 2)) for j in range(n)},
            explained=hat,
            weight=np.repeat([1.0 / each.sigma for each in joints], lengths),
        ),
        log_influence=influence[:n],
        theta_influence=influence[n : n + p],
        phi_influence=tuple(influence[first[j] : first[j + 1]] for j in range(n)),
        log_belief=belief[:n],
        theta_belief=belief[n : n + p],
        phi_belief=tuple(belief[first[j] : first[j + 1]] for j in range(n)),
    )
