"""Friction that changes from each motion to the next."""

from dataclasses import dataclass
from typing import Annotated

import mujoco
from annotated_types import Interval

from sim.effects.effect import Build, Effect, Values
from sim.effects.wrist_coupling import coupling_tendons


@dataclass(frozen=True, kw_only=True)
class FrictionDrift(Values):
    """Relative change of friction from each motion to the next; -1 removes friction.

    Attributes:
        coulomb_drift: Relative change of dry friction from each motion to the next.
        viscous_drift: Relative change of viscous friction from each motion to the next.
    """

    coulomb_drift: Annotated[float, Interval(ge=-1.0, le=100.0)] = 0.0
    viscous_drift: Annotated[float, Interval(ge=-1.0, le=100.0)] = 0.0


def _drift(values: FrictionDrift, model: mujoco.MjModel, build: Build) -> None:
    """Change friction of joints and coupled motors; damping of a transmission is not friction."""
    dry, viscous = ((1.0 + drift) ** build.earlier for drift in (values.coulomb_drift, values.viscous_drift))
    model.dof_frictionloss *= dry
    model.tendon_frictionloss *= dry
    model.dof_damping *= viscous
    model.tendon_damping[coupling_tendons(model)] *= viscous


EFFECT = Effect[FrictionDrift](after_compile=_drift)
