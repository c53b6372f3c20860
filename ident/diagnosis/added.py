"""Improvement of held-out predictions by further columns, for many sets of columns at once."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.diagnosis.comparison import Fits, HeldOut, gains
from ident.support.arrays import Array, Indices

UNSEEN = 1e-7
"""Smallest squared norm of the part of a unit column outside the model; otherwise it is not compared."""
TOGETHER = 1 << 19
"""Largest size of the columns in one matrix product; more only need memory."""


@dataclass(frozen=True, slots=True, eq=False)
class Added:
    """Improvement of held-out predictions by further columns, with one coefficient each for all joints.

    Attributes:
        u: Improvement in each block, shape (blocks,).
        value: Coefficients, shape (m,).
        covariance: Their covariance, for residuals that are autocorrelated within blocks, shape (m, m).
    """

    u: Array
    value: Array
    covariance: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Felt:
    """K sets of m columns on the rows of one part of the fits, in units of its residual.

    Attributes:
        part: Index of the part.
        which: Indices of the sets, shape (K,).
        square: Sums of squares of the columns, shape (K, m).
        products: Columns times their residuals in the fit, and times the residual of the currents, shape (K, m, m + 1).
        left: Products of the columns' residuals in each block, shape (K, blocks, m, m).
        crossed: The same times their held-out residuals.
        residual: Columns' residuals times the residual, and times the held-out residual, of the currents, shape (K,
            blocks, m, 2).
        held: Held-out residuals of the columns, in their own unit, shape (blocks, rows, K, m).
        held_residual: Held-out residuals of the currents, shape (blocks, rows).
    """

    part: int
    which: Indices
    square: Array
    products: Array
    left: Array
    crossed: Array
    residual: Array
    held: Array
    held_residual: Array


def each_added(fits: Fits, choices: Sequence[Sequence[Array | None]], worth: float = 0.0) -> list[Added | None]:
    """Return the improvement by each of many sets of columns, each added alone to the model of all joints.

    Args:
        fits: The model.
        choices: Columns of shape (r, m) of each set and each part of the fits, None where they are zero.
        worth: Smallest improvement of the log-likelihood for which predictions are compared, which takes most of the
            time.

    Returns:
        One result for each set, None if its columns are in the column space of the model, or are not worth it.
    """
    found: list[Added | None] = [None] * len(choices)
    sigma = fits.sigma
    for piece in _pieces(fits, choices):
        if worth > 0.0:
            improved = _improvements(fits, [choices[k] for k in piece])
            piece = [k for k, each in zip(piece, improved, strict=True) if each > worth]
        felt = list(_felt(fits, sigma, [choices[k] for k in piece]))
        for place, more in _added(fits, sigma, felt, len(piece)):
            found[piece[place]] = more
    return found


def _improvements(fits: Fits, choices: Sequence[Sequence[Array | None]]) -> Array:
    """Improvement of the log-likelihood by each set of columns, all with the variance of the best log, shape (K,)."""
    count, m = len(choices), next(own.shape[1] for own in choices[0] if own is not None)
    square, left, along = np.zeros((count, m)), np.zeros((count, m, m)), np.zeros((count, m, 1))
    variance = fits.score.log_variance
    least = np.min(np.where(variance > 0.0, variance, np.inf), axis=1)
    for unit, (part, which, columns) in zip(least, _stacked(fits, choices), strict=True):
        if part is not None and len(which) and np.isfinite(unit):
            c = columns.reshape(len(columns), len(which), m).transpose(1, 2, 0)
            inside = part.fit.inside(columns).reshape(-1, len(which), m).transpose(1, 2, 0)
            square[which] += np.einsum("kmr,kmr->km", c, c) / unit
            left[which] += (c @ c.swapaxes(1, 2) - inside @ inside.swapaxes(1, 2)) / unit
            along[which] += c @ part.fit.residual[:, None] / unit
    values, axes = _principal(square, left)
    turned = axes.swapaxes(1, 2) @ along
    return np.asarray(0.5 * np.sum(turned[..., 0] ** 2 / np.maximum(values, UNSEEN), axis=1), np.float64)


def _pieces(fits: Fits, choices: Sequence[Sequence[Array | None]]) -> Iterator[list[int]]:
    """Groups of sets with equal numbers of columns, of at most the size `TOGETHER`."""
    rows = max((len(part.fit.V) for part in fits.parts if part is not None), default=1)
    alike = dict[int, list[int]]()
    for k, columns in enumerate(choices):
        width = next((each.shape[1] for each in columns if each is not None), 0)
        if width:
            alike.setdefault(width, []).append(k)
    for width, own in alike.items():
        count = max(1, TOGETHER // (rows * width))
        yield from (own[start : start + count] for start in range(0, len(own), count))


def _felt(fits: Fits, sigmas: Array, choices: Sequence[Sequence[Array | None]]) -> Iterator[_Felt]:
    """Sets with equal numbers of columns, on the parts where they are not zero."""
    for j, (part, which, columns) in enumerate(_stacked(fits, choices)):
        if part is not None and sigmas[j] > 0.0 and len(which):
            yield _of_part(j, part, float(sigmas[j]), columns, which)


def _stacked(fits: Fits, choices: Sequence[Sequence[Array | None]]) -> Iterator[tuple[HeldOut | None, Indices, Array]]:
    """Each part of the fits, with the indices of the sets that are not zero on it, shape (K,), and their columns."""
    for j, part in enumerate(fits.parts):
        felt = [(k, own) for k, columns in enumerate(choices) if (own := columns[j]) is not None]
        columns = np.hstack([own for _, own in felt]) if felt else np.zeros((0, 0))
        yield part, np.array([k for k, _ in felt], np.intp), columns


def _of_part(place: int, part: HeldOut, sigma: float, columns: Array, which: Indices) -> _Felt:
    sets, e = (len(which), columns.shape[1] // len(which)), part.fit.residual[:, None]
    rest = part.fit.without(columns)
    left, of_residual = part.padded(rest), part.padded(e)
    held, held_residual = np.split(part.by_block(np.concatenate((left, of_residual), axis=2)), [-1], axis=2)
    residual = left.swapaxes(1, 2) @ np.concatenate((of_residual, held_residual), axis=2)  # (blocks, K m, 2)
    c, rest, left, held = (each.reshape(*each.shape[:-1], *sets) for each in (columns, rest, left, held))
    own = c.transpose(1, 2, 0)  # differences of large numbers: BLAS sums have smaller rounding errors
    products = np.concatenate((own @ rest.transpose(1, 0, 2), (columns.T @ e).reshape(*sets, 1)), axis=-1)
    unit = sigma**2
    return _Felt(
        part=place,
        which=which,
        square=np.einsum("rkm,rkm->km", c, c) / unit,
        products=products / unit,
        left=_within(left, left) / unit,
        crossed=_within(left, held) / unit,
        residual=np.moveaxis(residual.reshape(len(residual), *sets, 2), 0, 1) / unit,
        held=held,
        held_residual=held_residual[..., 0],
    )


def _within(x: Array, y: Array) -> Array:
    """Products of columns of each set by block, both (blocks, rows, K, m), shape (K, blocks, m, m)."""
    if x.shape[-1] == 1:
        return np.einsum("brk,brk->bk", x[..., 0], y[..., 0]).T[..., None, None]
    return np.moveaxis(x.transpose(0, 2, 3, 1) @ y.transpose(0, 2, 1, 3), 0, 1)


def _added(fits: Fits, sigma: Array, felt: Sequence[_Felt], count: int) -> Iterator[tuple[int, Added]]:
    """Improvement by each set of m columns, without sets in the column space of the model."""
    if not felt:
        return
    blocks, m = felt[0].residual.shape[1:3]
    square, products = np.zeros((count, m)), np.zeros((count, m, m + 1))
    left, crossed, residual = (np.zeros((count, blocks, m, width)) for width in (m, m, 2))
    for each in felt:
        for total, own in (
            (square, each.square), (products, each.products), (left, each.left), (crossed, each.crossed),
            (residual, each.residual),
        ):  # fmt: skip
            total[each.which] += own
    values, axes = _principal(square, products[..., :m])
    # left' left without priors
    known = (square > 0.0).all(axis=1) & (values[:, 0] >= UNSEEN)
    spread = axes / np.sqrt(np.where(known[:, None], values, 1.0))[:, None]  # (K, m, m)
    turned = spread.swapaxes(1, 2)
    value = spread @ (turned @ products[..., m:])  # (K, m, 1)
    turned, wide, far = turned[:, None], spread[:, None], value[:, None]
    G = turned @ crossed @ wide  # (K, blocks, m, m)
    scores = (turned @ (residual[..., :1] - left @ far))[..., 0]
    t = np.linalg.solve(np.eye(m) - G[known], (turned @ (residual[..., 1:] - crossed @ far))[known])
    more = np.zeros((count, blocks, m, 1))
    more[known] = (wide[known] @ t) - far[known]
    squares = np.broadcast_to(fits.score.squares, (count, *fits.score.squares.shape)).copy()
    for each in felt:
        off = each.held_residual[..., None] + _combined(each.held, more[each.which])
        squares[each.which, each.part] = np.einsum("brk,brk->bk", off, off).T
    u = gains(fits.score, replace(fits.score, squares=squares))
    own = np.eye(m) + scores.swapaxes(1, 2) @ scores
    covariance = spread @ own @ spread.swapaxes(1, 2)
    for k in np.flatnonzero(known).tolist():
        yield k, Added(u=u[k], value=value[k, :, 0], covariance=covariance[k])


def _principal(square: Array, left: Array) -> tuple[Array, Array]:
    """Shares of unit columns outside the model along principal axes, increasing, and the axes in units of the columns.

    Args:
        square: Sums of squares of the columns of each set, shape (K, m).
        left: Products of their residuals, shape (K, m, m).

    Returns:
        Shapes (K, m) and (K, m, m).
    """
    unit = np.sqrt(np.where(square > 0.0, square, 1.0))
    values, axes = np.linalg.eigh(left / (unit[:, :, None] * unit[:, None, :]))
    return np.asarray(values, np.float64), np.asarray(axes / unit[:, :, None], np.float64)


def _combined(held: Array, coefficients: Array) -> Array:
    """Columns of every set (blocks, rows, K, m) times coefficients of every block (K, blocks, m, 1), summed over m."""
    if held.shape[-1] == 1:
        return held[..., 0] * coefficients[:, :, 0, 0].T[:, None]
    return (held.swapaxes(1, 2) @ np.moveaxis(coefficients, 0, 1))[..., 0].swapaxes(1, 2)  # (blocks, rows, K)
