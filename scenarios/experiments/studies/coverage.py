"""How often intervals held the truth, and how wide they were for it."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import stats

from ident.support.arrays import Mask
from scenarios.experiments.studies.joint_rows import JointRows
from scenarios.experiments.studies.statistics import JointStatistics

CONFIDENCE = 0.95
"""Of the intervals of coverages."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Coverage:
    """How often an interval held the truth.

    Attributes:
        share: Share of the trials with a gain and a deviation.
        low, high: Ends of the 95 % interval of that share (Clopper and Pearson).
    """

    share: float
    low: float
    high: float


def coverage(held: Mask) -> Coverage | None:
    """How often intervals held the truth, None without any."""
    if not len(held):
        return None
    count = int(held.sum())
    interval = stats.binomtest(count, len(held)).proportion_ci(CONFIDENCE, method="exact")
    return Coverage(share=count / len(held), low=float(interval.low), high=float(interval.high))


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """Where a coverage is wanted, both ends included."""

    low: float
    high: float

    def side(self, found: Coverage) -> Literal["inside", "below", "above"]:
        """Where the share lies."""
        if found.share < self.low:
            return "below"
        return "above" if found.share > self.high else "inside"

    def reached_by(self, found: Coverage) -> bool:
        """Whether the interval of the share has a value that is wanted."""
        return found.low <= self.high and found.high >= self.low


@dataclass(frozen=True, slots=True, kw_only=True)
class JointClaims:
    """What the trials of a study say of one joint's intervals; None where no trial gave a gain.

    Attributes:
        statistics: Errors, refusals, failures.
        gains: Trials that gave one.
        largest: Largest magnitude of the relative error.
        cover_1, cover_2: How often 1 and 2 claimed deviations held the truth (normal: 0.683 and 0.954).
        width: Median of the claimed relative deviation over the spread of the relative error.
    """

    statistics: JointStatistics
    gains: int
    largest: float | None
    cover_1: Coverage | None
    cover_2: Coverage | None
    width: float | None


def joint_claims(rows: JointRows, statistics: JointStatistics) -> JointClaims:
    """Sum up the intervals of one joint.

    Args:
        rows: Of the joint.
        statistics: From the same rows.
    """
    spread = statistics.spread
    return JointClaims(
        statistics=statistics,
        gains=rows.gains,
        largest=float(np.abs(rows.rel_error).max()) if rows.gains else None,
        cover_1=coverage(np.abs(rows.z) < 1.0),
        cover_2=coverage(np.abs(rows.z) < 2.0),
        width=float(np.median(rows.claimed)) / spread if spread else None,
    )
