"""A robot: the model of its arm, and data that the model file does not contain, from a TOML file.

The definitions hold for any robot. Elements that an arm does not have (a spring, a coupled motor, a frame named d3) are
absent, and a model error that needs one is refused by name. A file states every number with its origin and source.
"""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import AfterValidator, ConfigDict, Field, NonNegativeFloat, PositiveFloat, model_validator

from ident.support.arrays import Array, transmission_fault
from ident.support.errors import placed
from ident.support.files import read_toml
from sim.errors import PlantError
from sim.tables import Table, ValueOf, validated_table

LARGEST = 1e9
"""Largest absolute value of any parameter of a drive, in SI units or drive units."""


Origin = Literal["published", "measured", "assumed"]
Source = Annotated[str, Field(min_length=1)]
Joint = Annotated[int, Field(ge=1), AfterValidator(lambda joint: joint - 1)]
"""A joint, from 0; files count from 1."""


class FrictionTable(Table):
    """A number of 0 or more, with origin and source."""

    value: NonNegativeFloat = Field(description="The number")
    origin: Origin = Field(description="Origin of the number: published, measured or assumed")
    source: Source = Field(description="Source of the number")


class LengthTable(FrictionTable):
    """A number above 0, with origin and source."""

    value: PositiveFloat = Field(description="The number")


class JointsTable(Table):
    """Numbers, one per joint; one origin for all, or one per joint."""

    value: list[float] = Field(description="The numbers, one per joint")
    origin: Origin | list[Origin] = Field(description="Origin of the numbers, one word for all or one per joint")
    source: Source = Field(description="Source of the number")

    @model_validator(mode="after")
    def _one_origin_a_value(self) -> "JointsTable":
        if isinstance(self.origin, list) and len(self.origin) != len(self.value):
            raise ValueError(f"{len(self.origin)} origins for {len(self.value)} values; expected one, or one per value")
        return self


Friction = Annotated[float, ValueOf(FrictionTable)]
Length = Annotated[float, ValueOf(LengthTable)]
PerJoint = Annotated[Array, ValueOf(JointsTable)]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DriveTruth:
    """True parameters of the drives, joint side; every array has shape (n,).

    Raises:
        PlantError: If shapes differ, or a value is impossible.
    """

    __pydantic_config__: ClassVar[ConfigDict] = Table.model_config
    gain: PerJoint  # torque or force per current g [N m or N / drive unit]; negative if wired in reverse, never zero
    amplifier_offset: PerJoint  # current references at zero torque v0 [drive units]
    rotor_inertia: PerJoint  # inertias of the rotors Ia, joint side [kg m^2]
    viscous_friction: PerJoint  # viscous friction Fv [N m s/rad]
    coulomb_friction: PerJoint  # Coulomb friction Fc [N m]
    coulomb_asymmetry: PerJoint  # asymmetry of Coulomb friction between the directions Fcoff [N m]
    current_limit: PerJoint  # saturation of the current reference [drive units]

    def __post_init__(self) -> None:
        """Check shapes and signs."""
        n = len(self.gain)
        for name in (drive.name for drive in fields(self)):
            values = np.asarray(getattr(self, name), dtype=np.float64)
            signed = name in ("gain", "amplifier_offset", "coulomb_asymmetry")
            for wrong, said in (
                (values.shape != (n,) or not np.isfinite(values).all(), f": expected {n} finite numbers"),
                ((np.abs(values) > LARGEST).any(), f": expected {LARGEST:g} at most"),
                (not signed and (values < 0.0).any(), " has a negative value"),
                (name in ("gain", "max_velocity", "max_acceleration") and not values.all(), " has a zero"),
            ):
                if wrong:
                    raise PlantError(f"drives: {name} {values.tolist()}{said}")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RatedDrives(DriveTruth):
    """Nominal drives, and their rated speeds and accelerations."""

    max_velocity: PerJoint  # rated speeds [rad/s]
    max_acceleration: PerJoint  # rated accelerations [rad/s^2]


class Coupling(Table):
    """A motor that turns with the sum of two joints."""

    motor: Joint  # the joint whose motor also turns with another joint, from 0
    turns_with: Joint  # the other joint, from 0
    viscous_friction: Friction  # viscous friction of the coupling, at the sum of the speeds [N m s/rad]
    coulomb_friction: Friction  # Coulomb friction of the coupling, at the sum of the speeds [N m]


class GravitySpring(Table):
    """Attachment of a spring that supports a joint against gravity."""

    joint: Joint  # the supported joint, from 0; not the last one
    stiffness: Length  # stiffness of the spring [N/m]
    prestress: Length  # stiffness times free length [N]
    radius: Length  # distance of the end on the preceding link from the joint's axis [m]
    distance: Length  # distance of the end on the joint's own link from the axis [m]


class Robot(Table):
    """A robot file: an arm of n joints and its drives; robots are compared by identity.

    Units are those of revolute joints; for prismatic joints N, m and kg replace N m, rad and kg m^2. With a
    transmission, torque = A' g v, and drives and logs are those of the motors.

    Raises:
        PlantError: If arrays differ in length, or a joint does not exist.
    """

    name: Source  # name of the robot
    model: Path  # MJCF or URDF file, relative to this file
    flange: Source | None = None  # last body of the arm, if the model has more; joints outside its chain are locked
    home: PerJoint  # start pose [rad]
    drives: RatedDrives  # nominal drives
    coupling: list[Coupling] = Field([])  # motors that turn with the sum of two joints
    transmission: tuple[tuple[float, ...], ...] | None = None  # rows of A, q_motor = A q, if motors move several joints
    frames: dict[str, str] = Field({})  # bodies, by the name of the distance in the model whose end they are
    gravity_spring: GravitySpring | None = None  # a spring that supports an axis against gravity
    rated_load: Length | None = None  # largest payload mass [kg]

    def __eq__(self, other: object) -> bool:
        """Return whether it is the same object: arrays have no hash."""
        return self is other

    def __hash__(self) -> int:
        """Return that of the object."""
        return id(self)

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.drives.gain)

    @property
    def motors(self) -> Array | None:
        """Matrix from positions of joints to those of motors, shape (n, n); None if they are the same."""
        return None if self.transmission is None else np.array(self.transmission)

    @model_validator(mode="after")
    def _matching_parts(self) -> "Robot":
        n, faults = self.n, list[str]()
        if len(self.home) != n:
            faults.append(f"home: {len(self.home)} values, but drives.gain has {n}; expected one per joint")
        for motor, other in ((each.motor, each.turns_with) for each in self.coupling):
            if not {motor, other} <= set(range(n)) or motor == other:
                faults.append(f"coupling of motor {motor + 1} with joint {other + 1}: expected two of its {n} joints")
        if len({each.motor for each in self.coupling}) < len(self.coupling):
            faults.append("coupling: a motor is named twice; each can be coupled to one other joint only")
        stated = self.transmission
        if stated is not None and (fault := transmission_fault(stated, n, coupled=bool(self.coupling))):
            faults.append(f"transmission: {fault}")
        if self.gravity_spring is not None and not 0 <= self.gravity_spring.joint < n - 1:
            faults.append(
                f"gravity_spring acts on joint {self.gravity_spring.joint + 1}: expected one of its first {n - 1} "
                "joints"
            )
        if faults:
            raise PlantError(f"robot {self.name}: {faults[0]}")
        return self


def read_robot(path: Path) -> Robot:
    """Read a robot file, to which its model's path is relative; `PlantError` for a fault or a missing model file."""
    table, place = read_toml(path, error=PlantError), f"robot file {path}"
    with placed(place):
        stated = validated_table(Robot, table, place, PlantError)
        model = path.parent / stated.model
        if not model.is_file():
            raise PlantError(f"model = {str(stated.model)!r}: there is no file {model}")
    return stated.model_copy(update={"model": model})
