"""Intervals of a log's clock: missing samples and jitter.

After a missing sample, all stamps are later by a period. After a late stamp due to jitter, the following ones are on
time: jitter shortens intervals as much as it lengthens others. Samples are therefore missing in a long interval if it
exceeds the jitter indicated by the shortest interval, or if the following stamps stay late.
"""

from dataclasses import dataclass

import numpy as np

from ident.recordings.recording import LARGEST_GAP
from ident.support.arrays import Array, Indices

LOST = 1.5
"""Interval relative to the median above which a sample may be missing: nearer to two periods than to one."""
BESIDE = 10
"""Number of stamps to either side of an interval whose median delays are compared."""
SURE = 3.0
"""Number of standard deviations by which such a difference must exceed half a period."""
ROUNDS = 3
"""Number of iterations over all intervals, each with the results of the neighbours."""
DEVIATION = 1.4826
"""Ratio of a normal variable's standard deviation to its median magnitude."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Intervals:
    """Sampling intervals and missing samples of a log.

    Attributes:
        usual: Median interval [s].
        mean: Mean interval without missing samples [s].
        jitter: Largest deviation of such an interval from the median, relative to it.
        missing: Number of samples missing in each interval, shape (N - 1,).
    """

    usual: float
    mean: float
    jitter: float
    missing: Indices

    @property
    def lost(self) -> int:
        """Number of missing samples."""
        return int(self.missing.sum())

    @property
    def gaps(self) -> int:
        """Intervals with missing samples."""
        return int((self.missing > 0).sum())


def intervals_of(t: Array) -> Intervals:
    """Return the intervals of sample times [s], shape (N,)."""
    intervals = np.diff(t)
    usual = float(np.median(intervals))
    missing = _missing(intervals / usual)
    even = intervals[missing == 0]
    return Intervals(
        usual=usual,
        mean=float(even.mean()),
        jitter=float(np.abs(even / usual - 1.0).max(initial=0.0)),
        missing=missing,
    )


def _missing(periods: Array) -> Indices:
    """Return the number of samples missing in intervals, given in periods, shape (N - 1,)."""
    missing = supposed = np.where(periods > LOST, np.rint(periods - 1.0), 0.0)
    if not supposed.any():
        return supposed.astype(np.intp)
    short = 1.0 - float(periods.min())
    plain = (periods > LOST + short) & (short < LOST - 1.0) | (periods > LARGEST_GAP)
    for _ in range(ROUNDS):
        later = _later(periods - missing)
        spread = DEVIATION * np.median(np.abs(later))
        for_good = np.minimum(missing + later, supposed)
        missing = np.where(plain | (for_good > 0.5 + SURE * spread), supposed, 0.0)
    return missing.astype(np.intp)


def _later(periods: Array) -> Array:
    """Return the increase of the delay of stamps across each interval, shape (N - 1,)."""
    t = np.concatenate(([0.0], np.cumsum(periods)))  # (N,)
    beside = min(BESIDE, len(periods))
    late = t - np.median(t[beside:] - t[:-beside]) / beside * np.arange(len(t))
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(late, beside - 1, mode="edge"), beside)
    level = np.median(windows, axis=1)  # (N + beside - 1,), of the stamps up to each
    return level[beside:] - level[: len(periods)]
