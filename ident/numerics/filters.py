"""Recursive filters in second-order sections, causal and zero-phase, and the Butterworth low-pass.

A section maps x to y by

    y_k + a_1 y_(k-1) + a_2 y_(k-2) = b_0 x_k + b_1 x_(k-1) + b_2 x_(k-2)

from rest: a unit lower triangular system with three diagonals in y, solved by LAPACK. `scipy.signal` has the same
filters, but its import takes a second.
"""

from functools import reduce

import numpy as np
from scipy.linalg import lapack

from ident.support.arrays import Array


def butterworth(order: int, cutoff_hz: float, rate_hz: float) -> Array:
    """Return a Butterworth low-pass of even order by the bilinear transform, prewarped, shape (order / 2, 6).

    A. V. Oppenheim and R. W. Schafer, Discrete-Time Signal Processing, 3rd ed. 2010, sections 7.2 and B.1: the pairs
    of poles of 1 / (s^2 + 2 sin((2 k + 1) pi / (2 order)) s + 1) with s = (z - 1) / (z + 1) / tan(pi cutoff / rate).
    Sections (b_0, b_1, b_2, 1, a_1, a_2) have unit gain at zero frequency, the least damped is last.
    """
    K = np.tan(np.pi * cutoff_hz / rate_hz)
    damping = 2.0 * np.sin(np.pi * np.arange(order - 1, 0, -2) / (2 * order))
    one, K2 = np.ones_like(damping), K**2
    whole = 1.0 + damping * K + K2
    b = K2 / whole
    return np.column_stack((b, 2.0 * b, b, one, 2.0 * (K2 - 1.0) / whole, (1.0 - damping * K + K2) / whole))


def filtered(sections: Array, x: Array) -> Array:
    """Filter signals, shape (N, k), with a cascade of sections, shape (s, 6), initially at rest."""
    numerator = reduce(np.convolve, sections[:, :3])
    y = np.array([np.convolve(each, numerator)[: len(x)] for each in x.T]).T  # each signal is contiguous
    band = np.ones((3, len(x)), order="F")  # the diagonal and the two below it
    for a1, a2 in sections[:, 4:].tolist():
        band[1], band[2] = a1, a2
        y = lapack.dtbtrs(band, y, uplo="L", diag="U", overwrite_b=True)[0]
    return y


def filtered_both_ways(sections: Array, x: Array, padding: int) -> Array:
    """Filter signals, shape (N, k), forward and backward (zero phase) with a cascade of unit gain at zero frequency.

    Both ends are extended by odd reflection, by `padding` samples, fewer than N, and each pass starts in the steady
    state of the first value (F. Gustafsson, IEEE Trans. Signal Processing 44(4), 1996, calls this the usual choice).
    """
    before, after = 2.0 * x[0] - x[padding:0:-1], 2.0 * x[-1] - x[-2 : -padding - 2 : -1]
    y = np.concatenate((before, x, after))
    for _ in range(2):
        y = (filtered(sections, y - y[0]) + y[0])[::-1]
    return y[padding : padding + len(x)]
