"""Model errors: effects of the robot that the identification model lacks, one file each.

`docs/derivations.md` has the equation and the source of each. A new one needs a file and, here, a base class of
`ModelErrors` and an entry of `EFFECTS`.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from sim.effects import (
    backlash,
    base_tilt,
    cogging,
    friction_direction,
    friction_drift,
    gravity_spring,
    joint_elasticity,
    load_friction,
    moved_frames,
    presliding,
    stribeck,
    temperature,
    viscous_curve,
    wrist_coupling,
    zero_errors,
)
from sim.effects.effect import Effect


@dataclass(frozen=True, kw_only=True)
class ModelErrors(
    zero_errors.ZeroErrors,  # the order of keys is from last to first
    presliding.Presliding,
    backlash.Backlash,
    cogging.Cogging,
    viscous_curve.ViscousCurve,
    temperature.Temperature,
    friction_direction.FrictionByDirection,
    friction_drift.FrictionDrift,
    load_friction.LoadFriction,
    stribeck.Stribeck,
    joint_elasticity.JointElasticity,
    gravity_spring.GravitySpringErrors,
    wrist_coupling.WristCoupling,
    moved_frames.MovedFrames,
    base_tilt.BaseTilt,
):
    """Values of all effects, keys of `[plant.errors]`; zero switches an effect off."""


EFFECTS: Mapping[str, Effect[ModelErrors]] = {
    "base_tilt": base_tilt.EFFECT,
    "gravity_spring": gravity_spring.EFFECT,
    "moved_frames": moved_frames.EFFECT,
    "zero_errors": zero_errors.EFFECT,  # of the arm's own joints, before others are added
    "joint_elasticity": joint_elasticity.EFFECT,  # before what pulls at its motors
    "backlash": backlash.EFFECT,
    "wrist_coupling": wrist_coupling.EFFECT,
    "friction_drift": friction_drift.EFFECT,  # after what splits friction
    "stribeck": stribeck.EFFECT,  # a share of constant friction, before what is added to it
    "friction_by_direction": friction_direction.EFFECT,  # the same
    "temperature": temperature.EFFECT,  # the same
    "viscous_curve": viscous_curve.EFFECT,  # of viscous friction as it is then
    "load_friction": load_friction.EFFECT,
    "cogging": cogging.EFFECT,
    "presliding": presliding.EFFECT,  # after all that is dry friction
}
"""The effects, in the order in which they act."""
