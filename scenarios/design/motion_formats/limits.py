"""What an arm allows of the motions that it is given."""

from dataclasses import dataclass

import numpy as np

from ident.support.arrays import Array
from scenarios.design.motion_formats.sampled import SampledMotion


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MotionLimits:
    """What an arm allows; arrays are (n,).

    Attributes:
        lower: Positions [rad, m], -inf where nothing is stated.
        upper: Likewise, inf.
        velocity: [rad/s, m/s], inf where nothing is stated.
        acceleration: [rad/s^2, m/s^2], likewise.
    """

    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array

    def broken_by(self, motion: SampledMotion) -> tuple[str, ...]:
        """What a motion breaks, in words, a joint each."""
        found = list[str]()
        for j in range(motion.q.shape[1]):
            what = {
                "positions": (motion.q[:, j] < self.lower[j]).any() or (motion.q[:, j] > self.upper[j]).any(),
                "speed": np.abs(motion.dq[:, j]).max() > self.velocity[j],
                "acceleration": np.abs(motion.ddq[:, j]).max() > self.acceleration[j],
            }
            found += [f"joint {j + 1}: {name}" for name, broken in what.items() if broken]
        return tuple(found)
