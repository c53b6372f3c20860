"""Whether positions of a log, under a hypothesis, are within the limits of the arm."""

import numpy as np

from ident.diagnosis.logs import LogHypothesis
from ident.model.arm import Arm
from ident.recordings.recording import Recording
from ident.support.arrays import Array, once_per_object, readonly

SLACK = 0.1
"""Excess over a limit that is attributed to an error of the zero [rad or m]."""
TURNS = 4.0 * np.pi
"""Largest position of a joint without limits: two turns in either direction [rad]."""
STILL = 0.1
"""Range of a joint in exciting motions below which it counts as standing still [rad or m]."""


def beyond_limits(arm: Arm, log: Recording) -> tuple[int, ...]:
    """Joints, from 0, beyond their limits in a log; a revolute joint may be offset by whole turns."""
    low, high = _ends(log)
    return tuple(j for j in range(arm.n) if not _reached(arm, j, low, high))


def within_limits(arm: Arm, log: Recording, how: LogHypothesis) -> bool:
    """Whether, under a hypothesis that changes units, all joints are within their limits and move enough."""
    ends = how.q_factor * _ends(log)[:, how.q_order] + how.zero
    low, high = ends.min(axis=0), ends.max(axis=0)
    changed = np.abs(how.q_factor) != 1.0
    return all(_reached(arm, j, low, high) and high[j] - low[j] >= STILL for j in range(arm.n) if changed[j])


@once_per_object
def _ends(log: Recording) -> Array:
    """Lowest and highest position of each joint, shape (2, n); some 60 hypotheses per log need them."""
    return readonly(np.array([log.q.min(axis=0), log.q.max(axis=0)]))


def _reached(arm: Arm, j: int, low: Array, high: Array) -> bool:
    lower, upper = float(arm.lower[j]), float(arm.upper[j])
    if not arm.revolute[j]:
        return bool(low[j] >= lower - SLACK and high[j] <= upper + SLACK)
    lower, upper = max(lower, -TURNS), min(upper, TURNS)
    turns = 2.0 * np.pi * np.ceil((lower - SLACK - low[j]) / (2.0 * np.pi))  # the lowest turn within the limits
    return bool(high[j] + turns <= upper + SLACK)
