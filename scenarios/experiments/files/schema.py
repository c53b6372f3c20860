"""The schema of a scenario: true plant, experiment, assumed values, tolerances."""

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
"""Tables whose values a run or a source may change."""
TABLES_OF_TABLES = ("random", "sources", "payloads")
"""Tables whose keys the user chooses."""


class _Table(BaseModel):
    """A TOML table: unknown keys are errors, values are frozen and strictly typed."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)


class InertiaTable(_Table):
    """Inertia about the centre of mass, axes of the last link [kg m^2]."""

    ixx: float = Field(description="Moment about x [kg m^2]")
    iyy: float = Field(description="Moment about y [kg m^2]")
    izz: float = Field(description="Moment about z [kg m^2]")
    ixy: float = Field(0.0, description="Product of x and y [kg m^2]")
    ixz: float = Field(0.0, description="Product of x and z [kg m^2]")
    iyz: float = Field(0.0, description="Product of y and z [kg m^2]")


class BodyTable(_Table):
    """The true payload, in the frame of the last link."""

    mass: Positive = Field(description="Its mass [kg]")
    com: Triple = Field(description="Its centre of mass [m]")
    inertia: InertiaTable = Field(description="About the centre of mass [kg m^2]")


class PlantTable(_Table):
    """The true plant. Arrays have one entry per joint; an omitted array has the values of the nominal drives."""

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
    """The experiment: the motion is repeated for each entry of `protocol`, which states the payload.

    `bare` is the flange alone, `loaded` the plant's `payload`, any other name one of its `payloads`. Every motion has
    independent noise, and friction may drift between motions. Drives that warm up stay warm.
    """

    motion: str = Field(description="Name of a built-in motion, or a motion file in the scenario's folder")
    protocol: tuple[str, ...] = Field(PAIR, description="The payload of each motion, or bare")
    warm_up: Seconds = Field(
        0.0, description="Duration of the warm-up, in which the robot repeats the first motion with a bare flange [s]"
    )
    pause: Seconds = Field(0.0, description="Rest before each motion but the first, brakes on [s]")
    step: Positive = Field(description="Step of the physics [s]")
    controller: ControllerOptions = Field(ControllerOptions(), description="The digital controller")
    sensors: SensorOptions = Field(SensorOptions(), description="Encoders, current sensors and clocks")


class BeliefTable(_Table):
    """Values that controller and identification assume.

    Attributes:
        controller_gain: A-priori gains that the controller divides torque by [N m / drive unit].
        couplings: Pairs of joints, from 1, whose second motor turns with the sum of both, as `[[5, 6]]`;
            the identification model has only these, whatever the robot has.
        payload: The assumed payload: a name of `rx90_mjcf.PAYLOADS` or a table in the format of payload files.
        payloads: Further assumed payloads, by their names in the protocol.
        known: Overrides `known` of payloads, for all or by name, as `{ light = "mass" }`.
        exact: Whether the standard deviations of payloads are zero, for scenarios without payload errors; for all or by
            name, as `{ light = true }`. Standard deviations in a file have priority over an inherited `exact`.
    """

    controller_gain: Vector
    couplings: tuple[Couple, ...] = ()
    payload: str | dict[str, object] | None = None
    payloads: dict[str, str | dict[str, object]] = {}
    known: Known | dict[str, Known] | None = None
    exact: bool | dict[str, bool] = False


class IdentificationTable(_Table):
    """Method of identification and its options."""

    method: str = Field(default=DEFAULT, description="Name of the estimator")
    options: dict[str, bool | float | str] = Field(default={}, description="Options of the method")
    observe: ObserveOptions = Field(default=ObserveOptions(), description="Filters and rows of the linear system")
    gains: GainOptions = Field(default=GainOptions(), description="Limits for accepting a gain")

    @property
    def method_options(self) -> object:
        """Options of the method, an instance of its options class."""
        return options_from_table(ESTIMATORS[self.method].options, self.options)


class ToleranceTable(_Table):
    """Criteria for passing."""

    gain: tuple[Positive, ...] = Field(description="Largest relative error of each gain that passes")
    identifiable: tuple[bool, ...] = Field(description="Joints whose gains should be identifiable")
    pass_rate: Share = Field(0.95, description="Share of the trials of a study in which each joint must pass")


class CostTable(_Table):
    """The effect of `belief.controller_gain`: results with these and with the identified gains, and true values."""

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
        target: Key path of the numbers in the scenario (`plant.gain`, `plant.payload.mass`), or a list of paths.
        distribution: Name of a distribution of `scipy.stats` that implements its own quantile function.
        parameters: Parameters of the distribution; an array has one value per number of the target, or of all targets
            in order.
        apply: Use of the drawn numbers.
        shared: Whether one number is drawn for the whole target, instead of one per number.
        choice: A set from which one value is drawn, instead of a distribution.
    """

    target: Target
    distribution: str | None = None
    parameters: dict[str, float | Vector] = {}
    apply: Literal["replace", "add", "multiply"] = "replace"
    shared: bool = False
    choice: tuple[str | float, ...] | None = None

    @property
    def targets(self) -> tuple[str, ...]:
        """Key paths in the scenario that it changes."""
        return (self.target,) if isinstance(self.target, str) else self.target


class SourceTable(DrawTable):
    """An error source of the error budget: a drawn value as in `DrawTable`, or a noise."""

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
        description="If specified, single runs (not studies) also estimate the effect of belief.controller_gain",
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
        name: Name of the built-in scenario or of the file; for `scenario.toml`, of its folder.
        folder: Folder of its file and of its motions.
        table: Its content, with all numbers of drives and payloads stated.
        expectation: Name of the file (its own or an extended one) that states which gains should be identifiable.
        asking: Path of the file (its own or an extended one) that names robot or motion, by key.
    """

    name: str
    folder: Path
    table: ScenarioTable
    expectation: str = ""
    asking: Mapping[str, str] = field(default_factory=dict[str, str])
