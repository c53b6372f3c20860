"""What the samples of a column say of each other: medians and marks nearby, runs, and the step that all share."""

import numpy as np

from ident.support.arrays import Array, Indices, Mask

DIGITS = 1e-9
"""Share of the largest step below which two values are one, written in two ways."""
WHOLE = 0.02
"""Deviation from a whole number of quanta, as a share of one, that rounding of a file makes."""
SHARE = 0.99
"""Share of the samples that are whole numbers of quanta."""


def running_median(x: Array, reach: int) -> Array:
    """Median of each sample and those near it; the outer values stand in for what is missing at the ends.

    Args:
        x: Signal, shape (N,).
        reach: Samples to either side.

    Returns:
        Shape (N,).
    """
    padded = np.pad(x, reach, mode="edge")
    near = [padded[k : k + len(x)] for k in range(2 * reach + 1)]
    for last in range(2 * reach, reach - 1, -1):  # the largest of the first last + 1 moves to their end
        for k in range(last):
            near[k], near[k + 1] = np.minimum(near[k], near[k + 1]), np.maximum(near[k], near[k + 1])
    return near[reach]


def widened(marked: Mask, reach: int) -> Mask:
    """Samples of which one near is marked.

    Args:
        marked: Shape (N, n).
        reach: Samples to either side.

    Returns:
        Shape (N, n).
    """
    before = np.cumsum(np.pad(marked, ((reach + 1, reach), (0, 0))), axis=0, dtype=np.intp)
    return before[2 * reach + 1 :] > before[: -2 * reach - 1]


def quantum(x: Array) -> float | None:
    """The step that all values of a column are whole multiples of, shape (N,); None where there is none to be seen."""
    step = np.diff(np.unique(x))
    step = step[step > DIGITS * step.max(initial=0.0)]
    if len(step) < 2:
        return None
    least = float(step.min())
    several = step / np.rint(step / least)  # single steps are rounded by the file; their mean is not
    least = float(np.sum(np.rint(step / least) * several) / np.sum(np.rint(step / least)))
    off = np.abs(step / least - np.rint(step / least))
    return least if float(np.mean(off < WHOLE)) > SHARE and 2 * (len(step) + 1) < len(x) + 2 else None


def runs(at: Mask) -> tuple[Indices, Indices]:
    """First sample of each run of true samples, and the one after its last."""
    edges = np.diff(np.concatenate(([0], at.astype(np.int8), [0])))
    return np.flatnonzero(edges > 0), np.flatnonzero(edges < 0)


def long_runs(at: Mask, least: int) -> Mask:
    """Samples in runs of at least so many true ones."""
    found = np.zeros_like(at)
    for start, end in zip(*runs(at), strict=True):
        found[start:end] = end - start >= least
    return found
