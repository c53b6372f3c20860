"""Drive gains of all joints by total least squares, scaled by the known payload (Gautier, Vandanjon et al. 2014).

The null vector of the homogeneous equations of all joints, the known payload among the columns, is normalised so that
the payload's coefficient is one. Rows are scaled joint by joint, columns to unit norm. Total least squares is
consistent only if all scaled columns are equally noisy; of a robot the currents alone are noisy, so that gains may be
off by tens of percent, or negative; its deviations know it and joints are refused.
"""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from ident.estimation.estimate import GainEstimate
from ident.estimation.homogeneous import (
    HomogeneousOptions,
    HomogeneousSystem,
    Unknowns,
    gain_solution,
    homogeneous_system,
)
from ident.estimation.identifiability import judge_identifiability
from ident.estimation.problem import Problem
from ident.numerics.least_squares import factors
from ident.support.arrays import Array, Indices
from ident.support.errors import NotIdentifiable

NAME = "tls-2014"


def total_gains(problem: Problem, options: HomogeneousOptions) -> GainEstimate:
    """Estimate the gains of all joints by total least squares of the homogeneous form.

    Args:
        problem: Motions, bare and loaded; all that is known of a payload is used.
        options: Weights of rows.

    Returns:
        A gain or a reason for each joint.

    Raises:
        NotIdentifiable: If no motion is bare, none is loaded, no known torque sets the scale, or the equations have
            more than one solution.
        TooFewRows: If there are no more rows than unknowns.
    """
    system = homogeneous_system(problem, options.weights)
    return judge_identifiability(NAME, problem, gain_solution(system, _solved(system)))


def _solved(system: HomogeneousSystem) -> Unknowns:
    """The null vector of the columns that are there, the known payload's the last."""
    rank_tol = system.problem.options.rank_tol
    chosen = _independent(system, rank_tol)
    M = np.column_stack((system.H[:, chosen], -system.k))
    found = null_vector(M, np.linalg.norm(M, axis=0), rank_tol=rank_tol)

    def whole(part: Array) -> Array:
        """Without the payload's own coefficient, zeros for columns that were left out."""
        every = np.zeros((system.H.shape[1], *part.shape[1:]))
        every[chosen] = part[:-1]
        return every

    seen = np.isin(np.arange(system.n), chosen)
    payload = np.full(len(system.k), len(chosen))
    current = np.where(seen[system.joint], np.searchsorted(chosen, system.joint), payload)
    return Unknowns(
        x=whole(found.x),
        by_current=whole(found.derivative(current, system.weight)),
        by_load=whole(found.derivative(payload, -system.weight)),
        explained=found.explained,
        seen=seen,
    )


def _independent(system: HomogeneousSystem, rank_tol: float) -> Indices:
    """Columns of H that are not zero and, the currents apart, independent of each other, in order."""
    n = system.n
    currents = np.flatnonzero(system.H[:, :n].any(axis=0))
    return np.concatenate((currents, n + np.sort(factors(system.H[:, n:], rank_tol=rank_tol).columns)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NullVector:
    """The x, its last entry 1, for which M / scale has the smallest product of its norm with that of `scale x`.

    Attributes:
        x: Shape (m,).
        explained: Orthonormal columns that span the rest of M, shape (r, m - 1).
        by_row: G M^T, shape (m, r), with G the sum of v_k v_k^T / (s^2 - s_k^2) over the other singular vectors.
        G: Shape (m, m).
        left: M x of the unit vector z, shape (r,).
        z: The singular vector, shape (m,).
        scale: Of the columns, shape (m,).
    """

    x: Array
    explained: Array
    by_row: Array
    G: Array
    left: Array
    z: Array
    scale: Array

    def derivative(self, column: Indices, size: Array) -> Array:
        """Of x, to first order at constant scales: dz = G (dM^T M + M^T dM) z.

        Args:
            column: Column of the entry that moves in each row, shape (r,).
            size: How far it moves, shape (r,).

        Returns:
            Shape (m, r).
        """
        dz = self.by_row * self.z[column] + self.G[:, column] * self.left
        dz = dz * (size / self.scale[column]) / self.scale[:, None]
        return (dz - np.outer(self.x, dz[-1])) * (self.scale[-1] / self.z[-1])


def null_vector(M: Array, scale: Array, *, rank_tol: float) -> NullVector:
    """Find the null vector by singular values.

    Args:
        M: Equations `M x = 0`, shape (r, m).
        scale: By which columns are divided, shape (m,).
        rank_tol: Smallest relative singular value that counts, and smallest last entry.

    Raises:
        NotIdentifiable: If there are several null vectors, or the last column has no part in it.
    """
    Q, R = linalg.qr(M / scale, mode="economic", check_finite=False)
    U, s, Vt = np.linalg.svd(R)
    z, others = Vt[-1], Vt[:-1].T
    if s[-2] <= rank_tol * s[0] or abs(z[-1]) <= rank_tol:
        raise NotIdentifiable("the gains are not unique; record a more exciting motion, or a payload")
    explained = np.asarray(Q @ U[:, :-1], np.float64)
    gap = s[-1] ** 2 - s[:-1] ** 2
    return NullVector(
        x=z / z[-1] * (scale[-1] / scale),
        explained=explained,
        by_row=(others * (s[:-1] / gap)) @ explained.T,
        G=(others / gap) @ others.T,
        left=np.asarray(s[-1] * (Q @ U[:, -1]), np.float64),
        z=z,
        scale=scale,
    )
