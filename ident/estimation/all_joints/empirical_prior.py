"""Empirical Bayes: the normal distribution of a parameter over an arm's drives, from noisy estimates of each joint."""

from dataclasses import dataclass

import numpy as np

from ident.support.arrays import Array

LEAST_STD, BEGIN, MOST_STD = 1e-3, 1e-2, 1.0
"""Smallest standard deviation, the one at which the search is split, and the largest."""
MEANS = (0.0, 1.0)
"""Smallest and largest mean."""
SETTLED = 1e-13
"""Tolerance of the logarithm of the standard deviation."""


@dataclass(frozen=True, slots=True)
class Belief:
    """A normal prior of a parameter."""

    mean: float
    std: float


def likeliest(seen: Array, noise: Array) -> Belief:
    """Return the normal distribution of maximum likelihood.

    Args:
        seen: Noisy values, shape (k,).
        noise: Standard deviation of the noise of each, positive, shape (k,).
    """
    ends = (LEAST_STD, BEGIN) if likelihood_slope(seen, noise, BEGIN) > 0.0 else (BEGIN, MOST_STD)
    slopes = [likelihood_slope(seen, noise, std) for std in ends]
    if slopes[0] >= 0.0 or slopes[1] <= 0.0:
        std = ends[0] if slopes[0] >= 0.0 else ends[1]
    else:
        low, high = np.log(ends).tolist()
        while high - low > SETTLED:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if likelihood_slope(seen, noise, float(np.exp(middle))) < 0.0 else (low, middle)
        std = float(np.exp(0.5 * (low + high)))
    return Belief(_mean(seen, noise, std), std)


def likelihood_slope(seen: Array, noise: Array, std: float) -> float:
    """Derivative of -2 log L by log std, at the most likely mean.

    -2 log L = sum log v + (x - mean)^2 / v, v = noise^2 + std^2. If its derivative by the mean is not zero, the mean is
    at a limit of `MEANS`; so a change of the mean does not contribute.
    """
    v = noise**2 + std**2
    return float(np.sum((1.0 - (seen - _mean(seen, noise, std)) ** 2 / v) / v)) * 2.0 * std**2


def _mean(seen: Array, noise: Array, std: float) -> float:
    weight = 1.0 / (noise**2 + std**2)
    return float(np.clip(weight @ seen / weight.sum(), *MEANS))
