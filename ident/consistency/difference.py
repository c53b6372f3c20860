"""Two estimates from parts of the same rows: the deviation of their difference, and what is too much of it."""

from collections.abc import Mapping

import numpy as np
import scipy

from ident.arrays import Array
from ident.consistency.evidence import Evidence
from ident.consistency.finding import Finding
from ident.consistency.stretches import stretches

FALSE_ALARM = 0.002
"""Probability, all joints together, that a test fails on data that are as the model says."""
DIFFERENT = 1e-6
"""Deviation of a difference, over that of the gain itself, under which the two estimates are one."""
FREEDOM = 38
"""Degrees of freedom of a deviation that stretches of two motions give (`uncertainty.jackknife`)."""
MATTERS = 0.5
"""Difference in claimed deviations of the gain from which it is worth a word, as of all that bends a gain."""


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
    sigma = np.empty(len(residual))
    for joint in rows.unknowns:
        own = rows.of(joint)
        whole = float(np.linalg.norm(rows.residual[own]))
        sigma[own] = evidence.sigma[own] * float(np.linalg.norm(residual[own])) / whole
    white = np.linalg.norm(influence * sigma)
    lasting = np.linalg.norm(stretches((influence * residual)[:, None], rows.motion, rows.position))
    freedom = 1.0 - sum(rows.unknowns.values()) / len(rows.V)
    return float(np.hypot(max(white, lasting / np.sqrt(freedom)), np.linalg.norm(influence @ evidence.stated)))


def most_deviations(tests: int) -> float:
    """Deviations that the largest of so many differences exceeds by accident with `FALSE_ALARM` (Bonferroni)."""
    return float(scipy.stats.t.isf(FALSE_ALARM / (2.0 * tests), FREEDOM))


def judged_difference(
    check: str,
    z: Mapping[int, float],
    change: Mapping[int, float],
    words: tuple[str, str],
    reason: str,
    *,
    claimed: Mapping[int, float],
) -> Finding | None:
    """The finding of a test that compares two gains of each joint; None where no joint has two.

    Args:
        check: Name of the test.
        z: Difference of each joint in standard deviations.
        change: The same in percent of the gain.
        words: What gives the other gain, and what it is compared with.
        reason: What to suspect.
        claimed: Relative deviation that is claimed of each gain; a difference of less than `MATTERS` of it is not told.
    """
    if not z:
        return None
    limit = most_deviations(len(z))
    told_of = [each for each in z if z[each] > limit and abs(change[each]) > 100.0 * MATTERS * claimed[each]]
    worst = max(told_of or z, key=lambda joint: z[joint])
    side = "larger" if change[worst] > 0.0 else "smaller"
    told = (
        f"joint {worst + 1}: {words[0]} a gain {abs(change[worst]):.2g} % {side} {words[1]}, by {z[worst]:.2g} "
        f"standard deviations of that difference ({limit:.2g} on any of {len(z)} joints are an accident once in "
        f"{1.0 / FALSE_ALARM:.0f} times); {reason}"
    )
    return Finding(
        check=check,
        joint=worst,
        statistic=z[worst],
        threshold=limit,
        measure="standard deviations",
        sentence=told if told_of else None,
        change=change[worst],
    )
