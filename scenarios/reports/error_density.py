"""The errors of a joint in a study beside the density that its claimed deviations promise, as numbers to be drawn."""

from collections.abc import Sequence

import numpy as np
from scipy import stats

from ident.support.arrays import Array
from scenarios.experiments.studies.joint_rows import JointRows

MOST = 500
"""Claimed deviations that a density is the mean of, at least if there are as many."""


def panels(joints: Sequence[JointRows]) -> dict[int, JointRows]:
    """Joints with a gain whose errors differ, two at least."""
    return {rows.joint: rows for rows in joints if varies(rows.rel_error)}


def varies(values: Array) -> bool:
    """Whether values are spread over more than their rounding."""
    return len(values) > 1 and bool(np.ptp(values) > 1e-9 * np.abs(values).max())


def reach(rows: JointRows) -> float:
    """How far errors, or the density that is claimed, reach [%]."""
    return 110.0 * max(float(np.abs(rows.rel_error).max()), 3.0 * float(np.median(rows.claimed)))


def promised(rows: JointRows, x: Array) -> Array:
    """Mean of the normal densities that the claimed deviations are of [1/%]. Errors `x` are in %, shape (k,).

    Returns:
        Shape (k,).
    """
    some = 100.0 * rows.claimed[:: max(1, len(rows.claimed) // MOST)]
    return stats.norm.pdf(x[:, None], scale=some).mean(axis=1)
