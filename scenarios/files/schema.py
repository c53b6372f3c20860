"""A scenario as one validated value: what is true, what is done, what is believed, what is tolerated."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Annotated, Literal, get_args

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import PydanticCustomError

from ident.errors import OptionError
from ident.estimators import DEFAULT, ESTIMATORS
from ident.naming import nearest, shown
from ident.observation import ObserveOptions
from ident.options import GainOptions, options_from_table
from scenarios.errors import UnknownKey, UnknownName, WrongDraw, WrongLength, WrongValue
from scenarios.files.mountings import LOADED, PAIR, by_mounting, check_protocol
from scenarios.files.tables import scenario_table, stating_file
from sim.controller import ControllerOptions
from sim.effects import ModelErrors
from sim.sensors import STREAMS, SensorOptions

Vector = tuple[float, ...]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
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

    ixx: float
    iyy: float
    izz: float
    ixy: float = 0.0
    ixz: float = 0.0
    iyz: float = 0.0


class BodyTable(_Table):
    """The payload that is really mounted, in the frame of the last link."""

    mass: Positive
    com: Triple
    inertia: InertiaTable


class PlantTable(_Table):
    """The truth. Arrays have one entry a joint; one that is left out is the nominal drive's.

    A payload is a name of `rx90_mjcf.PAYLOADS` or a table. `payload` is the one that the experiment's protocol calls
    `loaded`; `payloads` has others by the names that the protocol calls them.
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
    noise of its own, and friction may drift from each to the next.
    """

    motion: str
    protocol: tuple[str, ...] = PAIR
    step: Positive
    controller: ControllerOptions = ControllerOptions()
    sensors: SensorOptions = SensorOptions()


class BeliefTable(_Table):
    """What the controller and the identification believe.

    A payload is a name of `rx90_mjcf.PAYLOADS` or a table in the format of payload files; `payload` and `payloads` are
    named as the plant's. `known` overrides what they say themselves, for all or by name, as `{ light = "mass" }`;
    `exact` takes their stated deviations as zero, as befits a scenario that draws no error of a payload.
    `couplings` tells identification of pairs of joints, from 1, whose second motor turns with the sum of both, as
    `[[5, 6]]`; it is told of none unless it is said here, whatever the robot has.
    """

    controller_gain: Vector
    couplings: tuple[Couple, ...] = ()
    payload: str | dict[str, object] | None = None
    payloads: dict[str, str | dict[str, object]] = {}
    known: Known | dict[str, Known] | None = None
    exact: bool = False


class IdentificationTable(_Table):
    """How gains are identified; `options` are the method's own."""

    method: str = DEFAULT
    options: dict[str, bool | float | str] = {}
    observe: ObserveOptions = ObserveOptions()
    gains: GainOptions = GainOptions()

    @property
    def method_options(self) -> object:
        """The method's own options, of its own class."""
        return options_from_table(ESTIMATORS[self.method].options, self.options)


class ToleranceTable(_Table):
    """What counts as passed: relative error of each gain, which joints the data should give, and how often.

    `pass_rate` is the share of runs in which each joint must pass when a study repeats the scenario.
    """

    gain: tuple[Positive, ...]
    identifiable: tuple[bool, ...]
    pass_rate: Share = 0.95


class DrawTable(_Table):
    """A random change of the scenario: numbers from a distribution of `scipy.stats`, or one value of a set.

    `target` names the numbers by their place in the scenario (`plant.gain`, `plant.payload.mass`). Every number of an
    array is drawn by itself unless `shared`. A parameter may be an array too, one value a number.
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
    """An error source of the scenario's error budget.

    Either drawn like any `DrawTable`, or a noise: `stream` names whose random numbers are its own, `size` its size
    where the scenario's own value is not meant. `off` is the value without it, the scenario's own if left out.
    """

    stream: Stream | None = None
    size: float | None = None
    off: float | None = None


class ScenarioTable(_Table):
    """A scenario file after `extends` is resolved."""

    description: str
    plant: PlantTable
    experiment: ExperimentTable
    belief: BeliefTable
    identification: IdentificationTable = IdentificationTable()
    tolerance: ToleranceTable
    random: dict[str, DrawTable] = {}
    sources: dict[str, SourceTable] = {}


@dataclass(frozen=True, slots=True)
class Scenario:
    """A named scenario.

    Attributes:
        name: Name of the built-in scenario, or the file's.
        folder: Where its file lies; motions are looked up there too.
        table: Its content.
        expectation: Name of the file, its own or one it extends, that says which joints' gains the data should give.
    """

    name: str
    folder: Path
    table: ScenarioTable
    expectation: str = ""


def load_scenario(name: str) -> Scenario:
    """Read and validate a built-in scenario or a user's file.

    Raises:
        ScenarioError: If it is missing, has an unknown key or a wrong value; the message names both.
    """
    table, path = scenario_table(name)
    loaded = scenario_from_table(table, path.stem, path.parent, str(path))
    return replace(loaded, expectation=stating_file(name, ("tolerance", "identifiable")))


def scenario_from_table(table: Mapping[str, object], name: str, folder: Path, where: str) -> Scenario:
    """Validate a scenario's tables.

    Args:
        table: The tables, nothing left to extend.
        name: Of the scenario.
        folder: Where its motions are looked up.
        where: Where the tables came from, for messages.

    Raises:
        ScenarioError: At an unknown key or a wrong value; the message names both.
    """
    _refuse_unknown(table, ScenarioTable, where, "")
    try:
        # Strict, so that "1" or true is no number; through JSON, where an array is a tuple.
        parsed = ScenarioTable.model_validate_json(json.dumps(table, default=str), strict=True)
    except ValidationError as error:
        raise refusal(error, where, "") from error
    check_lengths(parsed, where)
    _check_payloads(parsed, where)
    _check_draws(parsed, where)
    return Scenario(name, folder, parsed)


def refusal(error: ValidationError, where: str, place: str) -> WrongValue:
    """What pydantic found, in one line.

    Args:
        error: Of a table.
        where: The scenario.
        place: Of the table in it, empty for the whole scenario.
    """
    first = max(error.errors(), key=lambda fault: len(fault["loc"]))  # of a union, the branch that went deepest
    below = [str(part) for part in first["loc"] if not str(part).endswith(("Table", "]", "float", "str"))]
    what = first["msg"][0].lower() + first["msg"][1:]
    got = "" if first["type"] == "missing" else f", got {shown(first['input'])}"
    return WrongValue(f"{where}: {'.'.join([place, *below] if place else below)}: {what}{got}")


def _refuse_unknown(table: object, kind: type, path: str, where: str) -> None:
    """Walk tables and schema together; pydantic would not say which key was meant."""
    if not isinstance(table, Mapping):
        return
    known = _subtables(kind)
    for key, value in table.items():
        if key not in known:
            raise UnknownKey(f"{path}: unknown key {where}{key}{nearest(key, known)}; known: {', '.join(known)}")
        inner = known[key]
        if inner is not None and key in TABLES_OF_TABLES and isinstance(value, Mapping):
            for name, each in value.items():
                _refuse_unknown(each, inner, path, f"{where}{key}.{name}.")
        elif inner is not None:
            _refuse_unknown(value, inner, path, f"{where}{key}.")


def _subtables(kind: type) -> dict[str, type | None]:
    """Keys of a table, with the class of those that are tables."""
    if is_dataclass(kind):
        return {field.name: None for field in fields(kind)}
    if issubclass(kind, BaseModel):
        return {name: _table_class(field.annotation) for name, field in kind.model_fields.items()}
    return {}


def _table_class(hint: object) -> type | None:
    """The class of a key's table, or of each table in a table of tables; None for anything else."""
    if isinstance(hint, type) and (is_dataclass(hint) or issubclass(hint, BaseModel)):
        return hint
    below = get_args(hint)[1:2]  # dict[str, X] holds tables of class X, str | X is one or its name
    return _table_class(below[0]) if below else None


def check_lengths(table: ScenarioTable, path: str) -> None:
    """Every array has one entry a joint, and the method takes its options.

    Raises:
        WrongLength: At the first array that does not fit.
        WrongValue: If a value is none of those there are.
    """
    n = len(table.tolerance.gain)
    arrays = {
        "tolerance.identifiable": table.tolerance.identifiable,
        "belief.controller_gain": table.belief.controller_gain,
        **{f"plant.{name}": value for name, value in table.plant if isinstance(value, tuple)},
    }
    for where, values in arrays.items():
        if len(values) != n:
            raise WrongLength(f"{path}: {where}: {len(values)} values, but tolerance.gain has {n}; one a joint")
    if not all(table.belief.controller_gain):
        raise WrongValue(f"{path}: belief.controller_gain: a gain of zero commands nothing")
    for first, second in table.belief.couplings:
        if first == second or not {first, second} <= set(range(1, n + 1)):
            raise WrongValue(
                f"{path}: belief.couplings: joints {first} and {second}; expected two joints from 1 to {n}, as [[5, 6]]"
            )
    method = table.identification.method
    if method not in ESTIMATORS:
        raise UnknownName(f"{path}: identification.method: unknown {method!r}{nearest(method, ESTIMATORS)}")
    try:
        _ = table.identification.method_options
    except OptionError as error:
        raise WrongValue(f"{path}: identification.options: {error}") from error


def _check_payloads(table: ScenarioTable, path: str) -> None:
    """Every payload has one description on either side, and is there for the protocol."""
    for side, stated in (("plant", table.plant), ("belief", table.belief)):
        if stated.payload is not None and LOADED in stated.payloads:
            raise WrongValue(f"{path}: {side}: payload and payloads.{LOADED} are the same one; state one of them")
    plant, belief = (
        by_mounting(table.plant.payload, table.plant.payloads),
        by_mounting(table.belief.payload, table.belief.payloads),
    )
    check_protocol(table.experiment.protocol, plant, belief, path)
    for name in table.belief.known if isinstance(table.belief.known, Mapping) else ():
        if name not in belief:
            raise UnknownName(
                f"{path}: belief.known: no payload {name!r}{nearest(name, belief)}; known: {', '.join(belief)}"
            )


def _check_draws(table: ScenarioTable, path: str) -> None:
    """Every draw changes places of its own, in a way that is said once."""
    groups: tuple[tuple[str, Mapping[str, DrawTable]], ...] = (("random", table.random), ("sources", table.sources))
    for group, draws in groups:
        owner: dict[str, str] = {}
        for name, draw in draws.items():
            where = f"{path}: {group}.{name}"
            stream = draw.stream if isinstance(draw, SourceTable) else None
            ways = [way for way in (draw.distribution, draw.choice, stream) if way is not None]
            if len(ways) != 1:
                raise WrongDraw(f"{where}: give either a distribution, or a choice, or for a source its stream")
            if isinstance(draw, SourceTable) and draw.size is not None and stream is None:
                raise WrongDraw(f"{where}: size is of a noise; a drawn source has its size from its distribution")
            if not draw.targets:
                raise WrongDraw(f"{where}: target names no place")
            for place in (*draw.targets, *([] if stream is None else [f"the stream {stream}"])):
                if stream is None and not place.startswith(DRAWABLE):
                    raise WrongDraw(f"{where}: {place!r} cannot be drawn; targets begin with {', '.join(DRAWABLE)}")
                if place in owner:
                    raise WrongDraw(f"{where}: {place} is taken by {group}.{owner[place]}; draw a place once")
                owner[place] = name
