"""Robot files: a robot as TOML, every number with its origin and its source."""

from dataclasses import fields
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, NonNegativeFloat, PositiveFloat, ValidationError, model_validator

from ident.support.arrays import Array
from ident.support.toml_files import read_toml
from sim.drives import DriveTruth
from sim.errors import DriveError, RobotError
from sim.robot import Coupling, GravitySpring, Robot

Origin = Literal["published", "measured", "assumed"]
Source = Annotated[str, Field(min_length=1)]
Joint = Annotated[int, Field(ge=1)]


class _Table(BaseModel):
    """A TOML table: unknown keys are errors, values are strictly typed."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True, defer_build=True)


class FrictionTable(_Table):
    """A number that may be 0, where it comes from, and who says so.

    Attributes:
        value: The number.
        origin: Where it comes from.
        source: Who says so.
    """

    value: NonNegativeFloat
    origin: Origin
    source: Source


class LengthTable(FrictionTable):
    """The same of a number above 0."""

    value: PositiveFloat


class JointsTable(_Table):
    """Numbers, one a joint; an origin for all, or one a joint.

    Attributes:
        value: The numbers, one a joint.
        origin: Where they come from, one word for all or one a joint.
        source: Who says so.
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
        """The values, which nobody changes."""
        values = np.array(self.value, dtype=np.float64)
        values.flags.writeable = False
        return values


class SpeedsTable(JointsTable):
    """The same of numbers above 0."""

    value: list[PositiveFloat]  # pyright: ignore[reportIncompatibleVariableOverride]  (frozen: nobody appends to it)


class DrivesTable(_Table):
    """Nominal drives: `sim.drives.DriveTruth`, and how fast they turn.

    Attributes:
        gain: Joint torque per current [N m / drive unit], force if the joint is prismatic; negative if wired backwards.
        rotor_inertia: Of the rotors, joint side [kg m^2].
        viscous_friction: Friction by speed [N m s/rad].
        coulomb_friction: Dry friction [N m].
        coulomb_asymmetry: Constant part of friction [N m].
        amplifier_offset: Current references that give no torque [drive units].
        current_limit: Where the current reference saturates [drive units].
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
        motor: The joint whose motor turns with another joint as well.
        turns_with: That other joint.
        viscous_friction: Friction of the coupling by speed [N m s/rad].
        coulomb_friction: Its dry friction [N m].
    """

    motor: Joint
    turns_with: Joint
    viscous_friction: FrictionTable
    coulomb_friction: FrictionTable


class SpringTable(_Table):
    """`sim.robot.GravitySpring`; its free length is prestress over stiffness.

    Attributes:
        joint: The joint that it helps; there is one behind it.
        stiffness: Of the spring [N/m].
        prestress: Stiffness times its length without force [N].
        radius: Distance of its near end, on the link before, from the joint's axis [m].
        distance: Distance of its far end, on the joint's own link, from the axis [m].
    """

    joint: Joint
    stiffness: LengthTable
    prestress: LengthTable
    radius: LengthTable
    distance: LengthTable


class RobotTable(_Table):
    """A robot file.

    Attributes:
        name: What the robot is called.
        model: MJCF or URDF file beside this one.
        flange: The arm's last body, where the model has more than the arm.
        home: Pose to start from [rad].
        drives: Nominal drives.
        coupling: Motors that turn with two joints.
        frames: Bodies by the name of the distance, drawn in the model, that leads to them.
        gravity_spring: A spring that carries the weight of an axis.
        rated_load: Mass that it may carry [kg].
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
        path: The TOML file; its model lies beside it.

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
    except (DriveError, RobotError) as error:
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
    """The fault that goes deepest, in the words of a file."""
    fault = max(error.errors(), key=lambda each: len(each["loc"]))
    place = ".".join(str(part) for part in fault["loc"] if not str(part).startswith(("literal", "list[")))
    if fault["type"] == "extra_forbidden":
        return f"unknown key {place}"
    if fault["type"] == "missing":
        others = [each["loc"] for each in error.errors() if each["type"] == "extra_forbidden"]
        beside = [str(loc[-1]) for loc in others if loc[:-1] == fault["loc"][:-1]]  # it may be one of them, mistyped
        return f"{place} is missing" + (f", and {', '.join(beside)} is unknown" if beside else "")
    return f"{place}: {fault['msg'][0].lower()}{fault['msg'][1:]}, got {fault['input']!r}"
