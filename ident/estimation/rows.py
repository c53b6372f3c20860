"""The rows of an estimate: currents, residuals, and joint and motion of each row."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ident.support.arrays import Array, Indices


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rows:
    """Rows of one or more joints, in order of joints, then of motions.

    Attributes:
        V: Currents [drive units], shape (r,).
        residual: Residuals [drive units], shape (r,).
        joint: Joint of each row, from 0, shape (r,).
        motion: Motion of each row, an index into `Problem.motions`, shape (r,).
        position: Number of each row in its motion, including omitted rows, shape (r,).
        row_period: Time from one row to the next [s].
        unknowns: Number of unknowns of each joint that has rows, by joint, including a share of common unknowns.
        weight: Weight of each row in the fit, shape (r,).
        explained: Orthonormal basis of the weighted column space, shape (r, u); of a fit with priors, its part on the
            rows.
    """

    V: Array
    residual: Array
    joint: Indices
    motion: Indices
    position: Indices
    row_period: float
    unknowns: dict[int, float]
    weight: Array
    explained: Array

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
        return float(np.sqrt(np.mean(self.V[self.of(joint)] ** 2)))

    def least_std(self, influence: Array, noise_floor: float) -> Array:
        """Standard deviations from white residuals, of at least a share of each joint's rms current.

        Args:
            influence: Derivative of k quantities by the current of each row, shape (k, r).
            noise_floor: That share.

        Returns:
            Shape (k,).
        """
        floor = np.empty(len(self.V))
        for joint in self.unknowns:
            floor[self.of(joint)] = noise_floor * self.rms_current(joint)
        return np.linalg.norm(influence * floor, axis=1)

    def residual_share(self, joint: int) -> float:
        """Ratio of the norm of a joint's residual to that of its currents."""
        rows = self.of(joint)
        return float(np.linalg.norm(self.residual[rows]) / np.linalg.norm(self.V[rows]))

    def runs(self) -> Iterator[slice]:
        """Slices of rows of one joint and one motion."""
        key = np.flatnonzero(np.diff(self.joint) | np.diff(self.motion)) + 1
        edges = [0, *key.tolist(), len(self.V)]
        for start, stop in pairwise(edges):
            if start < stop:
                yield slice(start, stop)
