"""Uncertainty of what was found from rows: a function `(rows, influence, serial_s) -> covariance`, by name.

`influence` is the derivative of k quantities by the current of each row, shape (k, r); the covariance has shape (k, k).
"""

from collections.abc import Callable

from ident.arrays import Array
from ident.rows import Rows
from ident.uncertainty.cautious import cautious
from ident.uncertainty.classical import classical
from ident.uncertainty.jackknife import jackknife
from ident.uncertainty.larger import larger
from ident.uncertainty.serial import serial

UNCERTAINTIES: dict[str, Callable[[Rows, Array, float], Array]] = {
    "larger": larger,
    "classical": classical,
    "serial": serial,
    "jackknife": jackknife,
    "cautious": cautious,
}
"""`classical`: eq. 20; `serial`: residuals correlated in time; `larger`: of these two; `jackknife`: a stretch of time
left out; `cautious`: the larger of `classical` and `jackknife`."""
