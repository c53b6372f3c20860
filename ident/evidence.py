"""When one reading of a log explains its currents surely better than another.

What two readings leave of each joint's current is compared by logarithms, in sum over the joints; times the instants
more than unknowns that a joint has, the sum is the logarithm of the likelihood ratio of white residuals.
"""

from collections.abc import Sequence

import numpy as np

from ident.arrays import Array, Indices, Mask
from ident.readings import Reading

BETTER = 0.05
"""Sum of logarithms on many instants to be believed whatever their number (`docs/derivations.md`)."""
EVIDENCE, LENGTH_EVIDENCE = 45.0, 25.0
"""Logarithm of the likelihood ratio, of white residuals, that it takes besides, and for another length.

A short log is explained by anything, and what a friction model lacks is not white: a right reading reached 36, none by
other lengths 1.
"""
TIE = 0.01
"""Sum of logarithms within which readings are equally good: they describe one arm, or none can tell."""
NOTHING = 1e-3
"""Share of a current below which nothing is left to explain; filters leave as much of exact data."""


def gain_over(own_left: Array, left: Array) -> Array:
    """Logarithm of what the log as it is leaves of each current over what another reading leaves, shape (n,).

    Args:
        own_left: Shares that the log as it is leaves, infinite where too few instants tell, shape (n,).
        left: The same of the other reading.

    Returns:
        Gains; zero where too few instants tell.
    """
    known = np.isfinite(own_left) & np.isfinite(left)
    before, after = (np.where(known, np.maximum(each, NOTHING), 1.0) for each in (own_left, left))
    return np.log(before / after)


def evidence_of(gain: Array, own_freedom: Indices, freedom: Indices) -> float:
    """Logarithm of the likelihood ratio, each current with the fewer instants to spare of the two readings.

    Args:
        gain: By `gain_over`, shape (n,).
        own_freedom: Instants more than unknowns under the log as it is, shape (n,).
        freedom: The same under the other reading.
    """
    return float(gain @ np.minimum(own_freedom, freedom))


def convincing(gain: Array, evidence: float, reading: Reading) -> bool:
    """Whether a reading is surely better than the log as it is.

    Args:
        gain: By `gain_over`, shape (n,).
        evidence: By `evidence_of`.
        reading: The reading; one of other lengths takes less.
    """
    least = EVIDENCE if (reading.stretch == 1.0).all() else LENGTH_EVIDENCE
    return bool(gain.sum() > BETTER and evidence > least)


def among_best(gains: Sequence[Array]) -> Mask:
    """Which of several readings are within a tie of the best one.

    Args:
        gains: By `gain_over`, each of shape (n,).
    """
    total = np.array([float(gain.sum()) for gain in gains])
    return total > total.max(initial=-np.inf) - TIE
