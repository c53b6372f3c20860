"""The standard normal distribution."""

from math import erfc, sqrt
from statistics import NormalDist


def normal_cdf(x: float) -> float:
    """Probability of a number below x, as exact in the lower tail as elsewhere."""
    return 0.5 * erfc(-x / sqrt(2.0))


def normal_quantile(p: float) -> float:
    """The number below which others are with a probability p, between 0 and 1 (M. J. Wichura, AS 241, 1988)."""
    return NormalDist().inv_cdf(p)
