"""The standard normal distribution."""

from math import erfc, sqrt
from statistics import NormalDist


def normal_cdf(x: float) -> float:
    """Return the probability of a number below x, accurate also in the lower tail."""
    return 0.5 * erfc(-x / sqrt(2.0))


def normal_quantile(p: float) -> float:
    """Return the quantile of a probability p, between 0 and 1 (M. J. Wichura, AS 241, 1988)."""
    return NormalDist().inv_cdf(p)
