"""Model errors: effects of the robot that the identification model lacks.

`docs/derivations.md` has the equation and the source of each. A new one needs its class and,
here, its place among the base classes of `ModelErrors`.
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
class ModelErrors(  # effects act, and their keys are listed, from last to first
    SoftTable,
    LoosePayload,
    DressPack,
    Presliding,  # after all that is dry friction
    GainLaws,
    Cogging,
    LoadFriction,
    ViscousCurve,  # of viscous friction as it is then
    Temperature,  # a share of constant friction, before what is added to it
    FrictionByDirection,  # the same
    Stribeck,  # the same
    FrictionDrift,  # after what splits friction
    WristCoupling,
    Backlash,
    JointElasticity,  # before what pulls at its motors
    ZeroErrors,  # of the arm's own joints, before others are added
    MovedFrames,
    GravitySpringErrors,
    BaseTilt,
):
    """Values of all effects, keys of `[plant.errors]`; zero switches an effect off."""


EFFECTS: Mapping[str, type[Effect]] = {
    each.__name__: each for each in reversed(ModelErrors.__bases__) if issubclass(each, Effect)
}
"""The effects, in the order in which they act."""
