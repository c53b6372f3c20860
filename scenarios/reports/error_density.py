"""Errors of a joint in a study, and the density that its estimated standard deviations imply, as data of a plot."""

from collections.abc import Sequence

import numpy as np
from scipy import stats

from ident.support.arrays import Array
from scenarios.experiments.statistics import JointRows

MOST = 500
"""Least number of estimated standard deviations in the mean density, if available."""


def panels(joints: Sequence[JointRows]) -> dict[int, JointRows]:
    """Return the joints with at least two different errors."""
    return {rows.joint: rows for rows in joints if varies(rows.rel_error)}


def varies(values: Array) -> bool:
    """Return whether the variation of values exceeds their rounding."""
    return len(values) > 1 and bool(np.ptp(values) > 1e-9 * np.abs(values).max())


def reach(rows: JointRows) -> float:
    """Return the range of errors and of the implied density [%]."""
    return 110.0 * max(float(np.abs(rows.rel_error).max()), 3.0 * float(np.median(rows.claimed)))


def promised(rows: JointRows, x: Array) -> Array:
    """Return the mean normal density by the estimated standard deviations [1/%], at errors `x` [%], shape (k,)."""
    some = 100.0 * rows.claimed[:: max(1, len(rows.claimed) // MOST)]
    return stats.norm.pdf(x[:, None], scale=some).mean(axis=1)
