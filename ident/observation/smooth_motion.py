"""The smooth motion of a recording: a quintic spline with as few knots as the data require.

Encoder noise has all frequencies up to the position cut-off, a motion only low ones: a fit with few knots retains a
small share of the noise, and a smaller one of the noise of velocity and acceleration.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from ident.observation.full_rate import FullRate
from ident.support.arrays import Array

DEGREE = 5
"""Degree of the spline: accelerations are cubic between knots."""
SAMPLES = 4.0
"""Rate of the fitted samples, in multiples of the position cut-off: two contain all information; the rest allows for
the filter's transition band."""
MOST = 0.5
"""Largest share of the independent samples that coefficients may take."""
FINER = 1.15
"""Ratio of successive numbers of knots that are tried."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reference:
    """A motion without most of the encoder's noise."""

    q: Array  # joint positions [rad or m], shape (N, n)
    dq: Array  # joint velocities, shape (N, n)
    ddq: Array  # joint accelerations, shape (N, n)
    kept: Array  # share of the variance of position noise that each joint's fit retains, shape (n,)
    left: Array  # root mean square of the residual of each joint's fit to the filtered positions, shape (n,)


def reference(behind: FullRate) -> Reference:
    """Fit the positions of a motion; each joint has the number of knots with the smallest BIC (Schwarz 1978).

    Positions that are filtered at f have 2 f T independent samples in a time T.
    """
    samples = len(behind.q)
    t = np.asarray(behind.period * np.arange(samples), np.float64)
    at = np.arange(0, samples, max(1, int(1.0 / (SAMPLES * behind.cutoff_hz * behind.period))))
    independent = 2.0 * behind.cutoff_hz * float(t[-1])
    most = max(1.0, MOST * independent - DEGREE)
    numbers = sorted({int(most / FINER**k) for k in range(int(np.log(most) / np.log(FINER)) + 1)})
    splines, squares = list["scipy.interpolate.BSpline"](), list[Array]()
    for pieces in numbers:
        inner = np.linspace(t[0], t[at[-1]], pieces + 1)
        knots = np.concatenate(([inner[0]] * DEGREE, inner, [inner[-1]] * DEGREE))
        splines.append(scipy.interpolate.make_lsq_spline(t[at], behind.q[at], knots, k=DEGREE))
        off = np.mean((behind.q[at] - splines[-1](t[at])) ** 2, axis=0)
        squares.append(np.maximum(off, np.finfo(np.float64).tiny))
    sizes = np.array(numbers) + DEGREE
    best = np.argmin(independent * np.log(squares) + sizes[:, None] * np.log(independent), axis=0).tolist()
    q, dq, ddq = (np.column_stack([splines[k](t, order)[:, j] for j, k in enumerate(best)]) for order in range(3))
    left = np.sqrt([squares[k][j] for j, k in enumerate(best)])
    return Reference(q=q, dq=dq, ddq=ddq, kept=sizes[best] / independent, left=left)
