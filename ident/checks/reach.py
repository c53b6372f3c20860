"""Which readings of a log let every joint stay where the arm can be, and move as much as a joint does."""

from collections.abc import Sequence

import numpy as np

from ident.arm import Arm
from ident.arrays import Array
from ident.readings import Reading
from ident.recording import Recording

SLACK = 0.1
"""Position beyond a limit that is taken for a zero not quite right [rad or m]."""
TURNS = 4.0 * np.pi
"""Position that no joint without stated limits goes beyond, as two turns either way [rad]."""
STILL = 0.1
"""Range of a joint, of motions made to excite it, below which it is taken as standing still [rad or m]."""


def unreachable(arm: Arm, recordings: Sequence[Recording], reading: Reading) -> tuple[int, ...]:
    """Joints, from 0, that a reading puts where they cannot be, or leaves standing still by changing the unit.

    A revolute joint may be counted from another turn.
    """
    q = reading.factor * np.vstack([each.q for each in recordings])[:, reading.q_order] + reading.zero
    low, high = q.min(axis=0), q.max(axis=0)
    return tuple(j for j in range(arm.n) if not _reached(arm, j, low, high, changed=abs(reading.factor[j]) != 1.0))


def _reached(arm: Arm, j: int, low: Array, high: Array, *, changed: bool) -> bool:
    if changed and high[j] - low[j] < STILL:
        return False
    lower, upper = float(arm.lower[j]), float(arm.upper[j])
    if not arm.revolute[j]:
        return bool(low[j] >= lower - SLACK and high[j] <= upper + SLACK)
    lower, upper = max(lower, -TURNS), min(upper, TURNS)
    turns = 2.0 * np.pi * np.ceil((lower - SLACK - low[j]) / (2.0 * np.pi))  # the lowest turn that is not too low
    return bool(high[j] + turns <= upper + SLACK)
