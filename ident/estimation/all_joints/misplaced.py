"""Joints whose zeros are off and a base that is tilted: what they change of the torques, to first order.

An encoder that reads d too much has its joint at q - d: joint j's torque changes by -d_k times its derivative by q_k. A
base that is tilted turns gravity by a small angle about the base's x and y axes. Both are unknowns with a belief: where
data are better than the calibration they correct it, and where not its deviation is a share of the interval.
"""

from dataclasses import replace

import numpy as np

from ident.estimation.all_joints.columns import SharedParameters
from ident.estimation.all_joints.solution import Setting, fit_with, prepared, widened
from ident.estimation.all_joints.terms import of_rows
from ident.estimation.all_joints.torques import torques
from ident.estimation.problem import Problem
from ident.support.arrays import Array

MILLIMETRE = 1e-3
"""What a slide's zero is off by [m] where an axis' is by a degree."""


def with_misplaced(ready: Setting, *, zero_deg: float, tilt_deg: float) -> Setting:
    """A problem whose zeros and base are known to a deviation.

    Args:
        ready: The problem, of recordings.
        zero_deg: Deviation of the joints' zeros [deg, of slides mm]; 0 if they are right.
        tilt_deg: Deviation of the base's tilt about either axis [deg]; 0 if it is upright as the model has it.
    """
    arm, known = ready.problem.structure.arm, ready.shared_std
    zero = np.where(arm.revolute, np.radians(zero_deg), MILLIMETRE * zero_deg)
    std = np.concatenate((zero, np.full(2, np.radians(tilt_deg))))
    unsure = std > 0.0
    if not unsure.any():
        return ready
    plain = fit_with(ready, [{}] * ready.n, (), None)
    columns = misplaced(ready.problem, ready.shared, plain.fit.found.theta)
    return replace(
        ready,
        columns=prepared(widened(ready.columns, [each[:, unsure] for each in columns]), per_motion=ready.per_motion),
        shared_std=np.concatenate((known, std[unsure])),
    )


def misplaced(problem: Problem, shared: SharedParameters, theta: Array) -> tuple[Array, ...]:
    """Change of the torque of each joint's rows per error of each zero, then per tilt of the base.

    Args:
        problem: Motions from recordings.
        shared: Which parameters joints share.
        theta: Their values, shape (p,).

    Returns:
        n arrays of shape (r_j, n + 2) [N m/rad, by slides N m/m].
    """
    changes = [(motion, torques(problem, motion, shared, theta).misplaced()) for motion in problem.motions]
    return tuple(np.vstack([of_rows(*each, j) for each in changes]) for j in range(problem.structure.arm.n))
