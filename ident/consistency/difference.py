"""The deviation of a difference between two estimates from parts of the same rows, and what is too many of them."""

import numpy as np
from scipy import stats

from ident.arrays import Array
from ident.consistency.evidence import Evidence

FALSE_ALARM = 0.005
"""Probability, all joints together, that a test fails on data that are as the model says."""
FREEDOM = 38
"""Degrees of freedom of a deviation that stretches of two motions give (`uncertainty.jackknife`)."""


def difference_std(evidence: Evidence, k: int, influence: Array) -> float:
    """Deviation of a difference between two estimates of a 1/g.

    Errors that last make it larger by as much as they do the deviation of the gain itself.

    Args:
        evidence: The estimate.
        k: Place of the 1/g in the solution.
        influence: Derivative of the difference by the current of each row, shape (r,).
    """
    plain = float(np.linalg.norm(influence * evidence.sigma)) * float(evidence.growth[k])
    return float(np.hypot(plain, np.linalg.norm(influence @ evidence.stated)))


def most_deviations(tests: int) -> float:
    """Deviations that the largest of so many differences exceeds by accident with `FALSE_ALARM` (Bonferroni)."""
    return float(stats.t.isf(FALSE_ALARM / (2.0 * tests), FREEDOM))
