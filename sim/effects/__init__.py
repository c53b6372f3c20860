"""Model errors: effects of the robot that the identification model lacks.

`docs/derivations.md` has the equation and the source of each. A new one needs its class and, here, a base class of
`ModelErrors` and an entry of `EFFECTS`.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from sim.effects.effect import Effect
from sim.effects.friction import (
    DressPack,
    FrictionByDirection,
    FrictionDrift,
    LoadFriction,
    Presliding,
    Stribeck,
    ViscousCurve,
)
from sim.effects.geometry import BaseTilt, GravitySpringErrors, MovedFrames, ZeroErrors
from sim.effects.motors import Cogging, GainLaws, Temperature
from sim.effects.surroundings import LoosePayload, SoftTable
from sim.effects.transmissions import Backlash, JointElasticity, WristCoupling


@dataclass(frozen=True, kw_only=True)
class ModelErrors(
    DressPack,  # the order of keys is from last to first
    SoftTable,
    LoosePayload,
    ZeroErrors,
    Presliding,
    Backlash,
    GainLaws,
    Cogging,
    ViscousCurve,
    Temperature,
    FrictionByDirection,
    FrictionDrift,
    LoadFriction,
    Stribeck,
    JointElasticity,
    GravitySpringErrors,
    WristCoupling,
    MovedFrames,
    BaseTilt,
):
    """Values of all effects, keys of `[plant.errors]`; zero switches an effect off."""


EFFECTS: Mapping[str, type[Effect]] = {
    "base_tilt": BaseTilt,
    "gravity_spring": GravitySpringErrors,
    "moved_frames": MovedFrames,
    "zero_errors": ZeroErrors,  # of the arm's own joints, before others are added
    "joint_elasticity": JointElasticity,  # before what pulls at its motors
    "backlash": Backlash,
    "wrist_coupling": WristCoupling,
    "friction_drift": FrictionDrift,  # after what splits friction
    "stribeck": Stribeck,  # a share of constant friction, before what is added to it
    "friction_by_direction": FrictionByDirection,  # the same
    "temperature": Temperature,  # the same
    "viscous_curve": ViscousCurve,  # of viscous friction as it is then
    "load_friction": LoadFriction,
    "cogging": Cogging,
    "gain_laws": GainLaws,
    "presliding": Presliding,  # after all that is dry friction
    "dress_pack": DressPack,
    "loose_payload": LoosePayload,
    "soft_table": SoftTable,
}
"""The effects, in the order in which they act."""
