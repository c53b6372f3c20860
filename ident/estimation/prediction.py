"""The deviation to expect of a gain: that of the residual, and never less than a real drive's residual would give."""

import numpy as np

from ident.estimation.rows import Rows
from ident.support.arrays import Array


def predicted_rel_std(rows: Rows, influence: Array, inverse: Array, covariance: Array, noise_floor: float) -> Array:
    """Relative standard deviations of gains to expect of data like these.

    Args:
        rows: Rows that the gains were found from.
        influence: Derivative of each 1/g by each row's current, shape (k, r).
        inverse: 1/g, shape (k,).
        covariance: Of 1/g from the residuals, shape (k, k).
        noise_floor: Residual that any real drive has, as a share of the joint's rms current.

    Returns:
        Shape (k,).
    """
    floor = np.empty(len(rows.V))
    for joint in rows.unknowns:
        floor[rows.of(joint)] = noise_floor * rows.rms_current(joint)
    least = np.linalg.norm(influence * floor, axis=1)
    return np.maximum(np.sqrt(np.diag(covariance)), least) / np.abs(inverse)  # std(g) / g = std(1/g) / (1/g)
