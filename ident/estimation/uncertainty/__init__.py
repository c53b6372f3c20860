"""Covariance estimators by name: functions `(rows, influence, serial_s) -> covariance`.

`rows` have residuals; `influence` is the derivative of k quantities by the current of each row, shape (k, r);
`serial_s` is the time after which residuals are uncorrelated [s], which some functions ignore. The covariance has shape
(k, k).
"""

from collections.abc import Callable

from ident.estimation.rows import Rows
from ident.estimation.uncertainty.classical import classical
from ident.estimation.uncertainty.jackknife import jackknife
from ident.estimation.uncertainty.larger import max_of_classical_and_hac, max_of_classical_and_jackknife
from ident.estimation.uncertainty.serial import serial
from ident.support.arrays import Array

UNCERTAINTIES: dict[str, Callable[[Rows, Array, float], Array]] = {
    "larger": max_of_classical_and_hac,
    "classical": classical,
    "serial": serial,
    "jackknife": jackknife,
    "cautious": max_of_classical_and_jackknife,
}
"""`classical`: eq. 20, white residuals; `serial`: autocorrelated residuals (Newey and West); `larger`: maximum of these
two; `jackknife`: delete-a-block; `cautious`: maximum of `classical` and `jackknife`."""
