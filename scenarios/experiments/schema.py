"""The schema of a scenario: true plant, experiment, assumed values, tolerances, random values, error sources.

`experiment.protocol = ["bare", "light", "heavy", "bare"]` names the payload of each motion, in order of time. `bare` is
the flange alone. Other names are keys of `[plant.payloads]` and `[belief.payloads]`; `loaded` is the payload in key
`payload` of both. Motions of one name are one mounting.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeVar

from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

import rx90_mjcf
from ident.estimation.estimators import DEFAULT, ESTIMATORS
from ident.estimation.problem import GainOptions
from ident.observation.observation import ObserveOptions
from ident.payload.payload import Payload, payload_to_table, read_payload
from ident.support.errors import OptionError
from ident.support.naming import nearest, shown
from ident.support.options import options_from_table
from scenarios.experiments.scenario_files import LOADED, ROBOT
from scenarios.support.errors import WrongValue
from sim.controller import ControllerOptions
from sim.effects import ModelErrors
from sim.plant import PayloadBody
from sim.sensors import STREAMS, SensorOptions
from sim.tables import InertiaTable, Table, validated_table

BARE = "bare"
PAIR = (BARE, LOADED)
"""The paper's protocol, the default."""
TURNS = (BARE, LOADED, LOADED, BARE)
"""The protocol that measures drift of the gains: both mountings have the same mean time."""
UNLOADED = "unloaded"
"""Name of a bare motion in files and messages."""
NAME = re.compile(r"[a-z][a-z0-9_]*")
"""Pattern of names of mountings; they are used as file names, in which a hyphen precedes the repetition number."""
MOST_MOTIONS = 64
"""Largest number of motions of an experiment."""
DRAWABLE = ("plant.", "experiment.", "belief.", "identification.", "tolerance.gain")
"""Tables whose values a run or a source may change."""

Body = TypeVar("Body")
Vector = tuple[float, ...]
Triple = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Seconds = Annotated[float, Field(ge=0.0, le=1e6, allow_inf_nan=False)]
Known = Literal["all", "mass"]


def mountings(protocol: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the payloads that a protocol mounts, in the order of their first motions."""
    return tuple(dict.fromkeys(name for name in protocol if name != BARE))


def motion_names(protocol: Sequence[str]) -> tuple[str, ...]:
    """Return a name for each motion: `unloaded` or its mounting, with suffixes `-2` and so on for repetitions."""
    earlier = [list(protocol[:k]).count(carried) for k, carried in enumerate(protocol)]
    names = [UNLOADED if carried == BARE else carried for carried in protocol]
    return tuple(f"{name}-{times + 1}" if times else name for name, times in zip(names, earlier, strict=True))


def grouped(protocol: Sequence[str]) -> tuple[int, ...]:
    """Return the motions in order of identification: of time, but those of one payload grouped at its first one."""
    first = {name: list(protocol).index(name) for name in mountings(protocol)}
    return tuple(sorted(range(len(protocol)), key=lambda k: first.get(protocol[k], k)))


def in_turns(protocol: Sequence[str]) -> bool:
    """Whether a mounting has motions before and after those of another one, which show how gains drift in time."""
    turns = [name for name, _ in groupby(protocol)]
    return len(turns) > len({*turns})


def by_mounting(single: Body | None, named: Mapping[str, Body]) -> dict[str, Body]:
    """Return payloads by mounting; the one in key `payload` is `loaded`."""
    return {**({} if single is None else {LOADED: single}), **named}


class BodyTable(Table):
    """The true payload, in the frame of the last link."""

    mass: Positive  # its mass [kg]
    com: Triple  # its centre of mass [m]
    inertia: InertiaTable  # about the centre of mass [kg m^2]

    @property
    def body(self) -> PayloadBody:
        """The rigid body for simulation."""
        J = self.inertia
        return PayloadBody(mass=self.mass, com=self.com, inertia=(J.ixx, J.iyy, J.izz, J.ixy, J.ixz, J.iyz))

    @classmethod
    def of(cls, payload: str) -> "BodyTable":
        """Return the numbers of a name of `rx90_mjcf.PAYLOADS`."""
        if payload not in rx90_mjcf.PAYLOADS:
            it, known = f"{shown(payload)}{nearest(payload, rx90_mjcf.PAYLOADS)}", ", ".join(rx90_mjcf.PAYLOADS)
            raise PydanticCustomError("payload", "unknown payload {it}; known: {known}", {"it": it, "known": known})
        stated = payload_to_table(read_payload(rx90_mjcf.PAYLOADS[payload]))
        return cls.model_validate({key: stated[key] for key in cls.model_fields})


def body_of(payload: Payload) -> PayloadBody:
    """Return a complete payload as a rigid body."""
    assert payload.com is not None, "its centre is stated"
    assert payload.inertia is not None, "its moments are stated"
    return PayloadBody(mass=payload.mass, com=payload.com, inertia=payload.inertia)


if TYPE_CHECKING:  # a name is replaced by its numbers
    Carried = BodyTable
    Believed = dict[str, object]
    Stream = str
else:
    Stream = Literal[STREAMS]
    Carried = Annotated[str, AfterValidator(BodyTable.of)] | BodyTable
    Believed = Annotated[str, AfterValidator(lambda name: BodyTable.of(name).model_dump())] | dict[str, object]


class PlantTable(Table):
    """The true plant. Arrays have one entry per joint; an omitted array has the values of the nominal drives."""

    payload: Carried | None = None  # the payload of `loaded` motions: a name of `rx90_mjcf.PAYLOADS` or a table
    payloads: dict[str, Carried] = Field({})  # further payloads, by their names in the protocol
    gain: Vector | None = None  # drive gains [N m / drive unit], [N / drive unit] for prismatic joints
    amplifier_offset: Vector | None = None  # current references at zero torque [drive units]
    rotor_inertia: Vector | None = None  # inertias of the rotors, joint side [kg m^2]
    viscous_friction: Vector | None = None  # viscous friction [N m s/rad]
    coulomb_friction: Vector | None = None  # Coulomb friction [N m]
    coulomb_asymmetry: Vector | None = None  # asymmetry of Coulomb friction between the directions [N m]
    current_limit: Vector | None = None  # saturation of the current reference [drive units]
    errors: ModelErrors = ModelErrors()  # effects of the robot that the identification model lacks


class ExperimentTable(Table):
    """The experiment: the motion is repeated for each entry of `protocol`, which states the payload.

    `bare` is the flange alone, `loaded` the plant's `payload`, any other name one of its `payloads`. Every motion has
    independent noise, and friction may drift between motions. Drives that warm up stay warm.
    """

    motion: str  # name of a built-in motion, or a motion file in the scenario's folder
    protocol: tuple[str, ...] = PAIR  # the payload of each motion, or bare
    warm_up: Seconds = 0.0  # duration of the warm-up: the robot repeats the first motion with a bare flange [s]
    pause: Seconds = 0.0  # rest before each motion but the first, brakes on [s]
    step: Positive  # step of the physics [s]
    controller: ControllerOptions = ControllerOptions()  # the digital controller
    sensors: SensorOptions = SensorOptions()  # encoders, current sensors and clocks


class BeliefTable(Table):
    """Values that controller and identification assume.

    The identification model has only these couplings, whatever the robot has. Mass, centre and inertia of a payload of
    `rx90_mjcf.PAYLOADS` are taken as exact.
    """

    controller_gain: Vector  # assumed gains that the controller divides torque by [N m / drive unit]
    couplings: tuple[tuple[int, int], ...] = ()  # joints, from 1, whose second motor turns with the sum, as `[[5, 6]]`
    payload: Believed | None = None  # the assumed payload: a name of `rx90_mjcf.PAYLOADS` or a table as in their files
    payloads: dict[str, Believed] = Field({})  # further assumed payloads, by their names in the protocol
    known: Known | None = None  # overrides `known` of all payloads


class IdentificationTable(Table):
    """Method of identification and its options."""

    method: str = DEFAULT  # name of the estimator
    options: dict[str, bool | float | str] = Field(default={})  # options of the method
    observe: ObserveOptions = ObserveOptions()  # filters and rows of the linear system
    gains: GainOptions = GainOptions()  # limits for accepting a gain

    @property
    def method_options(self) -> object:
        """Options of the method, an instance of its options class."""
        return options_from_table(ESTIMATORS[self.method].options, self.options)


class ToleranceTable(Table):
    """Criteria for passing."""

    gain: tuple[Positive, ...]  # largest relative error of each gain that passes
    identifiable: tuple[bool, ...]  # joints whose gains should be identifiable
    pass_rate: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.95  # share of a study's trials that each joint must pass


class CostTable(Table):
    """Costs of `belief.controller_gain`, beside the identified gains, on a motion not used for identification."""

    payload: Carried  # its payload, whose mass is known exactly: a name of `rx90_mjcf.PAYLOADS` or a table
    mass_error: Positive = 0.02  # largest relative error of the payload's mass that passes, with the identified gains


class DrawTable(Table):
    """A random change of the scenario: numbers from a distribution of `scipy.stats`, or one value of a set.

    An array among the parameters has one value per number of a target, or of all targets in order.
    """

    target: str | tuple[str, ...]  # key path of the numbers in the scenario, such as `plant.gain`, or a list of paths
    distribution: str | None = None  # continuous distribution of `scipy.stats` with a quantile function of its own
    parameters: dict[str, float | Vector] = Field({})  # parameters of the distribution, numbers or arrays
    apply: Literal["replace", "add", "multiply"] = "replace"  # use of the drawn numbers
    shared: bool = False  # whether one number is drawn for the whole target, instead of one per number
    choice: tuple[str | float, ...] | None = None  # a set from which one value is drawn, instead of a distribution

    @property
    def targets(self) -> tuple[str, ...]:
        """Key paths in the scenario that it changes."""
        return (self.target,) if isinstance(self.target, str) else self.target


class SourceTable(DrawTable):
    """An error source of the error budget: a drawn value as in `DrawTable`, or a noise."""

    stream: Stream | None = None  # the noise that this source switches on, with its own random numbers
    size: float | None = None  # size of the noise (default: the scenario's value)
    off: float | None = None  # value with this source off (default: the scenario's)


class ScenarioTable(Table):
    """A scenario file after `extends` is resolved."""

    description: str  # one line for `rx90 list`
    robot: str = ROBOT  # name of a built-in robot, or path of a robot file relative to the scenario's folder
    plant: PlantTable  # the true robot
    experiment: ExperimentTable  # the motions, controller and sensors
    belief: BeliefTable  # values that controller and identification assume
    identification: IdentificationTable = IdentificationTable()  # how gains are identified
    tolerance: ToleranceTable  # criteria for passing
    cost: CostTable | None = None  # if stated, single runs (not studies) also estimate what controller_gain costs
    random: dict[str, DrawTable] = Field({})  # random values of every trial of a study, by names of your choice
    sources: dict[str, SourceTable] = Field({})  # error sources of the error budget, by names of your choice


@dataclass(frozen=True, slots=True)
class Scenario:
    """A named scenario."""

    name: str  # of the built-in scenario or the file; of `scenario.toml`, that of its folder
    folder: Path  # of its file and its motions
    table: ScenarioTable  # with all numbers of drives and payloads


OTHER_FILES = {"mass": "payload", "gains": "gains", "sine": "motion", "drives": "robot"}
"""Kinds of files by a key that no scenario has."""


def validated(table: Mapping[str, object], path: str) -> ScenarioTable:
    """Validate a scenario's tables; `path` is its name in messages."""
    for kind in (kind for key, kind in OTHER_FILES.items() if key in table):
        raise WrongValue(f"{path}: this is a {kind} file; expected a scenario")
    parsed = validated_table(ScenarioTable, table, path, WrongValue)
    check(parsed, path)
    for fault in (*_payload_faults(parsed), *_draw_faults(parsed)):
        raise WrongValue(f"{path}: {fault}")
    return parsed


def check(table: ScenarioTable, path: str) -> None:
    """Check what `with_settings` may change; raises `WrongValue` for the first wrong value."""
    for fault in _faults(table):
        raise WrongValue(f"{path}: {fault}")


def _faults(table: ScenarioTable) -> Iterator[str]:
    n, belief, chosen = len(table.tolerance.gain), table.belief, table.identification
    arrays = {
        "tolerance.identifiable": table.tolerance.identifiable,
        "belief.controller_gain": belief.controller_gain,
        **{f"plant.{name}": value for name, value in table.plant if isinstance(value, tuple)},
    }
    for where, values in arrays.items():
        if len(values) != n:
            yield f"{where}: {len(values)} values, but tolerance.gain has {n}; one per joint"
    if not all(belief.controller_gain):
        yield "belief.controller_gain: a gain of zero commands nothing"
    for first, second in belief.couplings:
        if first == second or not {first, second} <= set(range(1, n + 1)):
            yield f"belief.couplings: joints {first} and {second}; expected two joints from 1 to {n}, such as [[5, 6]]"
    if chosen.method not in ESTIMATORS:
        yield f"identification.method: unknown {chosen.method!r}{nearest(chosen.method, ESTIMATORS)}"
    try:
        _ = chosen.method_options
    except OptionError as error:
        yield f"identification.options: {error}"


def _payload_faults(table: ScenarioTable) -> Iterator[str]:
    """Yield what is wrong with payloads: every one of the protocol is described once in plant and belief."""
    protocol, plant, belief = table.experiment.protocol, table.plant, table.belief
    sides = {name: by_mounting(each.payload, each.payloads) for name, each in (("plant", plant), ("belief", belief))}
    if not 0 < len(protocol) <= MOST_MOTIONS:
        expected = f'expected 1 to {MOST_MOTIONS}, such as ["bare", "loaded"]'
        yield f"experiment.protocol: {len(protocol)} motions; {expected}"
    for side, each in (("plant", plant), ("belief", belief)):
        if each.payload is not None and LOADED in each.payloads:
            yield f"{side}: payload and payloads.{LOADED} denote the same payload; state one of them"
        for name in sides[side]:
            if not NAME.fullmatch(name) or name in (BARE, UNLOADED):
                expected = f"expected small letters, digits and _, not {BARE} or {UNLOADED}"
                yield f"{side}.payloads: {shown(name)} is no name for a payload; {expected}"
    if not sides["plant"]:
        yield "plant: no payload; state payload, or payloads by name"
    for where, names, known in (
        ("belief: plant has no payload", sides["belief"], sides["plant"]),
        ("plant: belief has no payload", sides["plant"], sides["belief"]),
        ("experiment.protocol: no payload", protocol, (BARE, *sides["plant"])),
    ):
        for name in names:
            if name not in known:
                yield f"{where} {shown(name)}{nearest(name, known)}; known: {', '.join(known) or 'none'}"
    if table.cost is not None and len({name == BARE for name in protocol}) < 2:
        yield f"cost: needs a bare and a loaded motion in experiment.protocol, got {', '.join(protocol)}"


def _draw_faults(table: ScenarioTable) -> Iterator[str]:
    """Yield what is wrong with draws: each has exactly one form, and no two of a group change the same value."""
    for group, draws in (("random", table.random), ("sources", table.sources)):
        owner: dict[str, str] = {}
        for name, draw in draws.items():
            where, source = f"{group}.{name}", draw if isinstance(draw, SourceTable) else None
            stream = None if source is None else source.stream
            if sum(way is not None for way in (draw.distribution, draw.choice, stream)) != 1:
                yield f"{where}: give either a distribution, or a choice, or for a source its stream"
            if source is not None and source.size is not None and stream is None:
                yield f"{where}: size applies to noise only; a drawn source gets its size from its distribution"
            if not draw.targets:
                yield f"{where}: target is empty; name the value to draw"
            for place in (*draw.targets, *([] if stream is None else [f"the stream {stream}"])):
                if stream is None and not place.startswith(DRAWABLE):
                    yield f"{where}: {place!r} cannot be drawn; targets begin with {', '.join(DRAWABLE)}"
                if place in owner:
                    yield f"{where}: {place} is already used by {group}.{owner[place]}; draw each value once"
                owner[place] = name
