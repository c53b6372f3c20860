"""Joints whose zeros are off and a base that is tilted: what they change of the torques, to first order.

An encoder that reads d too much has its joint at q - d: joint j's torque changes by -d_k times its derivative by q_k. A
base that is tilted turns gravity by a small angle about the base's x and y axes. Both are unknowns with a belief: where
data are better than the calibration they correct it, and where not its deviation is a share of the interval.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ident.estimation.all_joints.columns import SharedParameters
from ident.estimation.all_joints.displacement import States, displaced_torques
from ident.estimation.all_joints.solution import Setting, fit_with, widened
from ident.estimation.all_joints.torques import fitted_parameters, sampled_states
from ident.estimation.problem import ObservedMotion, Problem
from ident.model.arm import Arm
from ident.model.inverse_dynamics import inverse_dynamics
from ident.numerics.splines import spline
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
        columns=widened(ready.columns, [each[:, unsure] for each in columns]),
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
    parts: list[list[Array]] = [[] for _ in range(problem.structure.arm.n)]
    for motion in problem.motions:
        behind = motion.observation.full_rate
        assert behind is not None, "asked of recordings only"
        change = _at_full_rate(problem, motion, shared, theta)
        for j, rows in enumerate(motion.observation.joints):
            decimated = [behind.decimated(column, j) for column in change[:, j].T]
            parts[j].append(np.column_stack(decimated)[rows.position])
    return tuple(np.vstack(each) for each in parts)


def _at_full_rate(problem: Problem, motion: ObservedMotion, shared: SharedParameters, theta: Array) -> Array:
    """Change of each joint's torque, shape (N, n, n + 2)."""
    arm = problem.structure.arm
    chi = fitted_parameters(problem, motion, shared, theta)
    t, at, states = sampled_states(motion)
    still = np.zeros_like(states.q)
    turned = displaced_torques(arm, chi, states, States(np.ones_like(states.q), still, still))
    tilted = [inverse_dynamics(each, chi, states.q, still, still)[..., None] for each in _tilted(arm)]
    return spline(t[at], np.concatenate((-turned, *tilted), axis=2))(t)


def _tilted(arm: Arm) -> Sequence[Arm]:
    """The arm under what gravity changes by per tilt about the base's x and y axis: g turns the other way."""
    return [replace(arm, gravity=np.cross(arm.gravity, axis)) for axis in np.eye(3)[:2]]
