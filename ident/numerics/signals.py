"""Zero-phase filtering: velocities and accelerations from positions, and parallel decimation (paper, II.C).

Both filters are linear and symmetric in time. Decimation is a banded matrix D, applied to the currents and to every
column of the regressor, and thus to both sides of the equation. Power densities are averaged over blocks (P. D. Welch,
IEEE Trans. Audio Electroacoustics 15(2), 1967).
"""

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ident.numerics.filters import butterworth, filtered_both_ways
from ident.support.arrays import Array

FILTER_ORDER = 4
SHARE_OF_RATE = 0.25
"""Highest cut-off relative to the sampling rate, at which central differences are exact to 2 %."""
KERNEL_CUTOFFS = 3.3
"""Length of the decimation kernel in periods of its cut-off, which is then the width of the transition band."""
SETTLING = 2.0
"""Duration of edge effects of a filtered recording, in periods of the cut-off."""
NOISE_BAND = (0.25, 0.45)
"""Frequency band that has only noise, relative to the sampling rate."""


def smooth_motion(q: Array, period: float, cutoff_hz: float) -> tuple[Array, Array, Array]:
    """Low-pass positions with zero phase and differentiate them (paper, II.C).

    Positions (N, n) [rad or m] are on a uniform clock of this period [s]; the cut-off [Hz] is that of `low_passed`.
    Five-point central differences are exact for polynomials of degree four (velocity) and five (acceleration). Returned
    are positions, velocities and accelerations, (N, n) each, of which the outer `edge_samples` are to be discarded.
    """
    smooth = low_passed(q, period, cutoff_hz).T  # (n, N), for the cache
    dq, ddq = np.zeros_like(smooth), np.zeros_like(smooth)
    m2, m1, c, p1, p2 = (smooth[:, k : smooth.shape[1] - 4 + k] for k in range(5))
    dq[:, 2:-2] = (8.0 * (p1 - m1) - (p2 - m2)) / (12.0 * period)
    ddq[:, 2:-2] = (16.0 * (p1 + m1) - (p2 + m2) - 30.0 * c) / (12.0 * period**2)
    return smooth.T, dq.T, ddq.T


def low_passed(x: Array, period: float, cutoff_hz: float) -> Array:
    """Low-pass signals (N, k) on a uniform clock with zero phase: a Butterworth filter of order 4, both ways.

    The period is in s; the cut-off [Hz], where a quarter of the power is left, is below the Nyquist frequency. The
    outer `edge_samples` have edge effects.
    """
    padding = min(len(x) - 1, 2 * edge_samples(period, cutoff_hz))
    return filtered_both_ways(butterworth(FILTER_ORDER, cutoff_hz, 1.0 / period), x, padding)


def low_passed_at(x: Array, period: float, cutoff_hz: float, samples: slice) -> Array:
    """The same at a few samples, from the impulse response, shape (samples, k)."""
    reach = min(len(x) - 1, 2 * edge_samples(period, cutoff_hz))
    impulse = np.zeros((4 * reach + 1, 1))
    impulse[2 * reach] = 1.0
    response = low_passed(impulse, period, cutoff_hz)[reach : 3 * reach + 1, 0]
    padded = np.pad(x, ((reach, reach), (0, 0)), mode="reflect", reflect_type="odd")
    return sliding_window_view(padded, len(response), axis=0)[samples] @ response


def edge_samples(period: float, cutoff_hz: float) -> int:
    """Return the number of samples with edge effects at each end of `smooth_motion`."""
    return 2 + int(np.ceil(SETTLING / (cutoff_hz * period)))


def noise_density(x: Array, period: float) -> Array:
    """Return the density of white noise in signals (N, n) of slow motion, from the upper half of their spectrum.

    It is a one-sided power density [unit^2/Hz], shape (n,): 2 sigma^2 period [s] for pure noise N(0, sigma^2).
    """
    bent = np.diff(x, 2, axis=0)  # differentiation reduces leakage from slow motion
    size = min(len(bent), 256)
    f = np.fft.rfftfreq(size)
    upper = (f > NOISE_BAND[0]) & (f < NOISE_BAND[1])
    power = power_density(bent, period, size)[1][upper]
    return np.median(power / (2.0 * np.sin(np.pi * f[upper, None])) ** 4, axis=0)


def delayed(x: Array, periods: float) -> Array:
    """Return signals (N, n) delayed by sampling periods, which may be negative, interpolated and held at the end."""
    if periods == 0.0:
        return x
    if periods < 0.0:
        return delayed(x[::-1], -periods)[::-1]
    whole = int(periods)
    share = periods - whole
    later = np.concatenate((np.repeat(x[:1], whole + 1, axis=0), x))[: len(x) + 1]
    return (1.0 - share) * later[1:] + share * later[:-1]


def group_means(x: Array, group: int) -> Array:
    """Return means of consecutive groups of samples, without a last incomplete group, shape (N // group, ...)."""
    if group == 1:
        return x
    whole = len(x) // group * group
    total = x[:whole:group].copy()
    for k in range(1, group):  # np.mean is slow over so short an axis
        total += x[k:whole:group]
    return total / group


@dataclass(frozen=True, slots=True, eq=False)
class Decimator:
    """Zero-phase low-pass that keeps one sample in `factor`: a banded Toeplitz matrix (paper, eq. 15)."""

    kernel: Array  # symmetric impulse response that sums to one, shape (2 h + 1,)
    factor: int  # n_d of the paper

    def rows(self, samples: int) -> int:
        """Return the number of rows of `samples` samples; the filter stays within the data."""
        return max(0, (samples - len(self.kernel)) // self.factor + 1)

    @property
    def overlap(self) -> int:
        """Number of earlier rows that depend on the first sample of a row."""
        return (len(self.kernel) - 1) // self.factor

    def applied(self, x: Array) -> Array:
        """Return the rows, shape (rows, ...), of one or more signals, shape (samples, ...).

        A row is a sum over groups of `factor` samples; each group is weighted for all its rows at once.
        """
        rows, pieces = self.rows(len(x)), self._pieces
        signals = x.reshape(len(x), -1)
        whole = min(rows + len(pieces) - 1, len(x) // self.factor)  # at most the last group is not
        parts = pieces @ signals[: whole * self.factor].reshape(whole, self.factor, -1)
        total = np.zeros((rows, signals.shape[1]))
        for k in range(len(pieces)):
            own = parts[k : min(k + rows, whole), k]
            total[: len(own)] += own
        if rows and whole < rows + len(pieces) - 1:
            rest = signals[whole * self.factor :]
            total[-1] += pieces[-1, : len(rest)] @ rest
        return total.reshape(rows, *x.shape[1:])

    def spread(self, weights: Array) -> Array:
        """Return weights of samples in a weighted sum of rows: `applied` transposed; later ones have no effect."""
        rows, pieces = len(weights), self._pieces
        of_samples = np.zeros((rows + len(pieces) - 1, self.factor))
        for k, piece in enumerate(pieces):
            of_samples[k : k + rows] += weights[:, None] * piece
        return of_samples.ravel()[: (rows - 1) * self.factor + len(self.kernel)]

    @property
    def _pieces(self) -> Array:
        """The kernel in groups of `factor` samples, shape (groups, factor), padded with zeros."""
        count = -(-len(self.kernel) // self.factor)
        return np.pad(self.kernel, (0, count * self.factor - len(self.kernel))).reshape(count, self.factor)

    def band(self, samples: int) -> Array:
        """Return weights of consecutive samples in all their rows, if a row begins with the first sample.

        Shape (overlap + rows that begin with one of the samples, samples).
        """
        begins = self.factor * np.arange(-self.overlap, -(-samples // self.factor))
        lag = np.arange(samples) - begins[:, None]
        inside = (lag >= 0) & (lag < len(self.kernel))
        return np.where(inside, self.kernel[np.where(inside, lag, 0)], 0.0)


def decimator(period: float, cutoff_hz: float, factor: int) -> Decimator:
    """Return the decimator with a Hamming-windowed sinc, for a sampling interval [s] and samples per row.

    The cut-off [Hz], of half the amplitude, is also the width of the transition band.
    """
    half = int(np.ceil(0.5 * KERNEL_CUTOFFS / (cutoff_hz * period)))
    kernel = np.hamming(2 * half + 1) * np.sinc(2.0 * cutoff_hz * period * np.arange(-half, half + 1))
    return Decimator(kernel / kernel.sum(), factor)


def power_density(x: Array, period: float, size: int) -> tuple[Array, Array]:
    """Return frequencies [Hz] and the one-sided power density [unit^2/Hz] of signals (N, n), shape (size // 2 + 1, n).

    It is a mean over half-overlapping blocks of `size` samples, at most N, each without its mean.
    """
    blocks = np.lib.stride_tricks.sliding_window_view(x, size, axis=0)[:: size - size // 2]  # (blocks, n, size)
    window = np.hanning(size + 1)[:-1]  # (1 - cos(2 pi k / size)) / 2
    spectrum = np.fft.rfft((blocks - blocks.mean(axis=2, keepdims=True)) * window)
    power = np.mean(np.abs(spectrum) ** 2, axis=0).T * (period / np.sum(window**2))
    power[1 : None if size % 2 else -1] *= 2.0  # contribution of negative frequencies
    return np.asarray(np.fft.rfftfreq(size, period), np.float64), power
