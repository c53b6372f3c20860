"""Drive gains of all joints by total least squares, scaled by the known payload (Gautier, Vandanjon et al. 2014).

The null vector of the homogeneous equations of all joints, with the known payload as a column, is normalised to a
payload coefficient of one. Rows are scaled joint by joint, columns to unit norm. Total least squares is consistent only
if all scaled columns are equally noisy. On a robot only the currents are noisy, so gains can have errors of tens of
percent or be negative; their standard deviations show this, and such joints are refused.
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
        problem: Motions, bare and loaded; all known parameters of a payload are used.
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
    """Return the null vector of the nonzero columns, that of the known payload last."""
    rank_tol = system.problem.options.rank_tol
    chosen = _independent(system, rank_tol)
    M = np.column_stack((system.H[:, chosen], -system.k))
    found = null_vector(M, np.linalg.norm(M, axis=0), rank_tol=rank_tol)

    def whole(part: Array) -> Array:
        """Remove the payload's coefficient, and insert zeros for omitted columns."""
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
    """Nonzero columns of H of which those other than currents are independent, in order."""
    n = system.n
    currents = np.flatnonzero(system.H[:, :n].any(axis=0))
    return np.concatenate((currents, n + np.sort(factors(system.H[:, n:], rank_tol=rank_tol).columns)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NullVector:
    """The x, its last entry 1, for which M / scale has the smallest product of its norm with that of `scale x`.

    Attributes:
        x: Shape (m,).
        explained: Orthonormal columns that span the rest of M, shape (r, m - 1).
        by_row: G M^T, shape (m, r); G is the sum of v_k v_k^T / (s^2 - s_k^2) over the other singular vectors.
        G: Shape (m, m).
        left: M x of the unit vector z, shape (r,).
        z: The singular vector, shape (m,).
        scale: Scale of the columns, shape (m,).
    """

    x: Array
    explained: Array
    by_row: Array
    G: Array
    left: Array
    z: Array
    scale: Array

    def derivative(self, column: Indices, size: Array) -> Array:
        """Derivative of x, to first order at constant scales: dz = G (dM^T M + M^T dM) z.

        Args:
            column: Column of the entry that changes in each row, shape (r,).
            size: Its change, shape (r,).

        Returns:
            Shape (m, r).
        """
        dz = self.by_row * self.z[column] + self.G[:, column] * self.left
        dz = dz * (size / self.scale[column]) / self.scale[:, None]
        return (dz - np.outer(self.x, dz[-1])) * (self.scale[-1] / self.z[-1])


def null_vector(M: Array, scale: Array, *, rank_tol: float) -> NullVector:
    """Return the null vector by singular value decomposition.

    Args:
        M: Equations `M x = 0`, shape (r, m).
        scale: Divisor of each column, shape (m,).
        rank_tol: Smallest relative singular value, and smallest last entry, that count as nonzero.

    Raises:
        NotIdentifiable: If there are several null vectors, or the last entry is zero.
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
