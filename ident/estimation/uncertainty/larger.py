"""The larger of the classical deviation and one that allows for autocorrelated residuals, quantity by quantity.

The correlations are those of the classical covariance; arguments and shapes are those of every uncertainty.
"""

import numpy as np

from ident.estimation.rows import Rows
from ident.estimation.uncertainty.classical import classical
from ident.estimation.uncertainty.jackknife import jackknife
from ident.estimation.uncertainty.serial import serial
from ident.support.arrays import Array


def max_of_classical_and_hac(rows: Rows, influence: Array, serial_s: float) -> Array:
    """Covariance with the larger of the classical and the serial deviations, shape (k, k)."""
    return _with_larger_deviation(classical(rows, influence, serial_s), serial(rows, influence, serial_s))


def max_of_classical_and_jackknife(rows: Rows, influence: Array, serial_s: float) -> Array:
    """Covariance with the larger of the classical deviation and the jackknife's, shape (k, k)."""
    return _with_larger_deviation(classical(rows, influence, serial_s), jackknife(rows, influence, serial_s))


def _with_larger_deviation(covariance: Array, other: Array) -> Array:
    own = np.diag(covariance)
    factor = np.sqrt(np.maximum(own, np.diag(other)) / np.where(own > 0.0, own, 1.0))
    return covariance * np.outer(factor, factor)
