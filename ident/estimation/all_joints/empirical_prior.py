"""The normal distribution that numbers of known noise most likely come from: what joints say of an arm's drives."""

from dataclasses import dataclass

import numpy as np

from ident.support.arrays import Array

LEAST_STD, BEGIN, MOST_STD = 1e-3, 1e-2, 1.0
"""Deviations that are believed, and the one on whose better side the likeliest is looked for."""
MEANS = (0.0, 1.0)
"""Least and largest mean that is believed."""
SETTLED = 1e-13
"""Error of the logarithm of the deviation that is left."""


@dataclass(frozen=True, slots=True)
class Belief:
    """Mean and deviation of what is believed of a number."""

    mean: float
    std: float


def likeliest(seen: Array, noise: Array) -> Belief:
    """The normal distribution under which values are likeliest.

    Args:
        seen: Values, shape (k,).
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
    """Derivative of -2 log L by log std, the mean at its likeliest.

    -2 log L = sum log v + (x - mean)^2 / v, v = noise^2 + std^2. Where its derivative by the mean is not zero, the mean
    stands at an end of `MEANS`, so that a change of the mean has no part in it.
    """
    v = noise**2 + std**2
    return float(np.sum((1.0 - (seen - _mean(seen, noise, std)) ** 2 / v) / v)) * 2.0 * std**2


def _mean(seen: Array, noise: Array, std: float) -> float:
    weight = 1.0 / (noise**2 + std**2)
    return float(np.clip(weight @ seen / weight.sum(), *MEANS))
