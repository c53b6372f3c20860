"""A robot: the model of its arm, and data that the model file does not contain.

The definitions hold for any robot. Elements that an arm does not have (a spring, a coupled motor, a frame named d3) are
absent, and a model error that needs one is refused by name.

Robot files: a robot as TOML, every number with its origin and source.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, NonNegativeFloat, PositiveFloat, ValidationError, model_validator

from ident.support.arrays import Array
from ident.support.files import read_toml
from sim.errors import PlantError

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
        PlantError: If arrays differ in length, or a joint does not exist.
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
                raise PlantError(
                    f"robot {self.name}: {name}: {len(getattr(self, name))} values, but drives.gain has {self.n}; "
                    "expected one per joint"
                )
        for coupling in self.couplings:
            pair = (coupling.motor, coupling.turns_with)
            if not all(0 <= joint < self.n for joint in pair) or pair[0] == pair[1]:
                raise PlantError(
                    f"robot {self.name}: coupling of motor {pair[0] + 1} with joint {pair[1] + 1}: expected two of its "
                    f"{self.n} joints"
                )
        motors = [coupling.motor for coupling in self.couplings]
        if len(set(motors)) < len(motors):
            raise PlantError(
                f"robot {self.name}: coupling: a motor is named twice; each can be coupled to one other joint only"
            )
        if self.gravity_spring is not None and not 0 <= self.gravity_spring.joint < self.n - 1:
            raise PlantError(
                f"robot {self.name}: gravity_spring acts on joint {self.gravity_spring.joint + 1}: "
                f"expected one of its first {self.n - 1} joints"
            )


Origin = Literal["published", "measured", "assumed"]
Source = Annotated[str, Field(min_length=1)]
Joint = Annotated[int, Field(ge=1)]


class _Table(BaseModel):
    """A TOML table: unknown keys are errors, values are strictly typed."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True, defer_build=True)


class FrictionTable(_Table):
    """A number of 0 or more, with origin and source.

    Attributes:
        value: The number.
        origin: Origin of the number: published, measured or assumed.
        source: Source of the number.
    """

    value: NonNegativeFloat
    origin: Origin
    source: Source


class LengthTable(FrictionTable):
    """A number above 0, with origin and source."""

    value: PositiveFloat


class JointsTable(_Table):
    """Numbers, one per joint; one origin for all, or one per joint.

    Attributes:
        value: The numbers, one per joint.
        origin: Origin of the numbers, one word for all or one per joint.
        source: Source of the number.
    """

    value: list[float]
    origin: Origin | list[Origin]
    source: Source

    @model_validator(mode="after")
    def _one_origin_a_value(self) -> "JointsTable":
        if isinstance(self.origin, list) and len(self.origin) != len(self.value):
            raise ValueError(f"{len(self.origin)} origins for {len(self.value)} values; expected one, or one per value")
        return self

    def array(self) -> Array:
        """The values, read-only."""
        values = np.array(self.value, dtype=np.float64)
        values.flags.writeable = False
        return values


class SpeedsTable(JointsTable):
    """Numbers above 0, one per joint."""

    value: list[PositiveFloat]  # pyright: ignore[reportIncompatibleVariableOverride]  (frozen: nobody appends to it)


class DrivesTable(_Table):
    """Nominal drives: `sim.robot.DriveTruth`, and rated speeds and accelerations.

    Attributes:
        gain: Joint torque per current [N m / drive unit], force for a prismatic joint; negative if the drive is wired
            in reverse.
        rotor_inertia: Inertias of the rotors, joint side [kg m^2].
        viscous_friction: Viscous friction [N m s/rad].
        coulomb_friction: Coulomb friction [N m].
        coulomb_asymmetry: Asymmetry of Coulomb friction between the directions [N m].
        amplifier_offset: Current references at zero torque [drive units].
        current_limit: Saturation of the current reference [drive units].
        max_velocity: Rated speeds [rad/s].
        max_acceleration: Rated accelerations [rad/s^2].
    """

    gain: JointsTable
    rotor_inertia: JointsTable
    viscous_friction: JointsTable
    coulomb_friction: JointsTable
    coulomb_asymmetry: JointsTable
    amplifier_offset: JointsTable
    current_limit: JointsTable
    max_velocity: SpeedsTable
    max_acceleration: SpeedsTable


class CouplingTable(_Table):
    """`sim.robot.Coupling`; joints count from 1.

    Attributes:
        motor: The joint whose motor also turns with another joint.
        turns_with: The other joint.
        viscous_friction: Viscous friction of the coupling [N m s/rad].
        coulomb_friction: Coulomb friction of the coupling [N m].
    """

    motor: Joint
    turns_with: Joint
    viscous_friction: FrictionTable
    coulomb_friction: FrictionTable


class SpringTable(_Table):
    """`sim.robot.GravitySpring`; its free length is prestress over stiffness.

    Attributes:
        joint: The supported joint; not the last one.
        stiffness: Stiffness of the spring [N/m].
        prestress: Stiffness times free length [N].
        radius: Distance of the end on the preceding link from the joint's axis [m].
        distance: Distance of the end on the joint's own link from the axis [m].
    """

    joint: Joint
    stiffness: LengthTable
    prestress: LengthTable
    radius: LengthTable
    distance: LengthTable


class RobotTable(_Table):
    """A robot file.

    Attributes:
        name: Name of the robot.
        model: MJCF or URDF file, relative to this file.
        flange: Last body of the arm, if the model has more bodies.
        home: Start pose [rad].
        drives: Nominal drives.
        coupling: Motors that turn with the sum of two joints.
        frames: Bodies, by the name of the distance in the model whose end they are.
        gravity_spring: A spring that supports an axis against gravity.
        rated_load: Largest payload mass [kg].
    """

    name: Source
    model: Source
    flange: Source | None = None
    home: JointsTable
    drives: DrivesTable
    coupling: list[CouplingTable] = []
    frames: dict[str, str] = {}
    gravity_spring: SpringTable | None = None
    rated_load: LengthTable | None = None


def read_robot(path: Path) -> Robot:
    """Read a robot file.

    Args:
        path: The TOML file; the path of its model is relative to it.

    Raises:
        PlantError: If it cannot be read, lacks a value, has one too many, or its model file is missing.
    """
    try:
        table = RobotTable.model_validate(read_toml(path, error=ValueError))
    except ValidationError as error:
        raise PlantError(f"robot file {path}: {_first_fault(error)}") from error
    except ValueError as error:  # it names the path
        raise PlantError(f"robot file {error}") from error
    try:
        robot = _robot(table, path.parent)
    except PlantError as error:
        raise PlantError(f"robot file {path}: {error}") from error
    if not robot.model.is_file():
        raise PlantError(f"robot file {path}: model = {table.model!r}: there is no file {robot.model}")
    return robot


def _robot(table: RobotTable, folder: Path) -> Robot:
    drives, spring = table.drives, table.gravity_spring
    return Robot(
        name=table.name,
        model=folder / table.model,
        flange=table.flange,
        drives=DriveTruth(**{field.name: getattr(drives, field.name).array() for field in fields(DriveTruth)}),
        max_velocity=drives.max_velocity.array(),
        max_acceleration=drives.max_acceleration.array(),
        home=table.home.array(),
        frames=table.frames,
        couplings=tuple(
            Coupling(
                motor=each.motor - 1,
                turns_with=each.turns_with - 1,
                viscous_friction=each.viscous_friction.value,
                coulomb_friction=each.coulomb_friction.value,
            )
            for each in table.coupling
        ),
        gravity_spring=None
        if spring is None
        else GravitySpring(
            joint=spring.joint - 1,
            free_length=spring.prestress.value / spring.stiffness.value,
            radius=spring.radius.value,
            distance=spring.distance.value,
        ),
        rated_load=None if table.rated_load is None else table.rated_load.value,
    )


def _first_fault(error: ValidationError) -> str:
    """Return the most specific validation error, in the terms of the file."""
    fault = max(error.errors(), key=lambda each: len(each["loc"]))
    place = ".".join(str(part) for part in fault["loc"] if not str(part).startswith(("literal", "list[")))
    if fault["type"] == "extra_forbidden":
        return f"unknown key {place}"
    if fault["type"] == "missing":
        others = [each["loc"] for each in error.errors() if each["type"] == "extra_forbidden"]
        beside = [str(loc[-1]) for loc in others if loc[:-1] == fault["loc"][:-1]]  # it may be one of them, mistyped
        return f"{place} is missing" + (f", and {', '.join(beside)} is unknown" if beside else "")
    return f"{place}: {fault['msg'][0].lower()}{fault['msg'][1:]}, got {fault['input']!r}"
