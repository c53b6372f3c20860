"""Viscous friction that is not proportional to speed.

A share s of it is proportional to the power p of the speed, and is unchanged at the speed w:

    Fv ((1 - s) dq + s w |dq / w|^p sign(dq))

A power below 1 flattens the curve (shear-thinning lubricant), a power above 1 steepens it (churning losses). For a
coupled motor, the speed is that of the motor.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from annotated_types import Interval, Unit

from sim.effects.effect import Build, ControlStep, Effect, Term, Values, each_value


@dataclass(frozen=True, kw_only=True)
class ViscousCurve(Values):
    """The share of viscous friction that is not proportional to speed.

    Attributes:
        viscous_curve: Share of viscous friction that follows the power of speed.
        viscous_power: The power of speed; the default is the cube root.
        viscous_speed: The speed at which this friction equals the proportional one [rad/s].
    """

    viscous_curve: Annotated[float, Interval(ge=0.0, le=1.0)] = 0.0
    viscous_power: Annotated[float, Interval(gt=0.0, le=4.0)] = 1.0 / 3.0
    viscous_speed: Annotated[float, Interval(ge=1e-3, le=100.0), Unit("rad/s")] = 1.0


def _term(values: Sequence[ViscousCurve], builds: Sequence[Build]) -> Term:
    share, power, speed = each_value(values, "viscous_curve", "viscous_power", "viscous_speed")

    def add(step: ControlStep) -> None:
        # Added as dry friction, whose direction the constraint solver finds: a root is steep at zero speed.
        step.friction[:] += share * step.damping * speed * np.abs(step.speed / speed) ** power
        step.damping[:] *= 1.0 - share

    return add


EFFECT = Effect[ViscousCurve](varies=lambda values: values.viscous_curve > 0.0, term=_term, instant=True)
