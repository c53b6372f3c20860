"""A scenario as one validated value: what is true, what is done, what is believed, what is tolerated."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field
from pydantic_core import PydanticCustomError

from ident.estimation.estimators import DEFAULT, ESTIMATORS
from ident.estimation.gain_options import GainOptions
from ident.observation.observation import ObserveOptions
from ident.support.options import options_from_table
from scenarios.experiments.files.mountings import PAIR
from scenarios.experiments.files.places import ROBOT
from sim.controller import ControllerOptions
from sim.effects import ModelErrors
from sim.sensors import STREAMS, SensorOptions

Vector = tuple[float, ...]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Seconds = Annotated[float, Field(ge=0.0, le=1e6, allow_inf_nan=False)]
Triple = tuple[float, float, float]
Share = Annotated[float, Field(gt=0.0, lt=1.0)]
Target = str | tuple[str, ...]
Couple = tuple[int, int]
Known = Literal["all", "mass"]


def _known_stream(name: str) -> str:
    if name not in STREAMS:
        raise PydanticCustomError("stream", "expected one of {known}", {"known": ", ".join(STREAMS)})
    return name


Stream = Annotated[str, AfterValidator(_known_stream), Field(json_schema_extra={"enum": list(STREAMS)})]


DRAWABLE = ("plant.", "experiment.", "belief.", "identification.", "tolerance.gain")
"""Beginnings of the places that a run or a source may change."""
TABLES_OF_TABLES = ("random", "sources", "payloads")
"""Keys whose tables have names of the user's choice."""


class _Table(BaseModel):
    """A TOML table: unknown keys are errors, values are frozen and strictly typed."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class InertiaTable(_Table):
    """Inertia about the centre of mass, axes of the last link [kg m^2]."""

    ixx: float = Field(description="Moment about x [kg m^2]")
    iyy: float = Field(description="Moment about y [kg m^2]")
    izz: float = Field(description="Moment about z [kg m^2]")
    ixy: float = Field(0.0, description="Product of x and y [kg m^2]")
    ixz: float = Field(0.0, description="Product of x and z [kg m^2]")
    iyz: float = Field(0.0, description="Product of y and z [kg m^2]")


class BodyTable(_Table):
    """The payload that is really mounted, in the frame of the last link."""

    mass: Positive = Field(description="Its mass [kg]")
    com: Triple = Field(description="Its centre of mass [m]")
    inertia: InertiaTable = Field(description="About the centre of mass [kg m^2]")


class PlantTable(_Table):
    """The truth. Arrays have one entry a joint; one that is left out is the nominal drive's."""

    payload: str | BodyTable | None = Field(
        None, description="The payload of `loaded` motions of the protocol: a name of `rx90_mjcf.PAYLOADS` or a table"
    )
    payloads: dict[str, str | BodyTable] = Field({}, description="Further payloads, by their names in the protocol")
    gain: Vector | None = Field(
        None, description="Drive gains [N m / drive unit], [N / drive unit] for prismatic joints"
    )
    amplifier_offset: Vector | None = Field(None, description="Current references at zero torque [drive units]")
    rotor_inertia: Vector | None = Field(None, description="Inertias of the rotors, joint side [kg m^2]")
    viscous_friction: Vector | None = Field(None, description="Viscous friction [N m s/rad]")
    coulomb_friction: Vector | None = Field(None, description="Coulomb friction [N m]")
    coulomb_asymmetry: Vector | None = Field(
        None, description="Asymmetry of Coulomb friction between the directions [N m]"
    )
    current_limit: Vector | None = Field(None, description="Saturation of the current reference [drive units]")
    errors: ModelErrors = Field(ModelErrors(), description="Effects of the robot that the identification model lacks")


class ExperimentTable(_Table):
    """What is done with the plant: the motion, once for each entry of `protocol`, which says what is mounted.

    `bare` is the flange alone, `loaded` the plant's `payload`, any other name one of its `payloads`. Every motion has
    noise of its own, and friction may drift from each to the next. Drives that warm up stay warm.
    """

    motion: str = Field(description="Name of a built-in motion, or a motion file in the scenario's folder")
    protocol: tuple[str, ...] = Field(PAIR, description="The payload of each motion, or bare")
    warm_up: Seconds = Field(
        0.0, description="Duration for which the robot repeats its motion with a bare flange before the first one [s]"
    )
    pause: Seconds = Field(0.0, description="Rest before every other motion, brakes on [s]")
    step: Positive = Field(description="Step of the physics [s]")
    controller: ControllerOptions = Field(ControllerOptions(), description="The digital controller")
    sensors: SensorOptions = Field(SensorOptions(), description="Encoders, current sensors and clocks")


class BeliefTable(_Table):
    """What the controller and the identification believe.

    Attributes:
        controller_gain: A-priori gains that the controller divides torque by [N m / drive unit].
        couplings: Pairs of joints, from 1, whose second motor turns with the sum of both, as `[[5, 6]]`;
            identification is told of none unless it is said here, whatever the robot has.
        payload: As weighed and drawn: a name of `rx90_mjcf.PAYLOADS` or a table in the format of payload files.
        payloads: The same of others, by the names that the protocol calls them.
        known: Overrides what payloads say themselves, for all or by name, as `{ light = "mass" }`.
        exact: Take the deviations of payloads as zero, as befits a scenario that draws no error of a payload; for all
            or by name, as `{ light = true }`. Deviations that a file states count over an `exact` that it inherits.
    """

    controller_gain: Vector
    couplings: tuple[Couple, ...] = ()
    payload: str | dict[str, object] | None = None
    payloads: dict[str, str | dict[str, object]] = {}
    known: Known | dict[str, Known] | None = None
    exact: bool | dict[str, bool] = False


class IdentificationTable(_Table):
    """How gains are identified; `options` are the method's own."""

    method: str = Field(default=DEFAULT, description="Name of the estimator")
    options: dict[str, bool | float | str] = Field(default={}, description="Options of the method")
    observe: ObserveOptions = Field(default=ObserveOptions(), description="Filters and rows of the linear system")
    gains: GainOptions = Field(default=GainOptions(), description="Limits for accepting a gain")

    @property
    def method_options(self) -> object:
        """The method's own options, of its own class."""
        return options_from_table(ESTIMATORS[self.method].options, self.options)


class ToleranceTable(_Table):
    """What counts as passed."""

    gain: tuple[Positive, ...] = Field(description="Largest relative error of each gain that passes")
    identifiable: tuple[bool, ...] = Field(description="Joints whose gains should be identifiable")
    pass_rate: Share = Field(0.95, description="Share of the trials of a study in which each joint must pass")


class CostTable(_Table):
    """What a run says beside its gains: results with the controller's gains, with those found, and what is true."""

    payload: str | BodyTable = Field(
        description=(
            "Payload of one more motion, which is not used for identification; its mass is known exactly: a name of "
            "`rx90_mjcf.PAYLOADS` or a table"
        )
    )
    mass_error: Positive = Field(
        0.02, description="Largest relative error of the payload's mass that passes, with the identified gains"
    )


class DrawTable(_Table):
    """A random change of the scenario: numbers from a distribution of `scipy.stats`, or one value of a set.

    Attributes:
        target: The numbers, by their place in the scenario (`plant.gain`, `plant.payload.mass`); one place or several.
        distribution: Name of a distribution of `scipy.stats` that has a quantile function of its own.
        parameters: Of the distribution; an array has one value a number of the target, or of all targets in order.
        apply: What is done with the numbers drawn.
        shared: One number for all of the target, instead of one each.
        choice: A set that one value is drawn from, instead of a distribution.
    """

    target: Target
    distribution: str | None = None
    parameters: dict[str, float | Vector] = {}
    apply: Literal["replace", "add", "multiply"] = "replace"
    shared: bool = False
    choice: tuple[str | float, ...] | None = None

    @property
    def targets(self) -> tuple[str, ...]:
        """Places in the scenario that it changes."""
        return (self.target,) if isinstance(self.target, str) else self.target


class SourceTable(DrawTable):
    """An error source of the scenario's error budget, drawn like any `DrawTable` or a noise."""

    stream: Stream | None = Field(
        None, description="The noise that this source switches on, with its own random numbers"
    )
    size: float | None = Field(None, description="Size of the noise (default: the scenario's value)")
    off: float | None = Field(None, description="Value with this source off (default: the scenario's)")


class ScenarioTable(_Table):
    """A scenario file after `extends` is resolved."""

    description: str = Field(description="One line for `rx90 list`")
    robot: str = Field(
        ROBOT, description="Name of a built-in robot, or path of a robot file relative to the scenario's folder"
    )
    plant: PlantTable = Field(description="The true robot")
    experiment: ExperimentTable = Field(description="The motions, controller and sensors")
    belief: BeliefTable = Field(description="Values that controller and identification assume")
    identification: IdentificationTable = Field(IdentificationTable(), description="How gains are identified")
    tolerance: ToleranceTable = Field(description="Criteria for passing")
    cost: CostTable | None = Field(
        None,
        description="If stated, single runs (not studies) also estimate the effect of the controller's gains",
    )
    random: dict[str, DrawTable] = Field(
        {}, description="Random values of every trial of a study, by names of your choice"
    )
    sources: dict[str, SourceTable] = Field(
        {}, description="Error sources of the error budget, by names of your choice"
    )


@dataclass(frozen=True, slots=True)
class Scenario:
    """A named scenario.

    Attributes:
        name: Name of the built-in scenario, or the file's; of a `scenario.toml` its folder's.
        folder: Where its file lies; motions are looked up there too.
        table: Its content, every number of drives and payloads stated.
        expectation: Name of the file, its own or one it extends, that says which joints' gains the data should give.
        asking: Path of the file, its own or one it extends, that names a robot or motion, by key.
    """

    name: str
    folder: Path
    table: ScenarioTable
    expectation: str = ""
    asking: Mapping[str, str] = field(default_factory=dict[str, str])
