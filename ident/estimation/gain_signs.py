"""The sign of a gain, told twice: by the payload's torque and by friction, which always brakes."""

from dataclasses import dataclass

import numpy as np

from ident.estimation.estimate import GainEstimate
from ident.estimation.uncertainty import UNCERTAINTIES
from ident.support.arrays import Array

FRICTION_Z = 10.0
"""Standard deviations above which the sign of the friction is trusted."""


@dataclass(frozen=True, slots=True, eq=False)
class JointSigns:
    """What tells the sign of each solved gain.

    Attributes:
        load_z: 1/g over its standard deviation: how visible the payload is, shape (k,).
        friction_z: Friction over g over its deviation, total or dry, whichever is surer; its sign is that of g,
            shape (k,). A residual below the least that real drives have counts as that.
    """

    load_z: Array
    friction_z: Array


def joint_signs(estimate: GainEstimate) -> JointSigns:
    """How sure load and friction are of the sign of each solved gain."""
    solution, options = estimate.solution, estimate.options
    flat = solution.friction_influence.reshape(solution.friction.size, len(solution.rows.V))
    covariance = UNCERTAINTIES[options.uncertainty](solution.rows, flat, options.serial_s)
    least = solution.rows.least_std(flat, options.noise_floor)  # residuals of an ideal simulation make anything sure
    std = np.maximum(np.sqrt(np.diag(covariance)), least).reshape(solution.friction.shape)
    z = np.divide(solution.friction, std, out=np.zeros_like(std), where=std > 0.0)
    surer = np.take_along_axis(z, np.argmax(np.abs(z), axis=1)[:, None], axis=1)[:, 0]
    return JointSigns(solution.inverse / np.sqrt(np.diag(estimate.covariance)), surer)
