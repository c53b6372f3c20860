"""The smooth motion that a recording is an echo of: a spline of fifth degree with as few knots as data ask for.

Encoder noise has all frequencies up to the cut-off of the positions, a motion only low ones: of the noise, a fit with
few knots keeps a small share, and of the noise of velocity and acceleration a smaller one.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from ident.observation.full_rate import FullRate
from ident.support.arrays import Array

DEGREE = 5
"""Of the spline: accelerations of a third degree between knots."""
SAMPLES = 4.0
"""Samples that are fitted to, in cut-offs of the positions: two hold all they have, the rest is for their edge."""
MOST = 0.5
"""Largest share of the independent samples that coefficients may take."""
FINER = 1.15
"""Ratio of numbers of knots that are tried."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reference:
    """A motion without most of the encoder's noise.

    Attributes:
        q: Joint positions [rad or m], shape (N, n).
        dq: Joint velocities, shape (N, n).
        ddq: Joint accelerations, shape (N, n).
        kept: Share of the variance of the filtered positions' noise that each joint's fit keeps: its coefficients over
            the independent samples, shape (n,).
        left: Root mean square of what each joint's fit leaves of the filtered positions, shape (n,).
    """

    q: Array
    dq: Array
    ddq: Array
    kept: Array
    left: Array


def reference(behind: FullRate) -> Reference:
    """Fit the positions of a motion, each joint with the knots of least Bayesian information criterion (Schwarz 1978).

    Positions that are filtered at f have 2 f T samples that are independent of each other in a time T.

    Args:
        behind: Filtered samples of a motion.
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
    """A spline through all joints' positions, its coefficients a joint, and the mean squares it leaves, shape (n,)."""

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
