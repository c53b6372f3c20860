"""Friction that depends on the direction of motion: `Fc (1 + coulomb_by_direction sign(dq) / 2)`, `Fv` in the same way.

For a coupled motor, the direction is that of the motor.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from annotated_types import Interval

from sim.effects.effect import Build, ControlStep, Effect, Term, Values, each_value


@dataclass(frozen=True, kw_only=True)
class FrictionByDirection(Values):
    """Difference of friction between the two directions.

    Attributes:
        coulomb_by_direction: Dry friction at positive minus that at negative speed, as a share of their mean.
        viscous_by_direction: Viscous friction at positive minus that at negative speed, as a share of their mean.
    """

    coulomb_by_direction: Annotated[float, Interval(ge=-2.0, le=2.0)] = 0.0
    viscous_by_direction: Annotated[float, Interval(ge=-2.0, le=2.0)] = 0.0


def _term(values: Sequence[FrictionByDirection], builds: Sequence[Build]) -> Term:
    dry, viscous = (0.5 * each for each in each_value(values, "coulomb_by_direction", "viscous_by_direction"))

    def add(step: ControlStep) -> None:
        direction = np.sign(step.speed)
        step.friction[:] *= 1.0 + dry * direction
        step.damping[:] *= 1.0 + viscous * direction

    return add


EFFECT = Effect[FrictionByDirection](
    varies=lambda values: bool(values.coulomb_by_direction or values.viscous_by_direction), term=_term, instant=True
)
