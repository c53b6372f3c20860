"""Power densities of signals, averaged over blocks (P. D. Welch, IEEE Trans. Audio Electroacoustics 15(2), 1967)."""

import numpy as np

from ident.support.arrays import Array


def hann_window(size: int) -> Array:
    """The window (1 - cos(2 pi k / size)) / 2, periodic, shape (size,)."""
    return np.hanning(size + 1)[:-1]


def power_density(x: Array, period: float, size: int) -> tuple[Array, Array]:
    """One-sided power density of signals: mean of those of half-overlapping blocks, the mean of each taken off.

    Args:
        x: Signals, shape (N, n), on a uniform clock.
        period: Sampling interval [s].
        size: Samples in a block, at most N.

    Returns:
        Frequencies [Hz], shape (size // 2 + 1,), and densities [unit^2/Hz], shape (size // 2 + 1, n).
    """
    window = hann_window(size)
    blocks = np.lib.stride_tricks.sliding_window_view(x, size, axis=0)[:: size - size // 2]  # (blocks, n, size)
    spectrum = np.fft.rfft((blocks - blocks.mean(axis=2, keepdims=True)) * window)
    power = np.mean(np.abs(spectrum) ** 2, axis=0).T * (period / np.sum(window**2))
    power[1 : None if size % 2 else -1] *= 2.0  # what negative frequencies have
    return np.asarray(np.fft.rfftfreq(size, period), np.float64), power
