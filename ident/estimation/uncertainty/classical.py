"""Covariance for white residuals with one standard deviation per joint (paper, eq. 20)."""

import numpy as np

from ident.estimation.rows import Rows
from ident.support.arrays import Array


def classical(rows: Rows, influence: Array, serial_s: float) -> Array:
    """Return the covariance for white residuals, shape (k, k); `serial_s` is ignored."""
    sigma = np.empty(len(rows.V))
    for joint in rows.unknowns:
        sigma[rows.of(joint)] = rows.sigma(joint)
    spread = influence * sigma
    return spread @ spread.T  # eq. 20: influence @ influence.T is (W^T W)^-1
