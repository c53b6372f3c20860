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
    """Inertia about the centre of mass, axes of the last link [kg m^2].

    Attributes:
        ixx: Moment about x [kg m^2].
        iyy: Moment about y [kg m^2].
        izz: Moment about z [kg m^2].
        ixy: Product of x and y [kg m^2].
        ixz: Product of x and z [kg m^2].
        iyz: Product of y and z [kg m^2].
    """

    ixx: float
    iyy: float
    izz: float
    ixy: float = 0.0
    ixz: float = 0.0
    iyz: float = 0.0


class BodyTable(_Table):
    """The payload that is really mounted, in the frame of the last link.

    Attributes:
        mass: Its mass [kg].
        com: Its centre of mass [m].
        inertia: About the centre of mass [kg m^2].
    """

    mass: Positive
    com: Triple
    inertia: InertiaTable


class PlantTable(_Table):
    """The truth. Arrays have one entry a joint; one that is left out is the nominal drive's.

    Attributes:
        payload: What the protocol calls `loaded`: a name of `rx90_mjcf.PAYLOADS` or a table.
        payloads: Others, by the names that the protocol calls them.
        gain: Drive gains [N m / drive unit], or N where a joint slides.
        amplifier_offset: Current references that give no torque [drive units].
        rotor_inertia: Of the rotors, joint side [kg m^2].
        viscous_friction: Friction by speed [N m s/rad].
        coulomb_friction: Dry friction [N m].
        coulomb_asymmetry: Constant part of friction [N m].
        current_limit: Where the current reference saturates [drive units].
        errors: What the robot has and the identification model has not.
    """

    payload: str | BodyTable | None = None
    payloads: dict[str, str | BodyTable] = {}
    gain: Vector | None = None
    amplifier_offset: Vector | None = None
    rotor_inertia: Vector | None = None
    viscous_friction: Vector | None = None
    coulomb_friction: Vector | None = None
    coulomb_asymmetry: Vector | None = None
    current_limit: Vector | None = None
    errors: ModelErrors = ModelErrors()


class ExperimentTable(_Table):
    """What is done with the plant: the motion, once for each entry of `protocol`, which says what is mounted.

    `bare` is the flange alone, `loaded` the plant's `payload`, any other name one of its `payloads`. Every motion has
    noise of its own, and friction may drift from each to the next. Drives that warm up stay warm.

    Attributes:
        motion: A built-in motion's name, or a motion file beside the scenario.
        protocol: What is mounted in each motion.
        warm_up: For how long the robot repeats its motion with a bare flange before the first one [s].
        pause: Rest before every other motion, brakes on [s].
        step: Of the physics [s].
        controller: The digital controller.
        sensors: Encoders, current sensors and clocks.
    """

    motion: str
    protocol: tuple[str, ...] = PAIR
    warm_up: Seconds = 0.0
    pause: Seconds = 0.0
    step: Positive
    controller: ControllerOptions = ControllerOptions()
    sensors: SensorOptions = SensorOptions()


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
    """How gains are identified; `options` are the method's own.

    Attributes:
        method: Name of the estimator.
        options: The method's own.
        observe: How recordings become a linear system.
        gains: How estimates are judged.
    """

    method: str = DEFAULT
    options: dict[str, bool | float | str] = {}
    observe: ObserveOptions = ObserveOptions()
    gains: GainOptions = GainOptions()

    @property
    def method_options(self) -> object:
        """The method's own options, of its own class."""
        return options_from_table(ESTIMATORS[self.method].options, self.options)


class ToleranceTable(_Table):
    """What counts as passed.

    Attributes:
        gain: Relative error of each gain that passes.
        identifiable: Which joints' gains the data should give.
        pass_rate: Share of the runs in which each joint must pass when a study repeats the scenario.
    """

    gain: tuple[Positive, ...]
    identifiable: tuple[bool, ...]
    pass_rate: Share = 0.95


class CostTable(_Table):
    """What a run says beside its gains: what comes out with the controller's gains, with those found, and what is true.

    Attributes:
        payload: Weight of one more motion, which identification does not see, weighed without error: a name of
            `rx90_mjcf.PAYLOADS` or a table.
        mass_error: Relative error of its mass that passes, with the gains found.
    """

    payload: str | BodyTable
    mass_error: Positive = 0.02


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
    """An error source of the scenario's error budget, drawn like any `DrawTable` or a noise.

    Attributes:
        stream: Noise whose random numbers are its own.
        size: Size of the noise, where the scenario's own value is not meant.
        off: The value without it, the scenario's own if left out.
    """

    stream: Stream | None = None
    size: float | None = None
    off: float | None = None


class ScenarioTable(_Table):
    """A scenario file after `extends` is resolved.

    Attributes:
        description: One line for `rx90 list`.
        robot: A built-in robot's name, or the place of a robot file relative to the scenario's folder.
        plant: What is true.
        experiment: What is done.
        belief: What controller and identification believe.
        identification: How gains are identified.
        tolerance: What counts as passed.
        cost: What the controller's gains cost is found too, where it is stated; by single runs, not by studies.
        random: What every trial of a study draws, by names of your choice.
        sources: Error sources of the error budget, by names of your choice.
    """

    description: str
    robot: str = ROBOT
    plant: PlantTable
    experiment: ExperimentTable
    belief: BeliefTable
    identification: IdentificationTable = IdentificationTable()
    tolerance: ToleranceTable
    cost: CostTable | None = None
    random: dict[str, DrawTable] = {}
    sources: dict[str, SourceTable] = {}


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
