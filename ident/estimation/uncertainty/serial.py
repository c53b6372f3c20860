"""Covariance for residuals correlated in time (Newey and West 1987)."""

import numpy as np

from ident.estimation.rows import Rows
from ident.support.arrays import Array


def serial(rows: Rows, influence: Array, serial_s: float) -> Array:
    """Return the covariance for residuals of a joint that are uncorrelated only after some time.

    Weights decrease linearly to zero over the L row periods of `serial_s` (Bartlett). The sum over lags is then a sum
    of squares of sums over L consecutive rows (`docs/derivations.md`), so the covariance is positive semidefinite.
    Omitted rows count as zero. Arguments as for all covariance estimators; shape (k, k).
    """
    lags = max(1, round(serial_s / rows.row_period))
    covariance = np.zeros((len(influence), len(influence)))
    for run in rows.runs():
        at, share = rows.position[run], influence[:, run] * rows.residual[run]
        felt = np.flatnonzero(share.any(axis=1))
        last = int(at[-1]) + 1
        total = np.zeros((len(felt), last + 1))
        total[:, 1 + at] = share[felt]
        total = np.cumsum(total, axis=1)
        first = np.arange(1 - lags, last)  # of each window of L positions that holds one of the rows
        sums = total[:, np.minimum(first + lags, last)] - total[:, np.maximum(first, 0)]
        covariance[np.ix_(felt, felt)] += sums @ sums.T / lags
    return covariance
