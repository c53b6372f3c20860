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
    """A motion without most of the encoder's noise.

    Attributes:
        q: Joint positions [rad or m], shape (N, n).
        dq: Joint velocities, shape (N, n).
        ddq: Joint accelerations, shape (N, n).
        kept: Share of the variance of position noise that each joint's fit retains: number of coefficients over that of
            independent samples, shape (n,).
        left: Root mean square of the residual of each joint's fit to the filtered positions, shape (n,).
    """

    q: Array
    dq: Array
    ddq: Array
    kept: Array
    left: Array


def reference(behind: FullRate) -> Reference:
    """Fit the positions of a motion; each joint has the number of knots with the smallest BIC (Schwarz 1978).

    Positions that are filtered at f have 2 f T independent samples in a time T.
    """
    samples = len(behind.q)
    t = np.asarray(behind.period * np.arange(samples), np.float64)
    at = np.arange(0, samples, max(1, int(1.0 / (SAMPLES * behind.cutoff_hz * behind.period))))
    independent = 2.0 * behind.cutoff_hz * float(t[-1])
    fits = [_Fit.of(t[at], behind.q[at], number) for number in _numbers(independent)]
    cost = np.array([independent * np.log(each.squares) + each.size * np.log(independent) for each in fits])
    best = [fits[k] for k in np.argmin(cost, axis=0).tolist()]
    q, dq, ddq = (np.column_stack([each.spline(t, order)[:, j] for j, each in enumerate(best)]) for order in range(3))
    return Reference(
        q=q,
        dq=dq,
        ddq=ddq,
        kept=np.array([each.size / independent for each in best]),
        left=np.sqrt([each.squares[j] for j, each in enumerate(best)]),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    """A spline of all joints' positions, its number of coefficients per joint, and its mean squares of residuals."""

    spline: "scipy.interpolate.BSpline"
    size: int
    squares: Array

    @classmethod
    def of(cls, t: Array, q: Array, pieces: int) -> "_Fit":
        """Fit a spline of equal pieces by least squares."""
        inner = np.linspace(t[0], t[-1], pieces + 1)
        knots = np.concatenate(([t[0]] * DEGREE, inner, [t[-1]] * DEGREE))
        spline = scipy.interpolate.make_lsq_spline(t, q, knots, k=DEGREE)
        squares = np.mean((q - spline(t)) ** 2, axis=0)
        return cls(spline, pieces + DEGREE, np.maximum(squares, np.finfo(np.float64).tiny))


def _numbers(independent: float) -> list[int]:
    """Numbers of pieces to try."""
    most = max(1.0, MOST * independent - DEGREE)
    steps = int(np.log(most) / np.log(FINER)) + 1
    return sorted({int(most / FINER**k) for k in range(steps)})
