"""Model errors: what the robot has and the identification model has not."""

from dataclasses import dataclass, fields
from math import inf, isfinite

from sim.errors import EffectError

_RANGES = {
    "base_tilt_x": (-0.5, 0.5, "0.5 rad at most"),
    "base_tilt_y": (-0.5, 0.5, "0.5 rad at most"),
    "d3_error": (-0.1, 0.1, "0.1 m at most"),
    "r4_error": (-0.1, 0.1, "0.1 m at most"),
    "wrist_coupling": (0.0, 1.0, "a share from 0 to 1"),
    "gravity_spring": (0.0, inf, "0 N/m or more"),
    "stribeck": (0.0, inf, "a share of 0 or more"),
    "load_friction": (0.0, inf, "a share of 0 or more"),
    "coulomb_drift": (-1.0, inf, "-1 or more, where -1 is no friction left"),
    "viscous_drift": (-1.0, inf, "-1 or more, where -1 is no friction left"),
}
"""Smallest and largest value of a field, and how to say so."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelErrors:
    """What the robot has and the identification model has not; zero switches each off.

    `docs/derivations.md` has the equation and the source of each.

    Attributes:
        base_tilt_x: Tilt of the base about its x axis [rad].
        base_tilt_y: Tilt of the base about its y axis, after the other [rad].
        d3_error: Distance by which frame 3 lies farther from frame 2 than drawn [m].
        r4_error: Distance by which frame 4 lies farther from frame 3 than drawn [m].
        wrist_coupling: Share, 0 to 1, of motor 6 that turns with q5 + q6 instead of q6.
        gravity_spring: Stiffness of a spring that helps axis 2 against gravity [N/m].
        joint_compliance: Elasticity of each joint's transmission [rad/(N m)]; None or all zero for rigid
            ones.
        stribeck: Extra dry friction near standstill, as a share of Coulomb friction.
        stribeck_speed: Speed at which that extra has fallen to 37 % [rad/s]; assumed.
        load_friction: Dry friction per unit of drive torque |g (v - v0)|.
        coulomb_drift: Relative change of dry friction of the loaded motion against the unloaded one.
        viscous_drift: Relative change of viscous friction of the loaded motion against the unloaded one.
    """

    base_tilt_x: float = 0.0
    base_tilt_y: float = 0.0
    d3_error: float = 0.0
    r4_error: float = 0.0
    wrist_coupling: float = 0.0
    gravity_spring: float = 0.0
    joint_compliance: tuple[float, ...] | None = None
    stribeck: float = 0.0
    stribeck_speed: float = 0.1
    load_friction: float = 0.0
    coulomb_drift: float = 0.0
    viscous_drift: float = 0.0

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            EffectError: If one is not finite or outside its range.
        """
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, float | int) and not isfinite(value):
                raise EffectError(f"errors: {field.name} = {value}: expected a finite number")
        for name, (low, high, expected) in _RANGES.items():
            if not low <= getattr(self, name) <= high:
                raise EffectError(f"errors: {name} = {getattr(self, name):g}: expected {expected}")
        if not self.stribeck_speed > 0.0:
            raise EffectError(f"errors: stribeck_speed = {self.stribeck_speed:g} rad/s: expected a positive number")
        if self.joint_compliance is not None and not any(self.joint_compliance):
            object.__setattr__(self, "joint_compliance", None)
        if self.joint_compliance is not None and not all(isfinite(c) and c > 0.0 for c in self.joint_compliance):
            raise EffectError(
                f"errors: joint_compliance = {list(self.joint_compliance)} rad/(N m): expected positive numbers, "
                "one a joint; all zero for rigid joints"
            )
