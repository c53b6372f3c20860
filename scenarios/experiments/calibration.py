"""Calibration of estimated standard deviations: the ranks of z, which are uniform for correct ones.

The curve is the distribution function of the ranks minus the uniform one. The band contains the whole curve of correct
standard deviations with a given probability, after Säilynoja, Bürkner and Vehtari (Statistics and Computing 32, 2022,
algorithm 1): its ends are the k-th smallest and the k-th largest value of simulated curves at every point, with the
largest k for which enough curves are inside everywhere. Errors of several joints in one curve are correlated within a
trial, and simulated accordingly.
"""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from ident.support.arrays import Array, Mask

GRID = np.arange(1, 100) / 100.0
"""Ranks at which curve and band are evaluated, shape (K,)."""
AT_ONCE = 2**20
"""Number of random numbers drawn together."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Band:
    """Band of the curve of correct standard deviations, simultaneous over `GRID`; shapes (K,)."""

    low: Array
    high: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Calibration:
    """The ranks of one joint, or of several together.

    Attributes:
        trials: Number of trials with all z.
        difference: Share of ranks up to each point of `GRID`, minus that point, shape (K,).
        band: Band of the curve of correct standard deviations.
    """

    trials: int
    difference: Array
    band: Band

    @property
    def outside(self) -> Mask:
        """Points of `GRID` at which the curve leaves the band, shape (K,)."""
        return (self.difference < self.band.low) | (self.difference > self.band.high)


def calibration(z: Array, *, level: float, draws: int, rng: np.random.Generator) -> Calibration:
    """Compare z with the standard normal distribution.

    Args:
        z: Error over estimated standard deviation, one row per trial, one column per joint, shape (T, m), T >= 2.
        level: Probability that the band contains the whole curve of correct standard deviations.
        draws: Simulated curves.
        rng: Their random numbers.
    """
    correlation = np.atleast_2d(np.corrcoef(z, rowvar=False))
    band = simultaneous_band(correlation, len(z), level=level, draws=draws, rng=rng)
    return Calibration(trials=len(z), difference=_differences(z[None])[0], band=band)


def simultaneous_band(correlation: Array, trials: int, *, level: float, draws: int, rng: np.random.Generator) -> Band:
    """Return the band of correct standard deviations.

    Args:
        correlation: Correlation of the joints' z within a trial, shape (m, m).
        trials: Trials in a curve.
        level: Probability that the band contains a whole curve.
        draws: Simulated curves; the level is known to sqrt(level (1 - level) / draws).
        rng: Their random numbers.
    """
    m, most = len(correlation), max(1, AT_ONCE // (trials * len(correlation)))
    curves = np.concatenate(  # (draws, K)
        [
            _differences(
                rng.multivariate_normal(np.zeros(m), correlation, (min(most, draws - start), trials), method="eigh")
            )
            for start in range(0, draws, most)
        ]
    )
    ordered = np.sort(curves, axis=0)
    columns = list(zip(ordered.T, curves.T, strict=True))
    below = np.array([np.searchsorted(column, values, side="right") for column, values in columns])  # (K, draws)
    above = draws - np.array([np.searchsorted(column, values, side="left") for column, values in columns])
    k = int(np.quantile(np.minimum(below, above).min(axis=0), 1.0 - level, method="lower"))
    return Band(low=ordered[k - 1], high=ordered[draws - k])


def _differences(z: Array) -> Array:
    """Return the distribution function of the ranks of z, shape (D, T, m), minus the uniform one, shape (D, K)."""
    D, K = len(z), len(GRID)
    cell = np.searchsorted(stats.norm.ppf(GRID), z.reshape(D, -1))  # 0..K, the first point not below the rank
    counts = np.bincount((cell + (K + 1) * np.arange(D)[:, None]).ravel(), minlength=D * (K + 1)).reshape(D, K + 1)
    return np.cumsum(counts, axis=1)[:, :K] / z[0].size - GRID
