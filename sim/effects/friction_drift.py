"""Friction that changes between the unloaded and the loaded motion."""

from dataclasses import dataclass
from typing import Annotated

import mujoco
from annotated_types import Interval

from sim.effects.effect import Build, Effect, Values
from sim.effects.wrist_coupling import coupling_tendons


@dataclass(frozen=True, kw_only=True)
class FrictionDrift(Values):
    """Friction of the loaded motion against the unloaded one; -1 is no friction left.

    Attributes:
        coulomb_drift: Relative change of dry friction of the loaded motion against the unloaded one.
        viscous_drift: Relative change of viscous friction of the loaded motion against the unloaded one.
    """

    coulomb_drift: Annotated[float, Interval(ge=-1.0, le=100.0)] = 0.0
    viscous_drift: Annotated[float, Interval(ge=-1.0, le=100.0)] = 0.0


def _drift(values: FrictionDrift, model: mujoco.MjModel, build: Build) -> None:
    """Joints and coupled motors; a transmission's damping is not friction."""
    if not build.loaded:
        return
    dry, viscous = 1.0 + values.coulomb_drift, 1.0 + values.viscous_drift
    model.dof_frictionloss *= dry
    model.tendon_frictionloss *= dry
    model.dof_damping *= viscous
    model.tendon_damping[coupling_tendons(model)] *= viscous


EFFECT = Effect[FrictionDrift](after_compile=_drift)
