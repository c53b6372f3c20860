"""The larger of the classical deviation and the jackknife's, quantity by quantity."""

from ident.arrays import Array
from ident.rows import Rows
from ident.uncertainty.classical import classical
from ident.uncertainty.jackknife import jackknife
from ident.uncertainty.larger import grown


def cautious(rows: Rows, influence: Array, serial_s: float) -> Array:
    """Covariance with the larger of both deviations and the correlations of the classical one.

    Args:
        rows: Rows with their residuals.
        influence: Derivative of each quantity by each row's current, shape (k, r).
        serial_s: Without meaning here.

    Returns:
        Covariance, shape (k, k).
    """
    return grown(classical(rows, influence, serial_s), jackknife(rows, influence, serial_s))
