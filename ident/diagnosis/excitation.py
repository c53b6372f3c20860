"""Predicted accuracy of the gains if a motion is repeated with a given payload.

The rows of the log represent both motions, without and with the payload. The standard deviation of 1/g follows from the
columns (paper, eq. 20) and the residual: that of a joint's own fit, but at least that of real drives. An approximate
gain, from a data sheet or the robot file, converts it to a relative one.
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
from ident.support.errors import NotIdentifiable


def predicted_rel_std(
    observation: Observation, payload: Payload, gain: Array, options: GainOptions
) -> tuple[float | None, ...]:
    """Predict the relative standard deviation of each gain, joint by joint; None if it is not identifiable.

    Args:
        observation: A motion with a bare flange.
        payload: The payload to be mounted.
        gain: Approximate gains [N m / drive unit], shape (n,).
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
    except NotIdentifiable:
        return None
    sigma = max(own.sigma, options.noise_floor * float(np.sqrt(np.mean(rows.V**2))))
    return sigma * float(np.sqrt(fit.cofactor[-1, -1])) * abs(gain)  # std(g) / g = g std(1/g)


def excitation(log: str, predicted: tuple[float | None, ...], options: GainOptions) -> Diagnosis:
    """Return the diagnosis of the gains that motion and payload would identify."""
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
