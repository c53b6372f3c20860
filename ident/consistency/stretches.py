"""Sums over stretches of time, which errors that last make larger than unrelated ones do."""

import numpy as np

from ident.arrays import Array, Indices
from ident.uncertainty.jackknife import BLOCKS


def stretches(terms: Array, motion: Indices, position: Indices) -> Array:
    """Sums over the stretches of each motion, all joints together, shape (stretches, c)."""
    number = np.empty(len(terms), dtype=np.intp)
    for count, which in enumerate(np.unique(motion)):
        at = position[motion == which]
        number[motion == which] = count * BLOCKS + (at - at.min()) * BLOCKS // (at.max() - at.min() + 1)
    return np.stack([np.bincount(number, weights=each).astype(np.float64) for each in terms.T], axis=1)
