"""Evidence for one interpretation of the logs over another: the improvement of held-out predictions of currents.

Every joint is fitted alone, and each time block is predicted by a fit to the others (`BlockedFit`), with residuals e.
The improvement of a block of r rows per joint in expected log predictive density, and its standardised sum over B
blocks, are

    u_b = sum_j r log(s_0 / s_h) + e_0b' e_0b / (2 s_0^2) - e_hb' e_hb / (2 s_h^2)
    z = sum_b u_b / sqrt(B / (B - 1) sum_b (u_b - mean u)^2)

with s_0 and s_h the rms of the two residuals of joint j in a log (Vehtari, Gelman and Gabry 2017; Vuong 1989). Blocks
keep the standard error valid if residuals are autocorrelated; held-out predictions remove the advantage of more free
parameters.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import linalg

from ident.estimation.intervals import BLOCKS, Basis, BlockedFit
from ident.support.arrays import Array, Indices

RIDGE = 1e-9
"""Prior precision of the coefficients of unit columns, in units of the residual: it regularises dependent columns."""


def free_fit(W: Array, V: Array, block: Indices, blocks: int) -> BlockedFit:
    """Fit a joint's currents V, shape (r,), by columns W, shape (r, p), with the time block of each row, shape (r,)."""
    size = np.linalg.norm(W, axis=0)
    unit = W[:, size > 0.0] / size[size > 0.0]
    gram = unit.T @ unit
    gram[np.diag_indices_from(gram)] += RIDGE
    L = linalg.cholesky(gram, lower=True, check_finite=False)
    Q = linalg.solve_triangular(L, unit.T, lower=True, check_finite=False).T
    return BlockedFit(V=V, residual=V - Q @ (Q.T @ V), Q=Basis.of(Q), block=block, blocks=blocks)


@dataclass(frozen=True, slots=True, eq=False)
class Score:
    """Accuracy of held-out predictions of the currents."""

    squares: Array  # sum of squares of the held-out residuals of each joint in each block, shape (n, blocks)
    rows: Array  # rows of each joint in each block, shape (n, blocks)

    @property
    def variance(self) -> Array:
        """Mean square of each joint's held-out residuals, shape (n,)."""
        return self.squares.sum(axis=1) / np.maximum(self.rows.sum(axis=1), 1.0)

    @property
    def by_log(self) -> Array:
        """Mean square of each log, shape (n, logs)."""
        squares, rows = (each.reshape(*each.shape[:-1], -1, BLOCKS).sum(axis=-1) for each in (self.squares, self.rows))
        return squares / np.maximum(rows, 1.0)


def log_density_improvement(given: Score, other: Score) -> Array:
    """Improvement u_b of the log predictive density by another interpretation, shape (blocks,) after its batch axes.

    Residuals are in units of their own rms, joint by joint and log by log, so that large residuals of a wrong
    interpretation, which are not noise, do not increase the standard error.
    """
    before, after = given.by_log, other.by_log
    shown = (before > 0.0) & (after > 0.0)
    ratio = np.log(np.where(shown, before, 1.0) / np.where(shown, after, 1.0))
    gain = np.minimum(given.rows, other.rows) * np.repeat(ratio, BLOCKS, axis=-1)
    for sign, score, variance in ((1.0, given, before), (-1.0, other, after)):
        each = np.repeat(np.where(shown, variance, 1.0), BLOCKS, axis=-1)
        gain += sign * (score.squares / each - score.rows)
    return np.where(np.repeat(shown, BLOCKS, axis=-1), 0.5 * gain, 0.0).sum(axis=-2)


@dataclass(frozen=True, eq=False)
class Fits:
    """Fits with common time blocks, prepared for held-out predictions."""

    # one per joint, or one of all joints together; None where there are fewer rows than unknowns:
    parts: tuple[BlockedFit | None, ...]

    @cached_property
    def score(self) -> Score:
        """Accuracy of each part's predictions."""
        blocks = max((each.blocks for each in self.parts if each is not None), default=0)
        squares, rows = np.zeros((len(self.parts), blocks)), np.zeros((len(self.parts), blocks))
        for k, each in enumerate(self.parts):
            if each is not None:
                squares[k] = np.sum(each.held_residual**2, axis=(1, 2))
                rows[k] = np.bincount(each.block, minlength=blocks)
        return Score(squares, rows)

    @property
    def sigma(self) -> Array:
        """Standard deviation of each part's held-out residuals [drive units], shape (parts,)."""
        return np.sqrt(self.score.variance)


UNSEEN = 1e-7
"""Smallest squared norm of the part of a unit column outside the model; otherwise it is not compared."""
TOGETHER = 1 << 19
"""Largest size of the columns in one matrix product; more only need memory."""


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """Improvement of held-out predictions by further columns, with one coefficient each for all joints."""

    u: Array  # improvement in each block, shape (blocks,)
    value: Array  # coefficients, shape (m,)
    covariance: Array  # their covariance, for residuals that are autocorrelated within blocks, shape (m, m)


def each_added(fits: Fits, choices: Sequence[Sequence[Array | None]], worth: float = 0.0) -> list[Evidence | None]:
    """Return the improvement by each of many sets of columns, each added alone to the model of all joints.

    A set has columns (r, m) of each part of the fits, None where they are zero. The result is None for columns in the
    column space of the model, and below an improvement `worth` of the log-likelihood, as predictions take most time.
    """
    found: list[Evidence | None] = [None] * len(choices)
    rows = max((len(part.V) for part in fits.parts if part is not None), default=1)
    widths = [next((each.shape[1] for each in columns if each is not None), 0) for columns in choices]
    for width in dict.fromkeys(filter(None, widths)):  # sets with equal numbers of columns, of at most this size
        own, count = [k for k, each in enumerate(widths) if each == width], max(1, TOGETHER // (rows * width))
        for piece in (own[start : start + count] for start in range(0, len(own), count)):
            if worth > 0.0:
                improved = _improvements(fits, [choices[k] for k in piece])
                piece = [k for k, each in zip(piece, improved, strict=True) if each > worth]
            for k, more in zip(piece, _added(fits, [choices[k] for k in piece], width), strict=True):
                found[k] = more
    return found


def _improvements(fits: Fits, choices: Sequence[Sequence[Array | None]]) -> Array:
    """Improvement of the log-likelihood by each set of columns, all with the variance of the best log, shape (K,)."""
    count, m = len(choices), next(own.shape[1] for own in choices[0] if own is not None)
    square, left, along = np.zeros((count, m)), np.zeros((count, m, m)), np.zeros((count, m, 1))
    variance = fits.score.by_log
    least = np.min(np.where(variance > 0.0, variance, np.inf), axis=1)
    for j, part, which, columns in stacked(fits, choices):
        if np.isfinite(unit := least[j]):
            c = columns.reshape(len(columns), len(which), m).transpose(1, 2, 0)
            inside = part.Q.against(columns).reshape(-1, len(which), m).transpose(1, 2, 0)
            square[which] += np.einsum("kmr,kmr->km", c, c) / unit
            left[which] += (c @ c.swapaxes(1, 2) - inside @ inside.swapaxes(1, 2)) / unit
            along[which] += c @ part.residual[:, None] / unit
    values, axes = _principal(square, left)
    turned = axes.swapaxes(1, 2) @ along
    return np.asarray(0.5 * np.sum(turned[..., 0] ** 2 / np.maximum(values, UNSEEN), axis=1), np.float64)


def stacked(fits: Fits, choices: Sequence[Sequence[Array | None]]) -> Iterator[tuple[int, BlockedFit, Indices, Array]]:
    """Each part of the fits, with the indices of the sets that are not zero on it, shape (K,), and their columns."""
    for j, part in enumerate(fits.parts):
        felt = [(k, own) for k, columns in enumerate(choices) if (own := columns[j]) is not None]
        if part is not None and felt:
            yield j, part, np.array([k for k, _ in felt], np.intp), np.hstack([own for _, own in felt])


def _added(fits: Fits, choices: Sequence[Sequence[Array | None]], m: int) -> list[Evidence | None]:
    """Improvement by each of K sets of m columns, None for sets in the column space of the model."""
    K, blocks = len(choices), fits.score.squares.shape[1]
    if not K:
        return []
    square, products = np.zeros((K, m)), np.zeros((K, m, m + 1))  # columns' squares; times residuals
    left, crossed, residual = (np.zeros((K, blocks, m, width)) for width in (m, m, 2))
    felt = list[tuple[int, Indices, Array, Array]]()
    for j, part, which, columns in stacked(fits, choices):
        if fits.sigma[j] <= 0.0:
            continue
        sets, unit, e = (len(which), m), fits.sigma[j] ** 2, part.residual[:, None]
        rest = part.without(columns)
        padded, held_residual = part.padded(rest), part.held_residual
        held = part.by_block(padded)
        with_e = padded.swapaxes(1, 2) @ np.concatenate((part.padded(e), held_residual), axis=2)  # (blocks, K m, 2)
        c, rest, padded, held = (each.reshape(*each.shape[:-1], *sets) for each in (columns, rest, padded, held))
        own = c.transpose(1, 2, 0)  # differences of large numbers: BLAS sums have smaller rounding errors
        square[which] += np.einsum("rkm,rkm->km", c, c) / unit
        products[which, :, :m] += own @ rest.transpose(1, 0, 2) / unit
        products[which, :, m:] += (columns.T @ e).reshape(*sets, 1) / unit
        turned = padded.transpose(0, 2, 3, 1)  # (blocks, K, m, rows)
        left[which] += np.moveaxis(turned @ padded.transpose(0, 2, 1, 3), 0, 1) / unit
        crossed[which] += np.moveaxis(turned @ held.transpose(0, 2, 1, 3), 0, 1) / unit
        residual[which] += np.moveaxis(with_e.reshape(blocks, *sets, 2), 0, 1) / unit
        felt.append((j, which, held, held_residual))
    values, axes = _principal(square, products[..., :m])  # without priors of left' left
    known = (square > 0.0).all(axis=1) & (values[:, 0] >= UNSEEN)
    spread = axes / np.sqrt(np.where(known[:, None], values, 1.0))[:, None]  # (K, m, m)
    turned = spread.swapaxes(1, 2)
    value = spread @ (turned @ products[..., m:])  # (K, m, 1)
    turned, wide, far = turned[:, None], spread[:, None], value[:, None]
    G = turned @ crossed @ wide  # (K, blocks, m, m)
    scores = (turned @ (residual[..., :1] - left @ far))[..., 0]
    t = np.linalg.solve(np.eye(m) - G[known], (turned @ (residual[..., 1:] - crossed @ far))[known])
    more = np.zeros((K, blocks, m, 1))
    more[known] = (wide[known] @ t) - far[known]
    squares = np.broadcast_to(fits.score.squares, (K, *fits.score.squares.shape)).copy()
    for j, which, held, held_residual in felt:
        off = held_residual + np.einsum("brki,kbi->brk", held, more[which, ..., 0])
        squares[which, j] = np.einsum("brk,brk->kb", off, off)
    u = log_density_improvement(fits.score, replace(fits.score, squares=squares))
    covariance = spread @ (np.eye(m) + scores.swapaxes(1, 2) @ scores) @ spread.swapaxes(1, 2)
    return [Evidence(u[k], value[k, :, 0], covariance[k]) if known[k] else None for k in range(K)]


def _principal(square: Array, left: Array) -> tuple[Array, Array]:
    """Shares of unit columns outside the model along principal axes, increasing, (K, m), and these axes, (K, m, m)."""
    unit = np.sqrt(np.where(square > 0.0, square, 1.0))
    values, axes = np.linalg.eigh(left / (unit[:, :, None] * unit[:, None, :]))
    return np.asarray(values, np.float64), np.asarray(axes / unit[:, :, None], np.float64)
