"""Robot files: a robot as TOML, every number with its origin and source."""

from dataclasses import fields
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, NonNegativeFloat, PositiveFloat, ValidationError, model_validator

from ident.support.arrays import Array
from ident.support.files import read_toml
from sim.errors import PlantError, RobotError
from sim.robot import Coupling, DriveTruth, GravitySpring, Robot

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
        RobotError: If it cannot be read, lacks a value, has one too many, or its model file is missing.
    """
    try:
        table = RobotTable.model_validate(read_toml(path, error=ValueError))
    except ValidationError as error:
        raise RobotError(f"robot file {path}: {_first_fault(error)}") from error
    except ValueError as error:  # it names the path
        raise RobotError(f"robot file {error}") from error
    try:
        robot = _robot(table, path.parent)
    except PlantError as error:
        raise RobotError(f"robot file {path}: {error}") from error
    if not robot.model.is_file():
        raise RobotError(f"robot file {path}: model = {table.model!r}: there is no file {robot.model}")
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
