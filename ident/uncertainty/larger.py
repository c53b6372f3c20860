"""The larger of the classical and the serial deviation, quantity by quantity."""

import numpy as np

from ident.arrays import Array
from ident.rows import Rows
from ident.uncertainty.classical import classical
from ident.uncertainty.serial import serial


def larger(rows: Rows, influence: Array, serial_s: float) -> Array:
    """Covariance with the larger of both deviations and the correlations of the classical one.

    Args:
        rows: Rows with their residuals.
        influence: Derivative of each quantity by each row's current, shape (k, r).
        serial_s: Time after which residuals are unrelated [s].

    Returns:
        Covariance, shape (k, k).
    """
    white = classical(rows, influence, serial_s)
    slow = np.diag(serial(rows, influence, serial_s))
    own = np.diag(white)
    grown = np.sqrt(np.maximum(own, slow) / np.where(own > 0.0, own, 1.0))
    return white * np.outer(grown, grown)
