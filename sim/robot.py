"""A robot: the model of its arm, and data that the model file does not contain.

The definitions hold for any robot. Elements that an arm does not have (a spring, a coupled motor, a frame named d3) are
absent, and a model error that needs one is refused by name.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from ident.support.arrays import Array
from sim.errors import PlantError, RobotError

LARGEST = 1e9
"""Largest absolute value of any parameter of a drive, in SI units or drive units."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DriveTruth:
    """True parameters of the drives, joint side; every array has shape (n,).

    Attributes:
        gain: g [N m / drive unit]; negative for a drive wired backwards, never zero.
        amplifier_offset: v0 [drive units].
        rotor_inertia: Ia [kg m^2].
        viscous_friction: Fv [N m s/rad].
        coulomb_friction: Fc [N m].
        coulomb_asymmetry: Fcoff [N m].
        current_limit: Saturation of the current reference [drive units].

    Raises:
        PlantError: If shapes differ, or a value is impossible.
    """

    gain: Array
    amplifier_offset: Array
    rotor_inertia: Array
    viscous_friction: Array
    coulomb_friction: Array
    coulomb_asymmetry: Array
    current_limit: Array

    def __post_init__(self) -> None:
        """Check shapes and signs."""
        n = len(self.gain)
        for name in (drive.name for drive in fields(self)):
            values = np.asarray(getattr(self, name), dtype=np.float64)
            if values.shape != (n,) or not np.isfinite(values).all():
                raise PlantError(f"drives: {name} {values.tolist()}: expected {n} finite numbers")
            if (np.abs(values) > LARGEST).any():
                raise PlantError(f"drives: {name} {values.tolist()}: expected {LARGEST:g} at most")
            if name not in ("gain", "amplifier_offset", "coulomb_asymmetry") and (values < 0.0).any():
                raise PlantError(f"drives: {name} {values.tolist()} has a negative value")
        if not np.asarray(self.gain).all():
            raise PlantError(f"drives: gain {np.asarray(self.gain).tolist()} has a zero")


@dataclass(frozen=True, slots=True, kw_only=True)
class Coupling:
    """A motor that turns with the sum of two joints; joints count from 0.

    Attributes:
        motor: The joint whose drive it is.
        turns_with: The other joint.
        viscous_friction: Viscous friction of the motor, at the sum of the speeds [N m s/rad].
        coulomb_friction: Coulomb friction of the motor, at the sum of the speeds [N m].
    """

    motor: int
    turns_with: int
    viscous_friction: float
    coulomb_friction: float


@dataclass(frozen=True, slots=True, kw_only=True)
class GravitySpring:
    """Attachment of a spring that supports a joint against gravity.

    Attributes:
        joint: Supported joint, from 0; not the last one.
        free_length: Length without force [m].
        radius: Distance of the end on the preceding link from the joint's axis [m].
        distance: Distance of the end on the joint's own link from the axis [m].
    """

    joint: int
    free_length: float
    radius: float
    distance: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Robot:
    """An arm of n joints; arrays have shape (n,).

    Units are those of revolute joints; for prismatic joints N, m and kg replace N m, rad and kg m^2.

    Attributes:
        name: Name of the robot in scenarios.
        model: Model file of the arm; bodies and joints from base to flange.
        drives: Its nominal drives.
        max_velocity: [rad/s].
        max_acceleration: [rad/s^2].
        home: Start position of the search for a motion [rad].
        frames: Bodies, by the name of the distance in the model whose end they are.
        couplings: Motors that turn with the sum of two joints.
        gravity_spring: The gravity spring, None for an arm without one.
        flange: Last body of the arm, if the model file has more bodies; joints outside the chain to it are locked at
            their initial positions. None if all joints belong to the arm.
        rated_load: Largest payload mass [kg], None if not stated.

    Raises:
        RobotError: If arrays differ in length, or a joint does not exist.
    """

    name: str
    model: Path
    drives: DriveTruth
    max_velocity: Array
    max_acceleration: Array
    home: Array
    frames: Mapping[str, str]
    couplings: tuple[Coupling, ...] = ()
    gravity_spring: GravitySpring | None = None
    flange: str | None = None
    rated_load: float | None = None

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.drives.gain)

    def __post_init__(self) -> None:
        """Check that the parts match."""
        for name in ("max_velocity", "max_acceleration", "home"):
            if len(getattr(self, name)) != self.n:
                raise RobotError(
                    f"robot {self.name}: {name}: {len(getattr(self, name))} values, but drives.gain has {self.n}; "
                    "expected one per joint"
                )
        for coupling in self.couplings:
            pair = (coupling.motor, coupling.turns_with)
            if not all(0 <= joint < self.n for joint in pair) or pair[0] == pair[1]:
                raise RobotError(
                    f"robot {self.name}: coupling of motor {pair[0] + 1} with joint {pair[1] + 1}: expected two of its "
                    f"{self.n} joints"
                )
        motors = [coupling.motor for coupling in self.couplings]
        if len(set(motors)) < len(motors):
            raise RobotError(
                f"robot {self.name}: coupling: a motor is named twice; each can be coupled to one other joint only"
            )
        if self.gravity_spring is not None and not 0 <= self.gravity_spring.joint < self.n - 1:
            raise RobotError(
                f"robot {self.name}: gravity_spring acts on joint {self.gravity_spring.joint + 1}: "
                f"expected one of its first {self.n - 1} joints"
            )
