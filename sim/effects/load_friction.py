"""Dry friction that grows with load, in its usual forms.

    load_friction |g (v - v0)| + transmitted_friction |tau_link| + gear_friction |tau_link + f|

g (v - v0) is what the motor gives, tau_link what the links take over, less by the rotor's inertia and all friction, f
the other friction of the drive, which gears carry as well. The first law is explicit; the others, in which friction is
on both sides, take tau_link of the control period before.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from annotated_types import Interval

from sim.effects.effect import Build, ControlStep, Effect, Term, Values, each_drive, each_value


@dataclass(frozen=True, kw_only=True)
class LoadFriction(Values):
    """Load-dependent dry friction, on the drive's own joint.

    Attributes:
        load_friction: Dry friction per unit of drive torque |g (v - v0)|.
        transmitted_friction: Dry friction per unit of torque that the links take over.
        gear_friction: Dry friction per unit of torque that the gears carry: that of the links and of other friction.
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
