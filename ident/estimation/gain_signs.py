"""Two determinations of the sign of a gain: from the payload's torque, and from friction, which always brakes."""

from dataclasses import dataclass

import numpy as np

from ident.estimation.estimate import GainEstimate
from ident.estimation.intervals import UNCERTAINTIES
from ident.support.arrays import Array

FRICTION_Z = 10.0
"""Number of standard deviations beyond which the sign of friction is significant."""


@dataclass(frozen=True, slots=True, eq=False)
class JointSigns:
    """Significance of the sign of each solved gain.

    Attributes:
        load_z: 1/g over its standard deviation, shape (k,).
        friction_z: Friction over g, divided by its standard deviation, of total or Coulomb friction, whichever is more
            significant; its sign is that of g, shape (k,). Residuals are at least the noise floor of real drives.
    """

    load_z: Array
    friction_z: Array


def joint_signs(estimate: GainEstimate) -> JointSigns:
    """Return the significance of each solved gain's sign, by load and by friction."""
    solution, options = estimate.solution, estimate.options
    flat = solution.friction_influence.reshape(solution.friction.size, len(solution.rows.V))
    covariance = UNCERTAINTIES[options.uncertainty](solution.rows, flat)
    least = solution.rows.least_std(flat, options.noise_floor)  # without noise everything would be significant
    std = np.maximum(np.sqrt(np.diag(covariance)), least).reshape(solution.friction.shape)
    z = np.divide(solution.friction, std, out=np.zeros_like(std), where=std > 0.0)
    surer = np.take_along_axis(z, np.argmax(np.abs(z), axis=1)[:, None], axis=1)[:, 0]
    return JointSigns(solution.inverse / np.sqrt(np.diag(estimate.covariance)), surer)
