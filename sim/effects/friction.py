"""Friction that differs from `Fc sign(dq) + Fv dq`.

    by direction    Fc (1 + coulomb_by_direction sign(dq) / 2), Fv in the same way
    Stribeck        Fc (1 + stribeck exp(-(dq / stribeck_speed)^2))
    viscous curve   Fv ((1 - s) dq + s w |dq / w|^p sign(dq))
    load            load_friction |g (v - v0)| + transmitted_friction |tau_link| + gear_friction |tau_link + f|
    presliding      ds/dt = (1 - s sign(dq)) dq / presliding,      tau = -F s
    dress pack      ds/dt = (1 - s sign(dq)) dq / dress_reach,     tau = -dress_pack |g| v_max s
    drift           from each motion to the next

Speeds of a coupled motor are those of the motor.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import mujoco
import numpy as np
from annotated_types import Interval, Unit

from ident.support.arrays import Array
from sim.effects.effect import Build, ControlStep, Effect, Share, Stacked, Term, drives_of, each_value
from sim.effects.transmissions import places_of_motors
from sim.errors import PlantError
from sim.robot import DriveTruth, Robot

STIFFEST = 400.0
"""Largest natural frequency of a rotor on its presliding stiffness [rad/s]: 0.4 rad in a period of 1 ms."""


Drift = Annotated[float, Interval(ge=-1.0, le=100.0)]
Difference = Annotated[float, Interval(ge=-2.0, le=2.0)]
Deflected = Callable[[Array], Callable[[Array, float], Array]]
"""Returns, for distances (B, 1), a function from speeds (B, k) and a period [s] to relative deflections s, (B, k)."""


def stepwise(distance: Array) -> Callable[[Array, float], Array]:
    """Return the function for the speeds of successive control periods."""
    kept: list[Array] = []

    def now(speed: Array, period: float) -> Array:
        s, side = kept.pop() if kept else np.zeros_like(speed), np.sign(speed)
        kept.append(side + (s - side) * np.exp(-np.abs(speed) * period / distance))
        return s

    return now


def at_once(distance: Array) -> Callable[[Array, float], Array]:
    """Return the function for all speeds of one motion: between reversals s - sign(dq) decays with the distance."""
    known: list[tuple[Array, Array]] = []  # of the last motion, which currents are iterated for

    def course(speed: Array, period: float) -> Array:
        if known and known[0][0] is speed:
            return known[0][1]
        side, moved = np.sign(speed), np.abs(speed) * period
        s = np.zeros_like(moved)
        for k in range(moved.shape[1]):
            turns = np.flatnonzero(np.diff(side[:, k])) + 1
            before = 0.0
            for begin, end in zip((0, *turns), (*turns, len(side)), strict=True):
                travelled = np.concatenate(([0.0], np.cumsum(moved[begin:end, k])))
                decay = np.exp(-travelled / distance[0, 0])
                course = side[begin, k] + (before - side[begin, k]) * decay
                s[begin:end, k], before = course[:-1], course[-1]
        known[:] = [(speed, s)]
        return s

    return course


@dataclass(frozen=True, kw_only=True)
class FrictionDrift(Effect):
    """Relative change of friction from each motion to the next; -1 removes friction."""

    coulomb_drift: Drift = 0.0  # relative change of dry friction from each motion to the next
    viscous_drift: Drift = 0.0  # relative change of viscous friction from each motion to the next

    def after_compile(self, model: mujoco.MjModel, build: Build) -> None:
        """Change friction of joints and coupled motors; damping of a transmission is not friction."""
        dry, viscous = ((1.0 + drift) ** build.earlier for drift in (self.coulomb_drift, self.viscous_drift))
        for kind, place in places_of_motors(model):
            getattr(model, f"{kind}_frictionloss")[place] *= dry
            getattr(model, f"{kind}_damping")[place] *= viscous


@dataclass(frozen=True, kw_only=True)
class Stribeck(Effect):
    """Additional dry friction near standstill.

    Attributes:
        stribeck: Additional dry friction near standstill, as a share of Coulomb friction.
        stribeck_speed: Speed at which the additional friction is 37 % of its largest value [rad/s]; assumed.
    """

    stribeck: Annotated[float, Interval(ge=0.0, le=100.0)] = 0.0
    stribeck_speed: Annotated[float, Interval(ge=1e-6, le=100.0), Unit("rad/s")] = 0.1

    @staticmethod
    def act(values: Stacked, drives: Stacked, step: ControlStep) -> None:
        step.friction[:] *= 1.0 + values["stribeck"] * np.exp(-((step.speed / values["stribeck_speed"]) ** 2))


@dataclass(frozen=True, kw_only=True)
class FrictionByDirection(Effect):
    """Difference of friction between the two directions."""

    coulomb_by_direction: Difference = 0.0  # dry friction at positive minus that at negative speed, over their mean
    viscous_by_direction: Difference = 0.0  # viscous friction at positive minus that at negative speed, over their mean

    @staticmethod
    def act(values: Stacked, drives: Stacked, step: ControlStep) -> None:
        direction = 0.5 * np.sign(step.speed)
        step.friction[:] *= 1.0 + values["coulomb_by_direction"] * direction
        step.damping[:] *= 1.0 + values["viscous_by_direction"] * direction


@dataclass(frozen=True, kw_only=True)
class ViscousCurve(Effect):
    """The share s of viscous friction that is proportional to a power p of speed, and unchanged at the speed w.

    A power below 1 flattens the curve (shear-thinning lubricant), a power above 1 steepens it (churning losses).

    Attributes:
        viscous_curve: Share of viscous friction that follows the power of speed.
        viscous_power: The power of speed; the default is the cube root.
        viscous_speed: The speed at which this friction equals the proportional one [rad/s].
    """

    viscous_curve: Share = 0.0
    viscous_power: Annotated[float, Interval(gt=0.0, le=4.0)] = 1.0 / 3.0
    viscous_speed: Annotated[float, Interval(ge=1e-3, le=100.0), Unit("rad/s")] = 1.0

    @staticmethod
    def act(values: Stacked, drives: Stacked, step: ControlStep) -> None:
        """Add it as dry friction, whose direction the constraint solver finds: a root is steep at zero speed."""
        share, speed = values["viscous_curve"], values["viscous_speed"]
        step.friction[:] += share * step.damping * speed * np.abs(step.speed / speed) ** values["viscous_power"]
        step.damping[:] *= 1.0 - share


@dataclass(frozen=True, kw_only=True)
class LoadFriction(Effect):
    """Load-dependent dry friction of the drive's own joint.

    g (v - v0) is the motor torque; tau_link is the torque transmitted to the links, smaller by the rotor's inertial
    torque and all friction; f is the other friction of the drive, which the gear also transmits. The first law is
    explicit. The others have friction on both sides and use tau_link of the preceding control period.

    Attributes:
        load_friction: Dry friction per unit of drive torque |g (v - v0)|.
        transmitted_friction: Dry friction per unit of torque that is transmitted to the links.
        gear_friction: Dry friction per unit of torque in the gear: that of the links plus that of other friction.
    """

    load_friction: Annotated[float, Interval(ge=0.0, le=10.0)] = 0.0
    transmitted_friction: Annotated[float, Interval(ge=0.0, le=0.9)] = 0.0
    gear_friction: Annotated[float, Interval(ge=0.0, le=0.9)] = 0.0

    @staticmethod
    def act(values: Stacked, drives: Stacked, step: ControlStep) -> None:
        own = slice(step.v.shape[1])
        speed, per_current = step.speed[:, own], values["load_friction"] * np.abs(drives["gain"])
        carried = step.transmitted + step.friction[:, own] * np.sign(speed) + step.damping[:, own] * speed
        load = per_current * np.abs(step.v - drives["amplifier_offset"])
        load += values["transmitted_friction"] * np.abs(step.transmitted)
        step.friction[:, own] += load + values["gear_friction"] * np.abs(carried)


@dataclass(frozen=True, kw_only=True)
class Presliding(Effect):
    """Dry friction that develops over a distance (Dahl 1968; LuGre without its damping).

    F is the total dry friction of the joint or the coupled motor, and s, between -1 and 1, its relative deflection, 0
    at the start of a motion. At constant speed the law has an exact solution over a control period, which is stable for
    any distance. The torque is held over the period, which limits the stiffness F / presliding for a given rotor and
    period.

    Attributes:
        presliding: Distance after which dry friction has reached 63 % [rad]; 0 for immediate friction.
    """

    instant: ClassVar[bool] = False
    presliding: Annotated[float, Interval(ge=0.0, le=1.0), Unit("rad")] = 0.0

    def fits(self, robot: Robot, drives: DriveTruth) -> None:
        if not self.presliding:
            return
        friction, inertia = (np.asarray(x, dtype=np.float64) for x in (drives.coulomb_friction, drives.rotor_inertia))
        least = np.divide(friction, inertia * STIFFEST**2, out=np.full(robot.n, np.inf), where=inertia > 0.0)
        j = int(np.argmax(least))
        if self.presliding < least[j]:
            raise PlantError(
                f"errors: presliding = {self.presliding:g} rad is too stiff for joint {j + 1}, whose dry friction is "
                f"{friction[j]:g} N m on a rotor of {inertia[j]:g} kg m^2; expected {least[j]:.3g} rad or more"
            )

    @classmethod
    def term(cls, values: Sequence[object], builds: Sequence[Build], deflected: Deflected = stepwise) -> Term:
        (distance,) = each_value(values, "presliding")
        builds_up = distance > 0.0
        deflection = deflected(np.where(builds_up, distance, 1.0))

        def add(step: ControlStep) -> None:
            force = np.where(builds_up, deflection(step.speed, step.period) * step.friction, 0.0)
            step.torque[:] -= (step.turns.transpose(0, 2, 1) @ force[:, :, None])[:, :, 0]
            step.friction[:] = np.where(builds_up, 0.0, step.friction)

        return add

    def along(self, build: Build) -> Term:
        return Presliding.term([self], [build], at_once)


@dataclass(frozen=True, kw_only=True)
class DressPack(Effect):
    """Hoses and cables along the arm, which follow every joint with hysteresis, as presliding.

    Attributes:
        dress_pack: Largest torque of the hoses on a joint, as a share of the drive's largest torque.
        dress_reach: Distance after which the torque has reached 63 % [rad]; assumed.
    """

    instant: ClassVar[bool] = False
    dress_pack: Share = 0.0
    dress_reach: Annotated[float, Interval(ge=0.01, le=100.0), Unit("rad")] = 0.3

    @classmethod
    def term(cls, values: Sequence[object], builds: Sequence[Build], deflected: Deflected = stepwise) -> Term:
        share, reach = each_value(values, "dress_pack", "dress_reach")
        drives, deflection = drives_of(builds), deflected(reach)
        most = share * np.abs(drives["gain"]) * drives["current_limit"]

        def add(step: ControlStep) -> None:
            step.torque[:] -= most * deflection(step.dq, step.period)

        return add

    def along(self, build: Build) -> Term:
        return DressPack.term([self], [build], at_once)
