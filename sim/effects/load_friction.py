"""Load-dependent dry friction, in its usual forms.

    load_friction |g (v - v0)| + transmitted_friction |tau_link| + gear_friction |tau_link + f|

g (v - v0) is the motor torque; tau_link is the torque transmitted to the links, smaller by the rotor's inertial torque
and all friction; f is the other friction of the drive, which the gear also transmits. The first law is explicit. The
others have friction on both sides and use tau_link of the preceding control period.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from annotated_types import Interval

from sim.effects.effect import Build, ControlStep, Effect, Term, Values, each_drive, each_value


@dataclass(frozen=True, kw_only=True)
class LoadFriction(Values):
    """Load-dependent dry friction of the drive's own joint.

    Attributes:
        load_friction: Dry friction per unit of drive torque |g (v - v0)|.
        transmitted_friction: Dry friction per unit of torque that is transmitted to the links.
        gear_friction: Dry friction per unit of torque in the gear: that of the links plus that of other friction.
    """

    load_friction: Annotated[float, Interval(ge=0.0, le=10.0)] = 0.0
    transmitted_friction: Annotated[float, Interval(ge=0.0, le=0.9)] = 0.0
    gear_friction: Annotated[float, Interval(ge=0.0, le=0.9)] = 0.0


def _term(values: Sequence[LoadFriction], builds: Sequence[Build]) -> Term:
    per_current = np.stack([v.load_friction * np.abs(b.drives.gain) for v, b in zip(values, builds, strict=True)])
    (offset,) = each_drive(builds, "amplifier_offset")
    per_torque, per_gear = each_value(values, "transmitted_friction", "gear_friction")

    def add(step: ControlStep) -> None:
        own = slice(offset.shape[1])
        speed = step.speed[:, own]
        carried = step.transmitted + step.friction[:, own] * np.sign(speed) + step.damping[:, own] * speed
        load = per_current * np.abs(step.v - offset) + per_torque * np.abs(step.transmitted)
        step.friction[:, own] += load + per_gear * np.abs(carried)

    return add


EFFECT = Effect[LoadFriction](
    varies=lambda values: max(values.load_friction, values.transmitted_friction, values.gear_friction) > 0.0,
    term=_term,
    instant=True,
)
