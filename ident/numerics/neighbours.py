"""Medians, neighbourhoods of samples, dilated masks, runs, and the quantum of a column."""

import numpy as np

from ident.support.arrays import Array, Indices, Mask

DIGITS = 1e-9
"""Share of the largest step below which two values are equal up to rounding."""
WHOLE = 0.02
"""Largest deviation from a whole number of quanta due to rounding in a file, in quanta."""
SHARE = 0.99
"""Required share of samples that are whole numbers of quanta."""


def median(x: Array) -> Array:
    """Return the median along the last axis; NaN is not looked for, which takes `np.median` most of its time."""
    half = x.shape[-1] // 2
    parts = np.partition(x, half)
    upper = parts[..., half]
    return upper if x.shape[-1] % 2 else 0.5 * (parts[..., :half].max(axis=-1) + upper)


def running_median(x: Array, reach: int) -> Array:
    """Return the median of `reach` samples to either side, shape (N,); the ends are extended by the outer values."""
    padded = np.pad(x, reach, mode="edge")
    near = [padded[k : k + len(x)] for k in range(2 * reach + 1)]
    for last in range(2 * reach, reach - 1, -1):  # the largest of the first last + 1 values moves to their end
        for k in range(last):
            near[k], near[k + 1] = np.minimum(near[k], near[k + 1]), np.maximum(near[k], near[k + 1])
    return near[reach]


def widened(marked: Mask, reach: int) -> Mask:
    """Return a mask, shape (N, n), dilated by `reach` samples to either side."""
    before = np.cumsum(np.pad(marked, ((reach + 1, reach), (0, 0))), axis=0, dtype=np.intp)
    return before[2 * reach + 1 :] > before[: -2 * reach - 1]


def quantum(x: Array) -> float | None:
    """Return the quantum of the values of a column, shape (N,); None if there is none."""
    step = np.diff(np.unique(x))
    step = step[step > DIGITS * step.max(initial=0.0)]
    if len(step) < 2 or 2 * (len(step) + 1) >= len(x) + 2:
        return None
    least = float(step.min())
    several = step / np.rint(step / least)  # single steps are rounded by the file, but not their mean
    least = float(np.sum(np.rint(step / least) * several) / np.sum(np.rint(step / least)))
    off = np.abs(step / least - np.rint(step / least))
    return least if float(np.mean(off < WHOLE)) > SHARE else None


def runs(at: Mask) -> tuple[Indices, Indices]:
    """Return the first sample of each run of true samples, and the one after its last."""
    edges = np.diff(np.concatenate(([0], at.astype(np.int8), [0])))
    return np.flatnonzero(edges > 0), np.flatnonzero(edges < 0)


def long_runs(at: Mask, least: int) -> Mask:
    """Return a mask of samples in runs of at least a number of true ones."""
    found = np.zeros_like(at)
    for start, end in zip(*runs(at), strict=True):
        found[start:end] = end - start >= least
    return found
