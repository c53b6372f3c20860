"""The larger of the classical and the serial deviation, quantity by quantity."""

import numpy as np

from ident.estimation.rows import Rows
from ident.estimation.uncertainty.classical import classical
from ident.estimation.uncertainty.serial import serial
from ident.support.arrays import Array


def max_of_classical_and_hac(rows: Rows, influence: Array, serial_s: float) -> Array:
    """Covariance with the larger of both deviations and the correlations of the classical one.

    Args:
        rows: Rows with their residuals.
        influence: Derivative of each quantity by each row's current, shape (k, r).
        serial_s: Time after which residuals are unrelated [s].

    Returns:
        Covariance, shape (k, k).
    """
    return with_larger_deviation(classical(rows, influence, serial_s), serial(rows, influence, serial_s))


def with_larger_deviation(covariance: Array, other: Array) -> Array:
    """A covariance with the correlations of the first and the larger of both deviations, shape (k, k)."""
    own = np.diag(covariance)
    factor = np.sqrt(np.maximum(own, np.diag(other)) / np.where(own > 0.0, own, 1.0))
    return covariance * np.outer(factor, factor)
