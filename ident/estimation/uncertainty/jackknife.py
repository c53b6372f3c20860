"""Covariance from what every stretch of time, left out, would change (delete-a-block jackknife)."""

from functools import lru_cache

import numpy as np

from ident.estimation.rows import Rows
from ident.support.arrays import Array, Indices, readonly

BLOCKS = 20
"""Stretches that each motion is cut into."""


def jackknife(rows: Rows, influence: Array, serial_s: float) -> Array:
    """Covariance from the estimates that leave out one stretch of a motion, all joints together.

    The unknowns bend towards slow errors and so make residuals look white; an estimate without a stretch does not know
    that stretch. To first order it differs by the influence of its rows times the residual that they have when they are
    not fitted to, (1 - H_bb)^-1 e_b with H the hat matrix (Efron and Stein 1981; `docs/derivations.md`).

    Arguments are those of every uncertainty, of which `serial_s` is without meaning; shape (k, k).
    """
    changes = np.array([influence[:, block] @ left for block, left in left_out(rows)])
    apart = changes - changes.mean(axis=0)
    return (len(changes) - 1) / len(changes) * (apart.T @ apart)


@lru_cache(maxsize=1)
def left_out(rows: Rows, blocks: int = BLOCKS) -> tuple[tuple[Indices, Array], ...]:
    """The rows of each stretch, and the residual [drive units] they would have if the model had not seen them.

    Args:
        rows: Rows with their residuals; the same ones are asked for by each covariance that an estimate needs.
        blocks: That each motion is cut into.
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
    if rows <= columns:
        found = np.linalg.solve(np.eye(rows) - Q @ Q.T, e)
    else:
        found = e + Q @ np.linalg.solve(np.eye(columns) - Q.T @ Q, Q.T @ e)
    return np.asarray(found, np.float64)
