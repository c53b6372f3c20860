"""The intervals of a log's clock: which of them miss samples, and how even the others are."""

from dataclasses import dataclass

import numpy as np

from ident.arrays import Array

LOST = 1.5
"""Interval, in medians, from which on a sample is missing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Intervals:
    """What time stamps say of the samples between them.

    Attributes:
        usual: Median interval [s].
        mean: Of those that miss nothing [s].
        jitter: Largest deviation of one of these from the median, as a share of it.
        lost: Samples that are missing.
        gaps: Intervals that miss some.
    """

    usual: float
    mean: float
    jitter: float
    lost: int
    gaps: int


def intervals_of(t: Array) -> Intervals:
    """What sample times [s], shape (N,), say."""
    intervals = np.diff(t)
    usual = float(np.median(intervals))
    missing = np.rint(intervals / usual - 1.0) * (intervals > LOST * usual)
    even = intervals[missing == 0.0]
    return Intervals(
        usual=usual,
        mean=float(even.mean()),
        jitter=float(np.abs(even / usual - 1.0).max(initial=0.0)),
        lost=int(missing.sum()),
        gaps=int((missing > 0.0).sum()),
    )
