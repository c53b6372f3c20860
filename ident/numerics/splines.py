"""Cubic spline interpolation: twice continuously differentiable, with a cubic polynomial between points.

C. de Boor, A Practical Guide to Splines, 1978, chapter IV: the slopes s at the points x solve the tridiagonal system

    h_i s_(i-1) + 2 (h_(i-1) + h_i) s_i + h_(i-1) s_(i+1) = 3 (h_i d_(i-1) + h_(i-1) d_i)

with h_i = x_(i+1) - x_i and d_i = (y_(i+1) - y_i) / h_i. `scipy.interpolate` has bitwise the same splines, but its
import takes a quarter of a second.
"""

from dataclasses import dataclass
from math import perm

import numpy as np
from scipy import linalg

from ident.support.arrays import Array

BLOCK = 512
"""Number of values computed together, for the processor's cache."""


@dataclass(frozen=True, slots=True, eq=False)
class CubicSpline:
    """A cubic spline.

    Attributes:
        x: Points, shape (m,).
        coefficients: Coefficients of the powers 0 to 3 of the distance from the preceding point, shape (4, m - 1, ...).
    """

    x: Array
    coefficients: Array

    def __call__(self, t: Array, order: int = 0) -> Array:
        """Return values of the spline or of a derivative; the outer polynomials extrapolate.

        Args:
            t: Positions, shape (N,).
            order: Order of the derivative, 0 to 3.

        Returns:
            Shape (N, ...).
        """
        pieces = np.clip(np.searchsorted(self.x, t, side="right") - 1, 0, len(self.x) - 2)
        values = np.zeros((len(t), *self.coefficients.shape[2:]))
        for begin in range(0, len(t), BLOCK):
            block = slice(begin, begin + BLOCK)
            piece = pieces[block]
            distance = (t[block] - self.x[piece]).reshape(-1, *[1] * (values.ndim - 1))
            power = np.ones_like(distance)
            for k in range(order, 4):
                term = self.coefficients[k].take(piece, axis=0)
                if k > order:
                    term *= power
                if order:
                    term *= perm(k, order)
                values[block] += term
                power *= distance
        return values

    def evenly(self, steps: int, samples: int) -> Array:
        """Return values at uniform samples, of which every `steps`-th and the last one are points.

        Args:
            steps: Number of samples per interval; the last interval may have fewer.
            samples: Number of samples N from the first point to the last.

        Returns:
            Values, shape (N, ...).
        """
        h = np.diff(self.x)
        power = (h[0] / steps * np.arange(steps))[:, None] ** np.arange(4)
        values = np.empty((samples, *self.coefficients.shape[2:]))
        between = np.tensordot(power, self.coefficients, axes=1)  # (steps, m - 1, ...)
        for k, each in enumerate(between):
            part = values[k : samples - 1 : steps]
            part[:] = each[: len(part)]
        values[-1] = np.tensordot(h[-1] ** np.arange(4), self.coefficients[:, -1], axes=1)
        return values


def spline(x: Array, y: Array) -> CubicSpline:
    """Return the cubic spline through points with the not-a-knot condition at both ends.

    Args:
        x: Increasing, shape (m,), at least four.
        y: Shape (m, ...).
    """
    h, wide, d, A, b = _inner(x, y)
    for end, next, reach in ((0, 1, x[2] - x[0]), (-1, -2, x[-1] - x[-3])):
        A[1, end], A[0 if end == 0 else 2, next] = h[next], reach
        b[end] = ((wide[end] + 2.0 * reach) * wide[next] * d[end] + wide[end] ** 2 * d[next]) / reach
    return _through(x, y, d, _solved(A, b))


def periodic_spline(x: Array, y: Array) -> CubicSpline:
    """Return the periodic cubic spline through points.

    The system of the slopes has two additional corner entries; without its last row and column it is tridiagonal.

    Args:
        x: Increasing, shape (m,), at least four.
        y: Shape (m, ...), the last value the first.
    """
    h, wide, d, A, b = _inner(x, y)
    A, b = A[:, :-1], b[:-1]
    A[1, 0], A[0, 1] = 2.0 * (h[-1] + h[0]), h[-1]
    b[0] = 3.0 * (wide[0] * d[-1] + wide[-1] * d[0])
    b[-1] = 3.0 * (wide[-1] * d[-2] + wide[-2] * d[-1])
    by_last = np.zeros_like(b[:-1])
    by_last[0], by_last[-1] = -h[0], -h[-3]
    first, change = _solved(A[:, :-1], b[:-1]), _solved(A[:, :-1], by_last)
    last = (b[-1] - h[-2] * first[0] - h[-1] * first[-1]) / (
        2.0 * (h[-1] + h[-2]) + h[-2] * change[0] + h[-1] * change[-1]
    )
    slopes = first + last * change
    return _through(x, y, d, np.concatenate((slopes, last[None], slopes[:1])))


def _inner(x: Array, y: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Return h, h in the shape of y, d, and the tridiagonal system of the slopes without end conditions."""
    h = np.diff(x)
    wide = h.reshape(-1, *[1] * (y.ndim - 1))
    d = np.diff(y, axis=0) / wide
    A, b = np.zeros((3, len(x))), np.zeros_like(y)
    A[0, 2:], A[1, 1:-1], A[2, :-2] = h[:-1], 2.0 * (h[:-1] + h[1:]), h[1:]
    b[1:-1] = 3.0 * (wide[1:] * d[:-1] + wide[:-1] * d[1:])
    return h, wide, d, A, b


def _solved(A: Array, b: Array) -> Array:
    """Return the solution of a tridiagonal system, in the shape of b."""
    return linalg.solve_banded((1, 1), A, b.reshape(len(b), -1), check_finite=False).reshape(b.shape)


def _through(x: Array, y: Array, d: Array, s: Array) -> CubicSpline:
    """Return the spline with slopes s; d are the slopes of the chords."""
    h = np.diff(x).reshape(-1, *[1] * (y.ndim - 1))
    bend = (s[:-1] + s[1:] - 2.0 * d) / h
    return CubicSpline(x, np.stack((y[:-1], s[:-1], (d - s[:-1]) / h - bend, bend / h)))
