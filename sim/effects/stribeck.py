"""Dry friction that increases near standstill: `Fc (1 + stribeck exp(-(dq / stribeck_speed)^2))`.

For a coupled motor, the speed is that of the motor.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from annotated_types import Interval, Unit

from sim.effects.effect import Build, ControlStep, Effect, Term, Values, each_value


@dataclass(frozen=True, kw_only=True)
class Stribeck(Values):
    """Additional dry friction near standstill.

    Attributes:
        stribeck: Additional dry friction near standstill, as a share of Coulomb friction.
        stribeck_speed: Speed at which the additional friction is 37 % of its largest value [rad/s]; assumed.
    """

    stribeck: Annotated[float, Interval(ge=0.0, le=100.0)] = 0.0
    stribeck_speed: Annotated[float, Interval(ge=1e-6, le=100.0), Unit("rad/s")] = 0.1


def _term(values: Sequence[Stribeck], builds: Sequence[Build]) -> Term:
    share, fall = each_value(values, "stribeck", "stribeck_speed")

    def add(step: ControlStep) -> None:
        step.friction[:] *= 1.0 + share * np.exp(-((step.speed / fall) ** 2))

    return add


EFFECT = Effect[Stribeck](varies=lambda values: values.stribeck > 0.0, term=_term, instant=True)
