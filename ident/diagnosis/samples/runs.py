"""Runs of samples in a row."""

import numpy as np

from ident.support.arrays import Indices, Mask


def runs(at: Mask) -> tuple[Indices, Indices]:
    """First sample of each run of true samples, and the one after its last."""
    edges = np.diff(np.concatenate(([0], at.astype(np.int8), [0])))
    return np.flatnonzero(edges > 0), np.flatnonzero(edges < 0)


def long_runs(at: Mask, least: int) -> Mask:
    """Samples in runs of at least so many true ones."""
    found = np.zeros_like(at)
    for start, end in zip(*runs(at), strict=True):
        found[start:end] = end - start >= least
    return found
