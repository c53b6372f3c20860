"""How well the gains would come out if a motion were repeated with the payload one has.

The rows of the log stand for both motions, without and with the payload. The deviation of 1/g follows from the columns
alone (paper, eq. 20), with the residual that a joint's own free fit leaves or that any real drive has, whichever is
larger; that it is one of the gain takes a gain, from a data sheet or from the robot's file.
"""

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Severity
from ident.diagnosis.friction_sign import RANK_TOL
from ident.estimation.gain_options import GainOptions
from ident.estimation.joint_by_joint.gain_system import gain_system, joint_rows
from ident.estimation.problem import ObservedMotion, Problem, pair
from ident.numerics.least_squares import least_squares
from ident.observation.observation import Observation
from ident.payload.payload import Payload
from ident.support.arrays import Array
from ident.support.errors import NotExcited, TooFewRows


def predicted_rel_std(
    observation: Observation, payload: Payload, gain: Array, options: GainOptions
) -> tuple[float | None, ...]:
    """Relative deviation of each joint's gain to expect, joint by joint; None where the joint cannot show it at all.

    Args:
        observation: Of a motion with a bare flange.
        payload: That would be mounted.
        gain: What the gains are about [N m / drive unit], shape (n,).
        options: When a gain counts as identifiable.
    """
    both = pair(observation, observation, payload, options)
    alone = Problem(observation.structure, (ObservedMotion(observation, None),), options)
    return tuple(
        _predicted(both, alone, joint, float(gain[joint]), options) for joint in range(observation.structure.arm.n)
    )


def _predicted(both: Problem, alone: Problem, joint: int, gain: float, options: GainOptions) -> float | None:
    system = gain_system(both, joint, [payload.known_part() for payload in both.payloads])
    if system is None:
        return None
    rows = joint_rows(alone, joint)
    try:
        own = least_squares(rows.W, rows.V, rank_tol=RANK_TOL)
        fit = least_squares(system.W, system.rows.V, rank_tol=RANK_TOL)
    except (TooFewRows, NotExcited):
        return None
    sigma = max(own.sigma, options.noise_floor * float(np.sqrt(np.mean(rows.V**2))))
    return sigma * float(np.sqrt(fit.cofactor[-1, -1])) * abs(gain)  # std(g) / g = g std(1/g)


def excitation(log: str, predicted: tuple[float | None, ...], options: GainOptions) -> Diagnosis:
    """Which gains this motion and that payload would give."""
    unseen = [j for j, std in enumerate(predicted) if std is None or std > options.max_rel_std]
    words = ", ".join("-" if std is None else f"{100.0 * std:.2g}" for std in predicted)
    listed = ", ".join(str(j + 1) for j in unseen)
    return Diagnosis(
        name="excitation",
        severity=Severity.WEAK if unseen else Severity.GOOD,
        sentence=f"predicted standard deviations of the gains, joint by joint: {words} %",
        advice=f"for joint {listed}, mount the payload farther from its axis, or a heavier one" if unseen else None,
        joints=tuple(unseen),
        logs=(log,),
    )
