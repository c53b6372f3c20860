"""Uncertainty of what was found from rows: a function `(rows, influence, serial_s) -> covariance`, by name.

`influence` is the derivative of k quantities by the current of each row, shape (k, r); the covariance has shape (k, k).
"""

from collections.abc import Callable

from ident.estimation.rows import Rows
from ident.estimation.uncertainty.cautious import cautious
from ident.estimation.uncertainty.classical import classical
from ident.estimation.uncertainty.jackknife import jackknife
from ident.estimation.uncertainty.larger import larger
from ident.estimation.uncertainty.serial import serial
from ident.support.arrays import Array

UNCERTAINTIES: dict[str, Callable[[Rows, Array, float], Array]] = {
    "larger": larger,
    "classical": classical,
    "serial": serial,
    "jackknife": jackknife,
    "cautious": cautious,
}
"""`classical`: eq. 20; `serial`: residuals correlated in time; `larger`: of these two; `jackknife`: a stretch of time
left out; `cautious`: the larger of `classical` and `jackknife`."""
