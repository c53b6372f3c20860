"""The larger of the classical deviation and the jackknife's, quantity by quantity."""

from ident.estimation.rows import Rows
from ident.estimation.uncertainty.classical import classical
from ident.estimation.uncertainty.jackknife import jackknife
from ident.estimation.uncertainty.max_of_classical_and_hac import with_larger_deviation
from ident.support.arrays import Array


def max_of_classical_and_jackknife(rows: Rows, influence: Array, serial_s: float) -> Array:
    """Covariance with the larger of both deviations and the correlations of the classical one.

    Args:
        rows: Rows with their residuals.
        influence: Derivative of each quantity by each row's current, shape (k, r).
        serial_s: Without meaning here.

    Returns:
        Covariance, shape (k, k).
    """
    return with_larger_deviation(classical(rows, influence, serial_s), jackknife(rows, influence, serial_s))
