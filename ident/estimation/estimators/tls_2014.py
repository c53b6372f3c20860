"""Drive gains of all joints by total least squares, scaled by the known payload (Gautier, Vandanjon et al. 2014).

The null vector of the homogeneous equations of all joints, the known payload among the columns, is normalised so that
the payload's coefficient is one. Rows are scaled joint by joint, columns to unit norm. Total least squares is
consistent only if all scaled columns are equally noisy; of a robot the currents alone are noisy, so that gains may be
off by tens of percent, or negative; its deviations know it and joints are refused.
"""

import numpy as np

from ident.estimation.estimate import GainEstimate
from ident.estimation.homogeneous.null_vector import null_vector
from ident.estimation.homogeneous.solved import Unknowns, gain_solution
from ident.estimation.homogeneous.system import HomogeneousSystem, homogeneous_system
from ident.estimation.homogeneous.weights import HomogeneousOptions
from ident.estimation.identifiability import judge_identifiability
from ident.estimation.problem import Problem
from ident.numerics.least_squares import factors
from ident.support.arrays import Array, Indices

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
