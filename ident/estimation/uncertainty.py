"""Covariance estimators by name: functions `(rows, influence) -> covariance`.

`rows` have residuals; `influence` is the derivative of k quantities by the current of each row, shape (k, r). The
covariance has shape (k, k).
"""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from scipy.linalg import lapack

from ident.estimation.rows import Rows
from ident.support.arrays import Array, Indices, readonly

BLOCKS = 20
"""Number of time blocks of each motion."""


def jackknife(rows: Rows, influence: Array) -> Array:
    """Return the covariance from estimates without one time block of a motion, of all joints together.

    The fit absorbs part of slow errors, which makes residuals look white; an estimate without a block is independent of
    that block. To first order it differs by the influence of the block's rows times their residuals in a fit without
    them, (1 - H_bb)^-1 e_b with H the hat matrix (Efron and Stein 1981; `docs/derivations.md`).

    Arguments and shape as for all covariance estimators.
    """
    if not len(influence):  # of no joint; there may be no row either
        return np.zeros((0, 0))
    changes = np.array([influence[:, block] @ left for block, left in left_out(rows)])
    apart = changes - changes.mean(axis=0)
    return (len(changes) - 1) / len(changes) * (apart.T @ apart)


@lru_cache(maxsize=1)
def left_out(rows: Rows, blocks: int = BLOCKS) -> tuple[tuple[Indices, Array], ...]:
    """Return the rows of each time block, and their residuals in a fit without the block [drive units].

    Args:
        rows: Rows with residuals; results are cached, as several covariances of an estimate need them.
        blocks: Number of time blocks of each motion.
    """
    found: list[tuple[Indices, Array]] = []
    for motion in np.unique(rows.motion):
        own = np.flatnonzero(rows.motion == motion)
        at = rows.position[own] - rows.position[own].min()
        block_of_row = at * blocks // (at.max() + 1)
        for number in np.unique(block_of_row):
            block = own[block_of_row == number]
            explained, weight = rows.explained[block], rows.weight[block]
            fresh = _not_fitted_to(explained[:, explained.any(axis=0)], weight * rows.residual[block])
            found.append((block, readonly(fresh / weight)))
    return tuple(found)


def _not_fitted_to(Q: Array, e: Array) -> Array:
    """(I - Q Q')^-1 e through the smaller of two matrices: it is e + Q (I - Q'Q)^-1 Q'e (Woodbury's identity)."""
    rows, columns = Q.shape
    if not columns:
        return e
    if rows <= columns:
        return _solved(np.eye(rows) - Q @ Q.T, e)
    return e + Q @ _solved(np.eye(columns) - Q.T @ Q, Q.T @ e)


def _solved(A: Array, b: Array) -> Array:
    """Solve A x = b for a positive definite A, or for one that is singular up to rounding."""
    _, x, failed = lapack.dposv(A, b, lower=True)  # half the work of np.linalg.solve
    return np.asarray(np.linalg.solve(A, b) if failed else x, np.float64)


def classical(rows: Rows, influence: Array) -> Array:
    """Return the covariance for white residuals with one standard deviation per joint (eq. 20), shape (k, k)."""
    sigma = np.empty(len(rows.V))
    for joint in rows.unknowns:
        sigma[rows.of(joint)] = rows.sigma(joint)
    spread = influence * sigma
    return spread @ spread.T  # eq. 20: influence @ influence.T is (W^T W)^-1


def max_of_classical_and_jackknife(rows: Rows, influence: Array) -> Array:
    """Return the covariance with the larger of both standard deviations and the classical correlations."""
    covariance, other = classical(rows, influence), jackknife(rows, influence)
    own = np.diag(covariance)
    factor = np.sqrt(np.maximum(own, np.diag(other)) / np.where(own > 0.0, own, 1.0))
    return covariance * np.outer(factor, factor)


UNCERTAINTIES: dict[str, Callable[[Rows, Array], Array]] = {
    "classical": classical,
    "jackknife": jackknife,
    "cautious": max_of_classical_and_jackknife,
}
"""`classical`: eq. 20, white residuals; `jackknife`: delete-a-block; `cautious`: maximum of both."""
