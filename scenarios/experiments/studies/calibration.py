"""Whether claimed deviations are honest as a whole: the ranks of z, which are uniform where they are.

The curve is the distribution function of the ranks less the uniform one. Its band holds the whole curve of honest
claims at once with a stated chance, after Säilynoja, Bürkner and Vehtari (Statistics and Computing 32, 2022, algorithm
1): of simulated curves, at every point the k-th smallest and the k-th largest value, with the largest k that leaves
enough of the curves inside everywhere. Several joints in one curve err together within a trial, and are simulated so.
"""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from ident.support.arrays import Array, Mask

GRID = np.arange(1, 100) / 100.0
"""Ranks at which curve and band are taken, shape (K,)."""
AT_ONCE = 2**20
"""Numbers that are drawn at once."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Band:
    """Where the curve of honest claims stays, at every point of `GRID` at once; shapes (K,)."""

    low: Array
    high: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Calibration:
    """The ranks of one joint, or of several together.

    Attributes:
        trials: Trials that have every z.
        difference: Share of ranks up to each point of `GRID`, less that point, shape (K,).
        band: Where the curve of honest claims stays.
    """

    trials: int
    difference: Array
    band: Band

    @property
    def outside(self) -> Mask:
        """Points of `GRID` at which the curve leaves the band, shape (K,)."""
        return (self.difference < self.band.low) | (self.difference > self.band.high)


def calibration(z: Array, *, level: float, draws: int, rng: np.random.Generator) -> Calibration:
    """Hold z against the standard normal distribution.

    Args:
        z: Error over claimed deviation, a row a trial, a column a joint, shape (T, m), T >= 2.
        level: Chance that the band holds the whole curve of honest claims.
        draws: Simulated curves.
        rng: Of these.
    """
    correlation = np.atleast_2d(np.corrcoef(z, rowvar=False))
    band = simultaneous_band(correlation, len(z), level=level, draws=draws, rng=rng)
    return Calibration(trials=len(z), difference=_differences(z[None])[0], band=band)


def simultaneous_band(correlation: Array, trials: int, *, level: float, draws: int, rng: np.random.Generator) -> Band:
    """The band of honest claims.

    Args:
        correlation: Of the joints' z within a trial, shape (m, m).
        trials: Trials in a curve.
        level: Chance that the band holds a whole curve.
        draws: Simulated curves; the level is known to sqrt(level (1 - level) / draws).
        rng: Of these.
    """
    curves = np.concatenate(
        [_differences(_honest(correlation, trials, some, rng)) for some in _chunks(draws, trials * len(correlation))]
    )  # (draws, K)
    ordered = np.sort(curves, axis=0)
    columns = list(zip(ordered.T, curves.T, strict=True))
    below = np.array([np.searchsorted(column, values, side="right") for column, values in columns])  # (K, draws)
    above = draws - np.array([np.searchsorted(column, values, side="left") for column, values in columns])
    k = int(np.quantile(np.minimum(below, above).min(axis=0), 1.0 - level, method="lower"))
    return Band(low=ordered[k - 1], high=ordered[draws - k])


def _honest(correlation: Array, trials: int, draws: int, rng: np.random.Generator) -> Array:
    """Draw z of honest claims, shape (draws, trials, m)."""
    return rng.multivariate_normal(np.zeros(len(correlation)), correlation, (draws, trials), method="eigh")


def _chunks(draws: int, width: int) -> list[int]:
    """Draws by as many as are made at once."""
    most = max(1, AT_ONCE // width)
    return [min(most, draws - start) for start in range(0, draws, most)]


def _differences(z: Array) -> Array:
    """Distribution function of the ranks of z less the uniform one, of shape (D, T, m) the shape (D, K)."""
    D, K = len(z), len(GRID)
    cell = np.searchsorted(stats.norm.ppf(GRID), z.reshape(D, -1))  # 0..K, the first point not below the rank
    counts = np.bincount((cell + (K + 1) * np.arange(D)[:, None]).ravel(), minlength=D * (K + 1)).reshape(D, K + 1)
    return np.cumsum(counts, axis=1)[:, :K] / z[0].size - GRID
