"""Covariance estimators by name: functions `(rows, influence) -> covariance`, and the rows that they use.

`rows` have residuals; `influence` is the derivative of k quantities by the current of each row, shape (k, r). The
covariance has shape (k, k).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from ident.support.arrays import Array, Indices, readonly

BLOCKS = 20
"""Number of time blocks of each motion; with 8, the z of evidence is heavy-tailed."""
FREE_BLOCK = 1e-13
"""Information that is added for parameters that one time block alone determines, as a share of that of all blocks."""


def rms(x: Array) -> float:
    """Root mean square, zero for an empty array."""
    return float(np.sqrt(np.mean(x**2))) if len(x) else 0.0


class Part(NamedTuple):
    """Columns on some rows."""

    rows: slice
    columns: Indices  # which columns, shape (c,)
    Q: Array  # their values on these rows, shape (rows, c)


@dataclass(frozen=True, slots=True, eq=False)
class Basis:
    """Columns, most of which are zero on the rows of most joints: only the others are stored."""

    shape: tuple[int, int]  # r rows, u columns
    parts: tuple[Part, ...]

    @classmethod
    def of(cls, *own: Array) -> "Basis":
        """Of the columns of consecutive rows, each zero on all others."""
        r, u, parts = 0, 0, list[Part]()
        for Q in own:
            parts.append(Part(slice(r, r + len(Q)), np.arange(u, u + Q.shape[1]), Q))
            r, u = r + len(Q), u + Q.shape[1]
        return cls((r, u), tuple(parts))

    def beside(self, Q: Array) -> "Basis":
        """Append columns, shape (r, m)."""
        r, u = self.shape
        more = Part(slice(0, r), np.arange(u, u + Q.shape[1]), Q)
        return Basis((r, u + Q.shape[1]), (*self.parts, more))

    def against(self, x: Array) -> Array:
        """Products of all columns with others, shape (r, k), shape (u, k)."""
        found = np.zeros((self.shape[1], x.shape[1]))
        for rows, columns, Q in self.parts:
            own = np.flatnonzero(x[rows].any(axis=0))
            found[np.ix_(columns, own)] += Q.T @ x[rows, own]
        return found

    def times(self, x: Array) -> Array:
        """Products of the rows with coefficients (u, k), shape (r, k)."""
        found = np.zeros((self.shape[0], x.shape[1]))
        for rows, columns, Q in self.parts:
            found[rows] += Q @ x[columns]
        return found

    def at(self, rows: Indices) -> Array:
        """All columns of some rows in ascending order, shape (rows, u)."""
        found = np.zeros((len(rows), self.shape[1]))
        for own, columns, Q in self.parts:
            start, stop = np.searchsorted(rows, (own.start, own.stop))
            found[start:stop, columns] = Q[rows[start:stop] - own.start]
        return found


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """Places of the rows of all joints in arrays of shape (n, B, w, ..)."""

    shape: tuple[int, int, int]  # n joints, B time blocks of all motions, w rows of the longest block
    place: Indices  # place of each row, shape (r,)
    counts: Indices  # number of rows of each joint, shape (n,)

    @classmethod
    def of(cls, n: int, joint: Indices, block: Indices, blocks: int) -> "Layout":
        """Of rows by joint and time block, both of shape (r,)."""
        group = joint * blocks + block
        order, counts = np.argsort(group, kind="stable"), np.bincount(group, minlength=n * blocks)
        width, place = int(counts.max(initial=1)), np.empty_like(group)
        place[order] = group[order] * width + np.arange(len(group)) - (np.cumsum(counts) - counts)[group[order]]
        return cls((n, blocks, width), place, np.sum(counts.reshape(n, blocks), axis=1))

    def padded(self, x: Array) -> Array:
        """From rows (r, m) to (n, B, w, m), padded with zeros."""
        out = np.zeros((int(np.prod(self.shape)), x.shape[1]))
        out[self.place] = x
        return out.reshape(*self.shape, -1)

    def rows(self, x: Array) -> Array:
        """From (n, B, w, m) to rows (r, m)."""
        return x.reshape(-1, x.shape[-1])[self.place]


@dataclass(frozen=True, eq=False)
class BlockedFit:
    """A fit of one joint or of all, and its predictions of each time block by fits to the other blocks.

    These need no further fit: with Q an orthonormal basis of the columns, e the residuals and b the rows of a block,

        e_b -> (I - Q_b Q_b')^-1 e_b = e_b + Q_b (I - Q_b' Q_b)^-1 Q_b' e_b

    of which the smaller matrix is used (Woodbury's identity, Golub and Van Loan, 2.1.4). A parameter that the block
    alone determines makes both singular; `FREE_BLOCK` keeps its value.
    """

    V: Array  # currents [drive units], shape (r,)
    residual: Array  # residuals, shape (r,)
    Q: Basis  # orthonormal basis of the columns (with the weak prior, its part on the rows), shape (r, p)
    block: Indices  # time block of each row, numbered through all logs, shape (r,)
    blocks: int  # number of blocks of all logs

    @property
    def freedom(self) -> int:
        """Degrees of freedom: rows minus unknowns."""
        return len(self.V) - self.Q.shape[1]

    def without(self, columns: Array) -> Array:
        """Return the residuals of columns, shape (r, k) or (r,), in this fit."""
        given = columns.reshape(len(columns), -1)
        return (given - self.Q.times(self.Q.against(given))).reshape(columns.shape)

    @cached_property
    def layout(self) -> Layout:
        """Places of the rows, of all joints together, by block."""
        return Layout.of(1, np.zeros_like(self.block), self.block, self.blocks)

    @cached_property
    def _by_block(self) -> list[Indices]:
        """Indices of the rows of each block."""
        return np.split(np.argsort(self.layout.place), np.cumsum(np.bincount(self.block, minlength=self.blocks))[:-1])

    def padded(self, x: Array) -> Array:
        """Rows (r, k) by block, shape (blocks, m, k)."""
        return self.layout.padded(x)[0]

    def predicted(self, left: Array) -> Array:
        """Held-out residuals, shape (blocks, m, k), from the residuals of columns, shape (r, k)."""
        return self.by_block(self.padded(left))

    @cached_property
    def held_residual(self) -> Array:
        """Held-out residuals of the currents, shape (blocks, m, 1)."""
        return self.predicted(self.residual[:, None])

    def by_block(self, x: Array) -> Array:
        """The same for padded columns, both of shape (blocks, m, k)."""
        if not self._long:
            return np.asarray(np.linalg.solve(self._others, x), np.float64)
        left = x.copy()
        for own, rows, inverse in zip(left, self._by_block, self._others, strict=True):
            Q = self.Q.at(rows)
            own[: len(rows)] += Q @ (inverse @ (Q.T @ own[: len(rows)]))
        return left

    @property
    def _long(self) -> bool:
        return self.layout.shape[2] > 2 * self.Q.shape[1]

    @cached_property
    def _others(self) -> Array:
        """`I - Q_b Q_b'` of every block, shape (blocks, m, m); of long blocks the other inverse, (blocks, p, p)."""
        if self._long:
            of_blocks = (self.Q.at(rows) for rows in self._by_block)
            return readonly(np.linalg.inv([(1.0 + FREE_BLOCK) * np.eye(Q.shape[1]) - Q.T @ Q for Q in of_blocks]))
        Q = self.padded(self.Q.at(np.arange(len(self.V))))
        return readonly((1.0 + FREE_BLOCK) * np.eye(Q.shape[1]) - Q @ Q.swapaxes(1, 2))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rows:
    """Rows of one or more joints, in order of joints, then of motions."""

    V: Array  # currents [drive units], shape (r,)
    residual: Array  # residuals [drive units], shape (r,)
    joint: Indices  # joint of each row, from 0, shape (r,)
    motion: Indices  # motion of each row, an index into `Problem.motions`, shape (r,)
    position: Indices  # number of each row in its motion, including omitted rows, shape (r,)
    # number of unknowns of each joint that has rows, by joint, including a share of common unknowns:
    unknowns: dict[int, float]
    weight: Array  # weight of each row in the fit, shape (r,)
    # orthonormal basis of the weighted column space, shape (r, u); of a fit with priors, its part on the rows:
    explained: Basis

    def of(self, joint: int) -> slice:
        """The rows of a joint."""
        start, stop = np.searchsorted(self.joint, [joint, joint + 1])
        return slice(int(start), int(stop))

    def sigma(self, joint: int) -> float:
        """Standard deviation of a joint's residual (eq. 19) [drive units]."""
        own = self.residual[self.of(joint)]
        return float(np.linalg.norm(own) / np.sqrt(len(own) - self.unknowns[joint]))

    def rms_current(self, joint: int) -> float:
        """Root mean square of a joint's currents [drive units]."""
        return rms(self.V[self.of(joint)])

    def of_joints(self, number: Callable[[int], float]) -> Array:
        """A number of each row's joint, shape (r,)."""
        found = np.empty(len(self.V))
        for joint in self.unknowns:
            found[self.of(joint)] = number(joint)
        return found

    def residual_share(self, joint: int) -> float:
        """Ratio of the norm of a joint's residual to that of its currents."""
        rows = self.of(joint)
        return float(np.linalg.norm(self.residual[rows]) / np.linalg.norm(self.V[rows]))


def time_blocks(motion: Indices, position: Indices, blocks: int = BLOCKS) -> Indices:
    """Return the number of each row's time block, of those with rows: `blocks` of each motion, shape (r,)."""
    found, first = np.empty(len(motion), dtype=np.intp), 0
    for which in np.unique(motion):
        own = motion == which
        at = position[own] - position[own].min()
        numbers, found[own] = np.unique(at * blocks // (at.max() + 1), return_inverse=True)
        found[own] += first
        first += len(numbers)
    return found


def jackknife(rows: Rows, influence: Array) -> Array:
    """Return the covariance from estimates without one time block of a motion, of all joints together.

    The fit absorbs part of slow errors, which makes residuals look white; an estimate without a block is independent of
    that block. To first order it differs by the influence of the block's rows times their residuals in a fit without
    them (Efron and Stein 1981; `docs/derivations.md`).
    """
    if not len(influence):  # of no joint; there may be no row either
        return np.zeros((0, 0))
    residual, block = held_out(rows)
    return of_changes(np.array([np.bincount(block, each) for each in influence * residual], np.float64).T)


def z_of(u: Array) -> float:
    """Sum of improvements by time block over its standard error; zero if they are all equal."""
    return float(each_z(u))


def each_z(u: Array) -> Array:
    """The same for many sums at once: from shape (..., blocks) to shape (...)."""
    used = u != 0.0
    count, total = np.count_nonzero(used, axis=-1), u.sum(axis=-1)
    off = np.where(used, u - (total / np.maximum(count, 1))[..., None], 0.0)
    spread = np.sqrt(count / np.maximum(count - 1, 1) * np.sum(off**2, axis=-1))
    return np.divide(total, spread, out=np.zeros(total.shape), where=(count > 1) & (spread > 0.0))


def of_changes(changes: Array) -> Array:
    """Return the covariance from the changes of k quantities without each of B time blocks, shape (B, k)."""
    apart = changes - changes.mean(axis=0)
    return (len(changes) - 1) / len(changes) * (apart.T @ apart)


@lru_cache(maxsize=1)
def held_out(rows: Rows, blocks: int = BLOCKS) -> tuple[Array, Indices]:
    """Return each row's residual in a fit without its time block, of so many of each motion, and its block, (r,)."""
    block = time_blocks(rows.motion, rows.position, blocks)
    fit = BlockedFit(rows.weight * rows.V, rows.weight * rows.residual, rows.explained, block, int(block.max()) + 1)
    return readonly(fit.layout.rows(fit.held_residual)[:, 0] / rows.weight), block


TIME_BLOCKS = 5
"""Number of time blocks of each motion for cross-validation."""


@dataclass(frozen=True, slots=True)
class JointPrediction:
    """How well a joint's currents are predicted on rows that were not fitted."""

    joint: int  # from 0
    share: float  # ratio of the norm of the prediction error to that of the currents
    fitted: float  # ratio of the norm of the residual of the fit to all rows to that of the currents


def cross_validated(rows: Rows, blocks: int = TIME_BLOCKS) -> tuple[JointPrediction, ...]:
    """Predict every time block of every motion from the others, by fits without it, for each joint that has rows.

    A model error common to all blocks is not detected; only a motion with another payload can reveal it.
    """
    error, _ = held_out(rows, blocks)
    sizes = {j: [float(np.linalg.norm(x[rows.of(j)])) for x in (error, rows.V)] for j in rows.unknowns}
    return tuple(JointPrediction(j, x / V, rows.residual_share(j)) for j, (x, V) in sizes.items())


def classical(rows: Rows, influence: Array) -> Array:
    """Return the covariance for white residuals with one standard deviation per joint (eq. 20), shape (k, k)."""
    spread = influence * rows.of_joints(rows.sigma)
    return spread @ spread.T  # eq. 20: influence @ influence.T is (W^T W)^-1


def deviations(covariance: Array) -> Array:
    """Standard deviations of k quantities, shape (k,); a variance may be below zero by rounding."""
    return np.sqrt(np.maximum(np.diag(covariance), 0.0))


def larger_of(covariance: Array, other: Array) -> Array:
    """Return the covariance with the larger of both standard deviations and the correlations of the first, (k, k)."""
    own = np.diag(covariance)
    factor = np.sqrt(np.maximum(own, np.diag(other)) / np.where(own > 0.0, own, 1.0))
    return covariance * np.outer(factor, factor)


def max_of_classical_and_jackknife(rows: Rows, influence: Array) -> Array:
    """Return the covariance with the larger of both standard deviations and the classical correlations."""
    return larger_of(classical(rows, influence), jackknife(rows, influence))


UNCERTAINTIES: dict[str, Callable[[Rows, Array], Array]] = {
    "classical": classical,
    "jackknife": jackknife,
    "cautious": max_of_classical_and_jackknife,
}
"""`classical`: eq. 20, white residuals; `jackknife`: delete-a-block; `cautious`: maximum of both."""
