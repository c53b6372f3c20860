"""Maximum of the classical standard deviation and one that accounts for autocorrelation, for each quantity.

The correlations are those of the classical covariance; arguments and shapes as for all covariance estimators.
"""

import numpy as np

from ident.estimation.rows import Rows
from ident.estimation.uncertainty.classical import classical
from ident.estimation.uncertainty.jackknife import jackknife
from ident.estimation.uncertainty.serial import serial
from ident.support.arrays import Array


def max_of_classical_and_hac(rows: Rows, influence: Array, serial_s: float) -> Array:
    """Return the covariance with the larger of classical and serial standard deviations, shape (k, k)."""
    return _with_larger_deviation(classical(rows, influence, serial_s), serial(rows, influence, serial_s))


def max_of_classical_and_jackknife(rows: Rows, influence: Array, serial_s: float) -> Array:
    """Return the covariance with the larger of classical and jackknife standard deviations, shape (k, k)."""
    return _with_larger_deviation(classical(rows, influence, serial_s), jackknife(rows, influence, serial_s))


def _with_larger_deviation(covariance: Array, other: Array) -> Array:
    own = np.diag(covariance)
    factor = np.sqrt(np.maximum(own, np.diag(other)) / np.where(own > 0.0, own, 1.0))
    return covariance * np.outer(factor, factor)
