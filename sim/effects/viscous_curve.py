"""Viscous friction that does not grow in proportion to speed.

A share s of it follows another power p of the speed, and is what it was at the speed w:

    Fv ((1 - s) dq + s w |dq / w|^p sign(dq))

A power below 1 flattens (lubricant that shears thinner), one above 1 steepens (lubricant that is churned). It holds for
a coupled motor too, at the speed that the motor turns with.
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
        viscous_curve: That share.
        viscous_power: The power of speed that it follows; a cube root unless stated.
        viscous_speed: The speed at which it is what it would be in proportion [rad/s].
    """

    viscous_curve: Annotated[float, Interval(ge=0.0, le=1.0)] = 0.0
    viscous_power: Annotated[float, Interval(gt=0.0, le=4.0)] = 1.0 / 3.0
    viscous_speed: Annotated[float, Interval(ge=1e-3, le=100.0), Unit("rad/s")] = 1.0


def _term(values: Sequence[ViscousCurve], builds: Sequence[Build]) -> Term:
    share, power, speed = each_value(values, "viscous_curve", "viscous_power", "viscous_speed")

    def add(step: ControlStep) -> None:
        # As dry friction, whose direction is the constraint's to find: a root is steep where speed changes its sign.
        step.friction[:] += share * step.damping * speed * np.abs(step.speed / speed) ** power
        step.damping[:] *= 1.0 - share

    return add


EFFECT = Effect[ViscousCurve](varies=lambda values: values.viscous_curve > 0.0, term=_term, instant=True)
