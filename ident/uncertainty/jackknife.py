"""Covariance from what every stretch of time, left out, would change (delete-a-block jackknife)."""

import numpy as np

from ident.arrays import Array, Indices
from ident.rows import Rows

BLOCKS = 20
"""Stretches that each motion is cut into."""


def jackknife(rows: Rows, influence: Array, serial_s: float) -> Array:
    """Covariance from the estimates that leave out one stretch of a motion, all joints together.

    The unknowns bend towards slow errors and so make residuals look white; an estimate without a stretch does not know
    that stretch. To first order it differs by the influence of its rows times the residual that they have when they are
    not fitted to, (1 - H_bb)^-1 e_b with H the hat matrix (Efron and Stein 1981; `docs/derivations.md`).

    Args:
        rows: Rows with their residuals.
        influence: Derivative of each quantity by each row's current, shape (k, r).
        serial_s: Without meaning here.

    Returns:
        Covariance, shape (k, k).
    """
    changes = np.array([influence[:, block] @ left for block, left in left_out(rows)])
    apart = changes - changes.mean(axis=0)
    return (len(changes) - 1) / len(changes) * (apart.T @ apart)


def left_out(rows: Rows, stretches: int = BLOCKS) -> list[tuple[Indices, Array]]:
    """The rows of each stretch, and the residual [drive units] they would have if the model had not seen them.

    Args:
        rows: Rows with their residuals.
        stretches: That each motion is cut into.
    """
    found: list[tuple[Indices, Array]] = []
    for motion in np.unique(rows.motion):
        own = np.flatnonzero(rows.motion == motion)
        at = rows.position[own] - rows.position[own].min()
        stretch = at * stretches // (at.max() + 1)
        for number in np.unique(stretch):
            block = own[stretch == number]
            explained, weight = rows.explained[block], rows.weight[block]
            explained = explained[:, explained.any(axis=0)]
            fresh = np.linalg.solve(np.eye(len(block)) - explained @ explained.T, weight * rows.residual[block])
            found.append((block, fresh / weight))
    return found
