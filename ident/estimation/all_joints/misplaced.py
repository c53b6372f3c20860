"""Errors of the joints' zeros and tilt of the base: their effect on the torques, to first order.

If an encoder reads d too much, its joint is at q - d: joint j's torque changes by -d_k times its derivative by q_k. A
tilted base rotates gravity by a small angle about the base's x and y axes. Both are unknowns with a prior: data that
are more accurate than the calibration correct it; otherwise the prior contributes to the interval.
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
"""Zero error of a prismatic joint [m] that corresponds to one degree of a revolute one."""


def with_misplaced(ready: Setting, *, zero_deg: float, tilt_deg: float) -> Setting:
    """Add errors of zeros and base, with their priors, to a problem.

    Args:
        ready: The problem, from recordings.
        zero_deg: Prior standard deviation of the joints' zeros [deg; mm for prismatic joints]; 0 if they are exact.
        tilt_deg: Prior standard deviation of the base's tilt about each axis [deg]; 0 if it is exact.
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
    """Return the change of torque of each joint's rows per error of each zero, then per tilt of the base.

    Returns:
        n arrays of shape (r_j, n + 2) [N m/rad; N m/m for prismatic joints].
    """
    changes = [(motion, torques(problem, motion, shared, theta).misplaced()) for motion in problem.motions]
    return tuple(np.vstack([of_rows(*each, j) for each in changes]) for j in range(problem.structure.arm.n))
