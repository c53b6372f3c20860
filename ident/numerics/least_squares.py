"""Linear least squares with scaled columns by orthogonal factorisation (paper, eq. 17 to 22), and column spaces."""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from ident.support.arrays import Array, Indices, readonly
from ident.support.errors import NotIdentifiable

DEPENDENT = 1e-9
"""Relative singular value of unit columns below which a combination is unobservable in a group of rows."""
NEW = 1e-6
"""Singular value of unit columns below which they are linearly dependent."""


@dataclass(frozen=True, slots=True, eq=False)
class LeastSquares:
    """Solution of `Y = W @ x + rho`."""

    x: Array  # solution, shape (b,)
    cofactor: Array  # (W^T W)^-1, shape (b, b)
    sigma: float  # standard deviation of the residual (eq. 19)
    residual: Array  # rho = Y - W @ x, shape (r,)
    basis: Array  # orthonormal basis of the columns of W, shape (r, b)

    @property
    def covariance(self) -> Array:
        """Covariance of x for white residuals (eq. 20), shape (b, b)."""
        return self.sigma**2 * self.cofactor

    @property
    def std(self) -> Array:
        """Standard deviations of x, shape (b,)."""
        return np.sqrt(np.diag(self.covariance))


def least_squares(W: Array, Y: Array, *, rank_tol: float) -> LeastSquares:
    """Solve `Y = W @ x`, W of shape (r, b), r > b, in the least squares sense (paper, eq. 17, 19 and 20).

    Columns are scaled to unit norm before the factorisation, so the rank does not depend on units. Raises
    `NotIdentifiable` if there are too few rows, a column is zero, or a relative singular value of the scaled W is below
    `rank_tol`.
    """
    r, b = W.shape
    if r <= b:
        raise NotIdentifiable.too_few_rows(r, b)
    scale = np.linalg.norm(W, axis=0)
    if not scale.all():
        column = int(np.argmin(scale))
        raise NotIdentifiable(
            f"the motion does not excite every parameter: column {column} of the observation matrix is zero"
        )
    Q, R = linalg.qr(W / scale, mode="economic")
    singular = np.linalg.svd(R, compute_uv=False)
    if singular[-1] < rank_tol * singular[0]:
        raise NotIdentifiable(
            f"the motion does not excite every parameter: relative singular value {singular[-1] / singular[0]:.1e} "
            f"is below {rank_tol:.0e}"
        )
    inverse = linalg.solve_triangular(R, np.eye(b)) / scale[:, None]  # (b, b), inverse @ inverse.T = cofactor
    x = inverse @ (Q.T @ Y)
    residual = Y - W @ x
    sigma = float(np.linalg.norm(residual) / np.sqrt(r - b))  # eq. 19
    return LeastSquares(x, inverse @ inverse.T, sigma, residual, np.asarray(Q, np.float64))


@dataclass(frozen=True, slots=True, eq=False)
class Factors:
    """`W[:, columns] = Q @ R`, the columns independent of each other and all others combinations of them."""

    columns: Indices  # indices of the columns, shape (k,)
    Q: Array  # orthonormal, shape (r, k)
    R: Array  # upper triangular, shape (k, k)


def factors(W: Array, *, rank_tol: float) -> Factors:
    """Factorise a matrix (r, b) with possibly dependent or zero columns (pivoted QR of unit columns).

    `rank_tol` is the smallest norm of the independent part of a unit column, relative to the largest.
    """
    norms = np.linalg.norm(W, axis=0)
    seen = np.flatnonzero(norms > 0.0)
    Q, R, pivots = linalg.qr(W[:, seen] / norms[seen], mode="economic", pivoting=True, check_finite=False)
    size = np.abs(np.diag(R))
    rank = int(np.sum(size > rank_tol * size[0])) if len(size) else 0
    columns = seen[pivots[:rank]]
    return Factors(
        columns, np.asarray(Q[:, :rank], np.float64), np.asarray(R[:rank, :rank] * norms[columns], np.float64)
    )


def row_weights(W: Array, Y: Array, groups: Indices) -> Array:
    """Return the inverse of the residual's standard deviation of each row's group, shape (r,) (paper, eq. 22).

    Observation matrix (r, b), measurements (r,), and the group of each row, one per joint, (r,).
    """
    weight = np.empty(len(Y))
    for group in np.unique(groups):
        rows = groups == group
        norms = np.linalg.norm(W[rows], axis=0)
        own = W[rows][:, norms > 0.0] / norms[norms > 0.0]
        x, _, rank, _ = linalg.lstsq(own, Y[rows], cond=DEPENDENT)  # a single joint does not depend on every column
        residual = Y[rows] - own @ x
        weight[rows] = np.sqrt(rows.sum() - rank) / np.linalg.norm(residual)
    return weight


def column_space(columns: Array) -> Array:
    """Return an orthonormal basis, shape (r, rank), of the span of columns, shape (r, k), of whatever norms."""
    return readonly(factors(columns, rank_tol=NEW).Q)
