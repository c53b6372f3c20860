"""Covariance estimators by name: functions `(rows, influence) -> covariance`, and the rows that they use.

`rows` have residuals; `influence` is the derivative of k quantities by the current of each row, shape (k, r). The
covariance has shape (k, k).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ident.support.arrays import Array, Indices, readonly

BLOCKS = 20
"""Number of time blocks of each motion."""
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
    them, (1 - H_bb)^-1 e_b with H the hat matrix (Efron and Stein 1981; `docs/derivations.md`).
    """
    if not len(influence):  # of no joint; there may be no row either
        return np.zeros((0, 0))
    return of_changes(np.array([influence[:, block] @ left for block, left in left_out(rows)]))


def of_changes(changes: Array) -> Array:
    """Return the covariance from the changes of k quantities without each of B time blocks, shape (B, k)."""
    apart = changes - changes.mean(axis=0)
    return (len(changes) - 1) / len(changes) * (apart.T @ apart)


@lru_cache(maxsize=1)
def left_out(rows: Rows, blocks: int = BLOCKS) -> tuple[tuple[Indices, Array], ...]:
    """Return the rows of each of so many time blocks of each motion, and their residuals in a fit without the block."""
    number, found = time_blocks(rows.motion, rows.position, blocks), list[tuple[Indices, Array]]()
    for block in np.split(np.argsort(number, kind="stable"), np.cumsum(np.bincount(number))[:-1]):
        explained, weight = rows.explained.at(block), rows.weight[block]
        fresh = _not_fitted_to(explained[:, explained.any(axis=0)], weight * rows.residual[block])
        found.append((block, readonly(fresh / weight)))
    return tuple(found)


def _not_fitted_to(Q: Array, e: Array) -> Array:
    """(I - Q Q')^-1 e through the smaller of two matrices: it is e + Q (I - Q'Q)^-1 Q'e (Woodbury's identity).

    A parameter that the block alone determines makes the matrix singular; `FREE_BLOCK` keeps its value.
    """
    rows, columns = Q.shape
    if rows <= columns:
        return np.asarray(np.linalg.solve((1.0 + FREE_BLOCK) * np.eye(rows) - Q @ Q.T, e), np.float64)
    return e + Q @ np.linalg.solve((1.0 + FREE_BLOCK) * np.eye(columns) - Q.T @ Q, Q.T @ e)


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
    error = np.zeros(len(rows.V))
    for block, fresh in left_out(rows, blocks):
        error[block] = fresh
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
