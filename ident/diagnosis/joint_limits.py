"""Whether the positions of a log, read in some way, are where the joints of the arm can be."""

from functools import lru_cache

import numpy as np

from ident.diagnosis.logs import LogHypothesis
from ident.model.arm import Arm
from ident.recordings.recording import Recording
from ident.support.arrays import Array, readonly

SLACK = 0.1
"""Position beyond a limit that is taken for a zero not quite right [rad or m]."""
TURNS = 4.0 * np.pi
"""Position that no joint without stated limits goes beyond, as two turns either way [rad]."""
STILL = 0.1
"""Range of a joint, of motions made to excite it, below which it is taken as standing still [rad or m]."""


def beyond_limits(arm: Arm, log: Recording) -> tuple[int, ...]:
    """Joints, from 0, that a log puts where they cannot be; a revolute joint may be counted from another turn."""
    low, high = _ends(log)
    return tuple(j for j in range(arm.n) if not _reached(arm, j, low, high))


def within_limits(arm: Arm, log: Recording, how: LogHypothesis) -> bool:
    """Whether a reading that changes units leaves every joint where it can be, and moving as much as a joint does."""
    ends = how.q_factor * _ends(log)[:, how.q_order] + how.zero
    low, high = ends.min(axis=0), ends.max(axis=0)
    changed = np.abs(how.q_factor) != 1.0
    return all(_reached(arm, j, low, high) and high[j] - low[j] >= STILL for j in range(arm.n) if changed[j])


@lru_cache(maxsize=64)
def _ends(log: Recording) -> Array:
    """Lowest and highest position of each joint, shape (2, n); some 60 readings of a log ask for them."""
    return readonly(np.array([log.q.min(axis=0), log.q.max(axis=0)]))


def _reached(arm: Arm, j: int, low: Array, high: Array) -> bool:
    lower, upper = float(arm.lower[j]), float(arm.upper[j])
    if not arm.revolute[j]:
        return bool(low[j] >= lower - SLACK and high[j] <= upper + SLACK)
    lower, upper = max(lower, -TURNS), min(upper, TURNS)
    turns = 2.0 * np.pi * np.ceil((lower - SLACK - low[j]) / (2.0 * np.pi))  # the lowest turn that is not too low
    return bool(high[j] + turns <= upper + SLACK)
