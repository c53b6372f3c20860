"""The deviation of a difference between two estimates from parts of the same rows, and what is too many of them."""

import numpy as np
from scipy import stats

from ident.arrays import Array
from ident.consistency.evidence import Evidence
from ident.consistency.stretches import stretches

FALSE_ALARM = 0.002
"""Probability, all joints together, that a test fails on data that are as the model says."""
DIFFERENT = 1e-6
"""Deviation of a difference, over that of the gain itself, under which the two estimates are one."""
FREEDOM = 38
"""Degrees of freedom of a deviation that stretches of two motions give (`uncertainty.jackknife`)."""


def difference_std(evidence: Evidence, influence: Array, residual: Array) -> float:
    """Deviation of a difference between two estimates of a 1/g, what is stated of the payloads included.

    From the residual it is the larger of two: for unrelated ones (eq. 20), and for those that last, the root of the sum
    of squares over stretches of time. It takes residuals of the parts' own fits: those of all rows together hold the
    difference itself.

    Args:
        evidence: The estimate.
        influence: Derivative of the difference by the current of each row, shape (r,).
        residual: Of each row [drive units], shape (r,).
    """
    rows = evidence.estimate.solution.rows
    white = np.linalg.norm(influence * evidence.sigma)
    lasting = np.linalg.norm(stretches((influence * residual)[:, None], rows.motion, rows.position))
    freedom = 1.0 - sum(rows.unknowns.values()) / len(rows.V)
    return float(np.hypot(max(white, lasting / np.sqrt(freedom)), np.linalg.norm(influence @ evidence.stated)))


def most_deviations(tests: int) -> float:
    """Deviations that the largest of so many differences exceeds by accident with `FALSE_ALARM` (Bonferroni)."""
    return float(stats.t.isf(FALSE_ALARM / (2.0 * tests), FREEDOM))
