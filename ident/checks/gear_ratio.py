"""Positions that one joint counts on the motor's side of its gear, and the ratio that explains its currents.

Where the log as it is puts a joint beyond what it can reach, ratios are searched on a geometric grid, so fine that a
wrong neighbour is off by a per cent of the motion, and the best one is refined.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy

from ident.checks.comparison import Logs
from ident.checks.reach import unreachable
from ident.evidence import NOTHING
from ident.explanation import explanations
from ident.instants import Instants, thinned
from ident.readings import Reading, as_it_is

RATIOS = np.geomspace(2.0, 500.0, 280)
"""Plausible ratios, 2 % apart; a planetary stage has 3, a harmonic drive up to 320."""
UNREACHED = 1e3
"""Stands for a sum of logarithms where a ratio leaves the joint out of reach; any other is negative or near it."""
AROUND = 0.04
"""Relative distance from the best of the grid that the best of all may have."""
FEW = 100
"""Instants of each log that ratios are compared on."""


def motor_side(logs: Logs) -> tuple[Reading, ...]:
    """Readings that divide the positions of one joint by the ratio that explains its currents best.

    Only joints that the log as it is puts out of reach are looked at, and only where that is one of several joints: of
    all joints at once no ratio can be found alone.
    """
    given = as_it_is(logs.arm)
    beyond = unreachable(logs.arm, logs.recordings, given)
    if len(beyond) != 1 or not logs.arm.revolute[beyond[0]]:
        return ()
    (joint,) = beyond

    def left(ratio: float, at: Sequence[Instants]) -> float:
        reading = _divided(given, joint, ratio)
        if unreachable(logs.arm, logs.recordings, reading):
            return UNREACHED
        found = explanations(logs.arm, logs.unknowns, at, (reading,))[0].left
        return float(np.log(np.maximum(found, NOTHING)).sum())

    few = tuple(thinned(each, FEW) for each in logs.seen)
    ratios = np.concatenate((RATIOS, -RATIOS))
    values = np.array([left(float(ratio), few) for ratio in ratios])
    if values.min() >= UNREACHED:
        return ()
    best = float(ratios[int(values.argmin())])
    near = scipy.optimize.minimize_scalar(
        lambda change: left(best * (1.0 + change), logs.seen),
        bounds=(-AROUND, AROUND),
        method="bounded",
        options={"xatol": 1e-4},
    )
    return (_divided(given, joint, best * (1.0 + float(near.x))),)


def _divided(given: Reading, joint: int, ratio: float) -> Reading:
    own = np.arange(len(given.factor)) == joint
    words = f"q{joint + 1} divided by {ratio:.4g}, as of a motor behind its gear"
    return replace(given, words=words, factor=np.where(own, 1.0 / ratio, 1.0))
