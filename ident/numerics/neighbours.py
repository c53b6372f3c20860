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
    near = np.lib.stride_tricks.sliding_window_view(np.pad(x, reach, mode="edge"), 2 * reach + 1)
    return np.partition(near, reach, axis=1)[:, reach]


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
