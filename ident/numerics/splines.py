"""Cubic interpolating splines, as SciPy's `CubicSpline` has them, whose import takes a quarter of a second.

Slopes at the knots make the second derivative continuous; the first two pieces are one polynomial, and so are the last
two ("not a knot", C. de Boor, A Practical Guide to Splines, 2001, chapter IV).
"""

from dataclasses import dataclass
from math import perm

import numpy as np
from scipy import linalg

from ident.support.arrays import Array


@dataclass(frozen=True, slots=True, eq=False)
class CubicSpline:
    """Piecewise cubic functions of one variable."""

    knots: Array  # increasing, shape (K,), K > 3
    coefficients: Array  # of powers 0 to 3 of the distance to the knot before, shape (4, K - 1, ...)

    @classmethod
    def through(cls, knots: Array, y: Array) -> "CubicSpline":
        """Return the splines with values y at the knots, shape (K, ...)."""
        slope, width = slopes(knots, y), np.diff(knots).reshape(-1, *[1] * (y.ndim - 1))
        mean = np.diff(y, axis=0) / width
        excess = (slope[:-1] + slope[1:] - 2.0 * mean) / width
        return cls(knots, np.stack((y[:-1], slope[:-1], (mean - slope[:-1]) / width - excess, excess / width)))

    def __call__(self, x: Array, order: int = 0) -> Array:
        """Return values or derivatives at x, shape (N,); those beyond the knots extrapolate. Shape (N, ...)."""
        piece = np.clip(np.searchsorted(self.knots, x, side="right") - 1, 0, len(self.knots) - 2)
        along = (x - self.knots[piece]).reshape(-1, *[1] * (self.coefficients.ndim - 2))
        total = np.zeros((len(x), *self.coefficients.shape[2:]))
        for power in range(3, order - 1, -1):
            total *= along
            total += perm(power, order) * self.coefficients[power][piece]
        return total


def slopes(knots: Array, y: Array) -> Array:
    """Return the slopes at the knots (K,) of the splines with values y, shape (K, ...)."""
    h = np.diff(knots)  # (K - 1,)
    width = h.reshape(-1, *[1] * (y.ndim - 1))
    mean = np.diff(y, axis=0) / width
    bands, right = np.zeros((3, len(knots))), np.zeros_like(y)
    bands[1, 1:-1], bands[0, 2:], bands[2, :-2] = 2.0 * (h[:-1] + h[1:]), h[:-1], h[1:]
    right[1:-1] = 3.0 * (width[1:] * mean[:-1] + width[:-1] * mean[1:])
    for end, first, second in ((0, 0, 1), (-1, -1, -2)):
        both = h[first] + h[second]
        bands[1, end], bands[0 if end == 0 else 2, 1 if end == 0 else -2] = h[second], both
        right[end] = (h[first] + 2.0 * both) * h[second] * mean[first] + h[first] ** 2 * mean[second]
        right[end] /= both
    return linalg.solve_banded((1, 1), bands, right.reshape(len(y), -1)).reshape(y.shape)
