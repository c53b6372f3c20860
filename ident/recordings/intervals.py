"""The intervals of a log's clock: which of them miss samples, and how even the others are.

Where a sample is missing, all stamps after it are later by a period for good. Where a stamp is only late, as by jitter,
those after it are on time: jitter shortens intervals as much as it lengthens others. So samples are missing in a long
interval if no jitter is as large, by the shortest interval, or if the stamps after it stay late.
"""

from dataclasses import dataclass

import numpy as np

from ident.recordings.recording import LARGEST_GAP
from ident.support.arrays import Array, Indices

LOST = 1.5
"""Interval, in medians, from which on a sample may be missing: nearer to two periods than to one."""
BESIDE = 10
"""Stamps to either side of an interval, the medians of whose lateness are compared."""
SURE = 3.0
"""Deviations of such a comparison by which it must exceed half a period."""
ROUNDS = 3
"""Times that all intervals are judged, each time with what was found of those beside them."""
DEVIATION = 1.4826
"""Standard deviation of a normal variable over its median size."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Intervals:
    """What time stamps say of the samples between them.

    Attributes:
        usual: Median interval [s].
        mean: Of those that miss nothing [s].
        jitter: Largest deviation of one of these from the median, as a share of it.
        missing: Samples missing in each interval, shape (N - 1,).
    """

    usual: float
    mean: float
    jitter: float
    missing: Indices

    @property
    def lost(self) -> int:
        """Samples that are missing."""
        return int(self.missing.sum())

    @property
    def gaps(self) -> int:
        """Intervals that miss some."""
        return int((self.missing > 0).sum())


def intervals_of(t: Array) -> Intervals:
    """What sample times [s], shape (N,), say."""
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
    """Samples missing in intervals that take so many periods, shape (N - 1,)."""
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
    """How much later the stamps after each interval are than those before, for their number, shape (N - 1,)."""
    t = np.concatenate(([0.0], np.cumsum(periods)))  # (N,)
    beside = min(BESIDE, len(periods))
    late = t - np.median(t[beside:] - t[:-beside]) / beside * np.arange(len(t))
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(late, beside - 1, mode="edge"), beside)
    level = np.median(windows, axis=1)  # (N + beside - 1,), of the stamps up to each
    return level[beside:] - level[: len(periods)]
