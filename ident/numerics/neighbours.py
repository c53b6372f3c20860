"""What samples near each sample say: their median, and whether one of them is marked."""

import numpy as np

from ident.support.arrays import Array, Mask


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
