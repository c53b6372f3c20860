"""What further columns add to held-out predictions, many sets of them at once."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.diagnosis.comparison import Fits, gains
from ident.support.arrays import Array

UNSEEN = 1e-7
"""Square of a unit column that the model must leave for it to be compared."""
TOGETHER = 16
"""Sets of columns that are projected and predicted in one product of matrices; more only need memory."""


@dataclass(frozen=True, slots=True, eq=False)
class Added:
    """What further columns, one coefficient each for all joints, add to the held-out predictions.

    Attributes:
        u: Gain of each block, shape (blocks,).
        value: Coefficients, shape (m,).
        covariance: Of them, for residuals that are autocorrelated within blocks, shape (m, m).
    """

    u: Array
    value: Array
    covariance: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Felt:
    """Columns on the rows of one part of the fits, in units of its residual.

    Attributes:
        part: Its place among the parts.
        square: Sums of squares of the columns, shape (m,).
        products: Columns times what the fit leaves of them, and times its residual, shape (m, m + 1).
        left: What the fit leaves of them, then its residual, by block, shape (blocks, rows, m + 1).
        held: Held-out residuals of these.
    """

    part: int
    square: Array
    products: Array
    left: Array
    held: Array


def added(fits: Fits, columns: Sequence[Array | None]) -> Added | None:
    """Add columns to the model of all joints.

    Args:
        fits: The model.
        columns: Of each part of the fits, shape (r, m), None where they are zero.

    Returns:
        None if the model knows all that the columns say.
    """
    return each_added(fits, [columns])[0]


def each_added(fits: Fits, choices: Sequence[Sequence[Array | None]]) -> list[Added | None]:
    """As `added`, of many sets of columns, each of them alone beside the model."""
    pieces = (choices[start : start + TOGETHER] for start in range(0, len(choices), TOGETHER))
    sigma = fits.sigma
    return [_added(fits, sigma, felt) for piece in pieces for felt in _felt(fits, sigma, piece)]


def _felt(fits: Fits, sigmas: Array, choices: Sequence[Sequence[Array | None]]) -> list[list[_Felt]]:
    """Each set of columns on the parts that feel it; projections and predictions are made of all sets at once."""
    found: list[list[_Felt]] = [[] for _ in choices]
    for j, (part, sigma) in enumerate(zip(fits.parts, sigmas, strict=True)):
        felt = [(k, own) for k, columns in enumerate(choices) if (own := columns[j]) is not None]
        if part is None or not sigma > 0.0 or not felt:
            continue
        c, e = np.hstack([own for _, own in felt]) / sigma, part.fit.residual[:, None] / sigma
        rest = part.fit.without(c)
        both = np.hstack((rest, e))
        left, held = part.padded(both), part.predicted(both)
        ends = np.cumsum([0, *(own.shape[1] for _, own in felt)])
        for (k, _), first, last in zip(felt, ends, ends[1:], strict=False):
            own, at = c[:, first:last], [*range(first, last), -1]
            products = own.T @ np.hstack((rest[:, first:last], e))
            found[k].append(_Felt(j, np.sum(own**2, axis=0), products, left[..., at], held[..., at]))
    return found


def _added(fits: Fits, sigma: Array, felt: Sequence[_Felt]) -> Added | None:
    if not felt:
        return None
    size = np.sqrt(np.sum([each.square for each in felt], axis=0))
    if not (size > 0.0).all():
        return None
    m, products = len(size), np.sum([each.products for each in felt], axis=0)
    values, directions = np.linalg.eigh(products[:, :m] / np.outer(size, size))  # left' left, if nothing is believed
    if values[0] < UNSEEN:
        return None
    spread = directions / np.sqrt(values) / size[:, None]
    b = spread.T @ products[:, m]
    blocks = len(fits.score.squares[0])
    G, r, scores = np.zeros((blocks, m, m)), np.zeros((blocks, m)), np.zeros((blocks, m))
    held = list[tuple[Array, Array]]()
    for each in felt:
        q, of_q = each.left[..., :m] @ spread, each.held[..., :m] @ spread
        rest, of_rest = each.left[..., m] - q @ b, each.held[..., m] - of_q @ b
        G += q.swapaxes(1, 2) @ of_q
        r += (of_rest[:, None] @ q)[:, 0]
        scores += (rest[:, None] @ q)[:, 0]
        held.append((of_rest, of_q))
    t = np.linalg.solve(np.eye(m) - G, r[..., None])
    squares = fits.score.squares.copy()
    for each, (of_rest, of_q) in zip(felt, held, strict=True):
        squares[each.part] = sigma[each.part] ** 2 * np.sum((of_rest + (of_q @ t)[..., 0]) ** 2, axis=1)
    u = gains(fits.score, replace(fits.score, squares=squares))
    own = np.eye(m) + scores.T @ scores
    return Added(u=u, value=spread @ b, covariance=spread @ own @ spread.T)
