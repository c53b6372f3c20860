"""Logarithmic gains by damped Newton steps on the sum of squares, minimised over the shared parameters.

At gains h the shared parameters follow by linear least squares from B = [h_1 A_1; h_2 A_2; ..; priors]. A step needs no
factorisation of B: in coordinates z in which the columns are orthonormal at similar gains (theta = R^-1 z), B'B = sum
over joints of h_j^2 Z_j'Z_j is close to the identity, so its Cholesky factor is as accurate as a QR factor of B.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from scipy import linalg
from scipy.linalg import lapack

from ident.estimation.all_joints.reduction import ReducedJoint
from ident.numerics.least_squares import factors
from ident.support.arrays import Array, Indices
from ident.support.errors import NotIdentifiable

SMALLEST_STEP = 1e-11
"""Largest change of a logarithm at convergence."""
LONGEST_STEP = 0.5
"""Largest norm of the change of the logarithms in one step."""
MOST_STEPS = 200
POOR, GOOD = 0.25, 0.75
"""Ratios of actual to predicted decrease below which damping increases, and above which it decreases."""
SLOWER, FASTER = 4.0, 1.0 / 6.0
UNDAMPED, DAMPED = 1e-9, 1e-3
"""Initial and smallest damping, so that a free scale is not singular; damping after the first failed step."""
FAR = 3.0
"""Largest difference between joints in the change of log|h| up to which columns count as orthonormal: the condition
number of B'B is then at most e^6, a loss of three of sixteen digits."""
RANK_TOL = 1e-10
"""Relative norm of the new part of a unit column below which a shared parameter is not identifiable."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Prior:
    """Independent priors of log|h| and of shared parameters.

    The gain of an unloaded joint would diverge; a wide prior prevents this without an effect on the others.

    Attributes:
        mean: Prior means of log|h|, shape (n,).
        std: Their prior standard deviations, shape (n,).
        shared: Prior standard deviations of shared parameters about zero, infinite without a prior, shape (p,).
    """

    mean: Array
    std: Array
    shared: Array

    def off(self, s: Array) -> Array:
        """Differences of logarithms from their prior means, in standard deviations, shape (n,)."""
        return (s - self.mean) / self.std

    @cached_property
    def rows(self) -> Array:
        """Rows of the priors of shared parameters, in standard deviations, shape (beliefs, p)."""
        believed = np.flatnonzero(np.isfinite(self.shared))
        rows = np.zeros((len(believed), len(self.shared)))
        rows[np.arange(len(believed)), believed] = 1.0 / self.shared[believed]
        return rows


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """Result of the search.

    Attributes:
        h: 1/g with its sign, shape (n,).
        theta: Shared parameters, zero if not identifiable, shape (p,).
        cost: Sum of squares of the weighted residual and the prior.
        steps: Number of steps.
    """

    h: Array
    theta: Array
    cost: float
    steps: int


@dataclass(frozen=True, slots=True, eq=False)
class _Rows:
    """Rows of all joints in which own columns are zero, with orthonormal shared columns; joints are padded with zeros.

    Attributes:
        h: Values of 1/g at which the columns are orthonormal, shape (n,).
        Z: Shared columns of each joint, shape (n, m, k).
        k: Known torque, shape (n, m).
        V: Currents, shape (n, m).
        beliefs: Rows of the priors of shared parameters, shape (beliefs, k).
        gram: Z'Z of each joint, shape (n, k, k).
        gram_of_beliefs: The same for the priors, shape (k, k).
        columns: Indices of the independent shared parameters, shape (k,).
        R: Upper triangular factor, z = R theta, shape (k, k).
        count: Number of shared parameters.
    """

    h: Array
    Z: Array
    k: Array
    V: Array
    beliefs: Array
    gram: Array
    gram_of_beliefs: Array
    columns: Indices
    R: Array
    count: int

    def near(self, h: Array) -> bool:
        """Whether the columns are also nearly orthonormal at other gains."""
        return float(np.ptp(np.log(h / self.h))) < FAR

    def theta(self, z: Array) -> Array:
        """Shared parameters, zero if not identifiable, shape (count,)."""
        theta = np.zeros(self.count)
        theta[self.columns] = linalg.solve_triangular(self.R, z, check_finite=False)
        return theta

    def onto(self, x: Array) -> Array:
        """Products Z'x of each joint's columns with x, shape (n, m): shape (n, k)."""
        return (x[:, None] @ self.Z)[:, 0]


def _rows_of(joints: Sequence[ReducedJoint], h: Array, beliefs: Array) -> _Rows:
    """Return the rows, with columns that are orthonormal at gains 1/h."""
    B = np.vstack([*(hj * each.A[each.inner] for hj, each in zip(h, joints, strict=True)), beliefs])
    found = factors(B, rank_tol=RANK_TOL)
    sizes = [len(each.V[each.inner]) for each in joints]
    Z, last = np.zeros((len(joints), max(sizes), len(found.columns))), sum(sizes)
    k, V = np.zeros((2, *Z.shape[:2]))
    for j, (each, part) in enumerate(zip(joints, np.split(found.Q[:last], np.cumsum(sizes)[:-1]), strict=True)):
        Z[j, : sizes[j]] = part / h[j]
        k[j, : sizes[j]] = each.k[each.inner]
        V[j, : sizes[j]] = each.V[each.inner]
    Zb = found.Q[last:]
    return _Rows(
        h=h, Z=Z, k=k, V=V, beliefs=Zb, gram=Z.swapaxes(1, 2) @ Z, gram_of_beliefs=Zb.T @ Zb,
        columns=found.columns, R=found.R, count=B.shape[1],
    )  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class _Point:
    """The model at given gains.

    Attributes:
        rows: The rows that it was evaluated on.
        h: 1/g, shape (n,).
        z: Shared parameters, as coordinates, shape (k,).
        T: Part of each joint's currents that is proportional to h, shape (n, m).
        r: Residual of these rows, shape (n, m).
        factor: Cholesky factor of B'B, lower, shape (k, k).
        cost: Sum of squares of the residual and the priors.
    """

    rows: _Rows
    h: Array
    z: Array
    T: Array
    r: Array
    factor: Array
    cost: float


def search(joints: Sequence[ReducedJoint], start: Array, prior: Prior) -> Found:
    """Find the gains that minimise the sum of squares over all joints.

    Args:
        joints: Reduced rows of each of the n joints.
        start: Initial values of 1/g with correct signs, shape (n,).
        prior: Prior of log|h|.

    Raises:
        NotIdentifiable: If the search does not converge.
    """
    sign: Array = np.sign(start)
    s: Array = np.log(np.abs(start))
    damping = UNDAMPED
    point = _point(_rows_of(joints, start, prior.rows), start, prior.off(s))
    for steps in range(MOST_STEPS):
        normal = _curvature(point, prior)
        gradient = np.sum(point.T * point.r, axis=1) - prior.off(s) / prior.std
        while True:
            step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), gradient)
            length = float(np.linalg.norm(step))
            step *= min(1.0, LONGEST_STEP / max(length, 1e-300))
            if length < SMALLEST_STEP:
                return Found(h=point.h, theta=point.rows.theta(point.z), cost=point.cost, steps=steps)
            h: Array = sign * np.exp(s + step)
            rows = point.rows if point.rows.near(h) else _rows_of(joints, h, prior.rows)
            tried = _point(rows, h, prior.off(s + step))
            if tried.cost <= point.cost:
                break
            damping = max(8.0 * damping, DAMPED)
        kept = (point.cost - tried.cost) / max(float(gradient @ step), 1e-300)  # ratio of actual to predicted decrease
        damping = max(UNDAMPED, damping * (SLOWER if kept < POOR else FASTER if kept > GOOD else 1.0))
        s, point = s + step, tried
    raise NotIdentifiable(f"the gains do not converge in {MOST_STEPS} steps; record longer, or with a heavier payload")


def _curvature(point: _Point, prior: Prior) -> Array:
    """Second derivative of half the cost by the logarithms, shape (n, n).

    With T and R the currents proportional to h and the residuals, joint by joint, and Q the basis of the shared
    columns, it is T'(T - R) - (T - R)' Q Q' (T - R) plus that of the prior. If it is not positive definite, far from
    the minimum, R is omitted (Gauss and Newton); for an unloaded joint only the prior may make it positive definite.
    """

    def left(one: Array, other: Array) -> Array:
        along = _lower_solved(point.factor, point.h * point.rows.onto(other).T)  # Q'(..), (k, n)
        return np.diag(np.sum(one * other, axis=1)) - along.T @ along + np.diag(prior.std**-2)

    exact = left(point.T, point.T - point.r)
    return exact if np.linalg.eigvalsh(exact)[0] > 0.0 else left(point.T, point.T)


def _point(rows: _Rows, h: Array, off: Array) -> _Point:
    """Return the model at gains 1/h, whose logarithms differ from their priors by `off` standard deviations."""
    gram = np.tensordot(h**2, rows.gram, 1) + rows.gram_of_beliefs
    factor = np.asarray(np.linalg.cholesky(gram), np.float64)
    z, r, left = np.zeros(rows.Z.shape[2]), rows.V - h[:, None] * rows.k, np.zeros(len(rows.beliefs))
    for _ in range(2):  # the second pass removes rounding errors of the residual
        more = h @ rows.onto(r) + left @ rows.beliefs
        more = _lower_solved(factor, _lower_solved(factor, more), trans=1)
        z = z + more
        r = r - h[:, None] * (rows.Z @ more)
        left = left - rows.beliefs @ more
    cost = float(np.sum(r**2) + left @ left + off @ off)
    return _Point(rows=rows, h=h, z=z, T=rows.V - r, r=r, factor=factor, cost=cost)


def _lower_solved(L: Array, x: Array, trans: Literal[0, 1] = 0) -> Array:
    return np.asarray(lapack.dtrtrs(L, x, lower=1, trans=trans)[0], np.float64)  # a fifth of solve_triangular's time
