"""A scenario: loaded once, with every number stated; changed by key path; converted to the inputs of a run.

Names of payloads and omitted drives are replaced by their numbers at loading, so repetitions read no file again. A key
path is `plant.payload.mass`. The inputs of `sim` and `ident` keep true and assumed values separate.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from pydantic import BaseModel, ValidationError

from ident.estimation.estimators import ESTIMATORS
from ident.model.structure import Structure
from ident.payload.payload import Payload, payload_from_table, payload_to_table
from ident.support.arrays import Array, readonly
from ident.support.errors import PayloadError, placed
from ident.support.naming import nearest
from ident.support.options import is_number, options_from_table, table_from_words
from scenarios.experiments.motions import read_motion
from scenarios.experiments.robots import robot
from scenarios.experiments.robots import structure as believed_structure
from scenarios.experiments.scenario_files import LOADED, MOTION, scenario_table
from scenarios.experiments.schema import (
    BARE,
    Scenario,
    ScenarioTable,
    by_mounting,
    check,
    motion_names,
    mountings,
    validated,
)
from scenarios.support.errors import ScenarioError, WrongValue
from sim.controller import ControllerBelief
from sim.effects.motors import gain_at
from sim.experiment import Experiment
from sim.plant import PayloadBody, Plant
from sim.robot import DriveTruth, Robot
from sim.tables import fault_of

Value = float | str | list[float]
"""A value of a scenario: a number, a name, or one number per joint or axis."""
UNNAMED = "scenario"
"""Name of files that are known by the name of their folder."""
OPTIONAL = "plant.errors."
"""Keys whose omitted array means zeros, one per joint."""
CHECK = "check-weight"
"""Name of the motion that is not used for identification; no mounting can have a name with a hyphen."""


def load_scenario(name: str) -> Scenario:
    """Read a built-in scenario or a user's file, with all numbers, and without payloads that are never mounted.

    Raises `ScenarioError` if anything in it is wrong or does not exist, `PlantError` if its robot's file is not valid.
    """
    stated, path = scenario_table(name)
    scenario = Scenario(
        name=path.parent.name or path.stem if path.stem == UNNAMED else path.stem,
        folder=path.parent,
        table=validated(stated, str(path)),
    )
    table, nominal = scenario.table, robot_of(scenario).drives
    believed = {key: payload_to_table(payload) for key, payload in stated_payloads(scenario).items()}
    true = by_mounting(table.plant.payload, table.plant.payloads)
    used = mountings(table.experiment.protocol) or tuple(true)  # a draw of a payload that is never mounted is an error
    plant, belief = (
        {"payload": of.get(LOADED) if LOADED in used else None, "payloads": {k: of[k] for k in used if k != LOADED}}
        for of in (true, believed)
    )
    omitted = [field.name for field in fields(DriveTruth) if getattr(table.plant, field.name) is None]
    plant |= {name: tuple(getattr(nominal, name).tolist()) for name in omitted}
    update = {"plant": table.plant.model_copy(update=plant), "belief": table.belief.model_copy(update=belief)}
    return replace(scenario, table=table.model_copy(update=update))


def robot_of(scenario: Scenario) -> Robot:
    """The robot; raises as `robots.robot`, with the scenario that names it."""
    with placed(f"{scenario.name}: robot"):
        return robot(scenario.table.robot, scenario.folder)


def stated_payloads(scenario: Scenario) -> dict[str, Payload]:
    """Return the assumed payloads, with standard deviations, by mounting; `ScenarioError` for an impossible one."""
    belief, found = scenario.table.belief, dict[str, Payload]()
    for key, stated in by_mounting(belief.payload, belief.payloads).items():
        try:
            payload = payload_from_table(stated)
            found[key] = payload if belief.known is None else replace(payload, known=belief.known)
        except PayloadError as error:
            where = "" if key == LOADED else f"payloads.{key}: "
            raise ScenarioError(f"{scenario.name}: belief.{where}{error}") from error
    return found


def value_at(table: ScenarioTable, place: str) -> Value:
    """Return the value at a key path of a scenario; raises `ScenarioError` if it does not exist, or is a table."""
    inner: object = table
    for depth, key in enumerate(keys := place.split(".")):
        below = _entries(inner)
        if inner is None and keys[depth - 1] == "payload":
            raise ScenarioError(f"{'.'.join(keys[:depth])}: no motion of experiment.protocol carries this payload")
        if key not in below:
            at = ".".join(keys[:depth]) or "the scenario"
            raise ScenarioError(f"no {key!r} in {at}{nearest(key, below)}; known: {', '.join(below) or 'nothing'}")
        inner = below[key]
    if inner is None and place.startswith(OPTIONAL):
        return [0.0] * len(table.tolerance.gain)
    if isinstance(inner, list | tuple) and all(map(is_number, inner)):
        return [float(x) for x in inner]
    if isinstance(inner, str):
        return inner
    if is_number(inner):
        return float(inner)
    kind = "a table" if _entries(inner) else f"{inner!r}"
    raise ScenarioError(f"{place} holds {kind}; expected a number, an array of numbers or a name")


def place_of(table: ScenarioTable, name: str) -> str:
    """Return the full key path for its end, as `identification.observe.cutoff_hz` for `observe.cutoff_hz`."""

    def places(node: object, above: str) -> Iterator[str]:
        for key, value in _entries(node).items():
            yield from places(value, f"{above}{key}.") if _entries(value) else [f"{above}{key}"]

    found = [place for place in places(table, "") if f".{place}".endswith(f".{name}")]
    if len(found) > 1 and name not in found:
        raise ScenarioError(f"{name} is ambiguous: {', '.join(found)}; expected one of them")
    place = found[0] if len(found) == 1 else name
    value_at(table, place)
    return place


def with_settings(scenario: Scenario, settings: Mapping[str, Value]) -> Scenario:
    """Return the scenario with changed values, whose tables are validated again, and without random tables."""
    changes: dict[str, dict[str, Any]] = {}
    for place, value in settings.items():
        value_at(scenario.table, place)
        key, *above, last = place.split(".")
        if key not in changes:
            changes[key] = getattr(scenario.table, key).model_dump(mode="json")
        inner = changes[key]
        for each in above:
            inner = inner[each]
        inner[last] = value
    update: dict[str, object] = {"random": {}}
    for key, values in changes.items():
        try:
            update[key] = type(getattr(scenario.table, key)).model_validate_json(json.dumps(values), strict=True)
        except ValidationError as error:
            raise WrongValue(f"{scenario.name}: {fault_of(error, key)}") from error
    table = scenario.table.model_copy(update=update)
    check(table, scenario.name)
    return replace(scenario, table=table)


def _entries(node: object) -> dict[str, Any]:
    """Return the items of a table; empty if it is not a table."""
    if isinstance(node, BaseModel):
        return dict(node.__dict__)
    if is_dataclass(node):
        return {field.name: getattr(node, field.name) for field in fields(node)}
    return {str(key): value for key, value in node.items()} if isinstance(node, Mapping) else {}


def with_method(scenario: Scenario, method: str | None, words: Sequence[str]) -> Scenario:
    """Return the scenario with another method or options, as `KEY=VALUE`; a named method starts from its defaults."""
    stated = scenario.table.identification
    name, kept = (stated.method, stated.options) if method is None else (method, {})
    options = {**kept, **table_from_words(ESTIMATORS[name].options, words)}
    options_from_table(ESTIMATORS[name].options, options)
    chosen = stated.model_copy(update={"method": name, "options": options})
    return replace(scenario, table=scenario.table.model_copy(update={"identification": chosen}))


@dataclass(frozen=True, slots=True, eq=False)
class Setup:
    """All inputs for running a scenario, for any seed."""

    scenario: Scenario
    plants: Mapping[str, Plant]  # the true plants, by mounting
    structure: Structure
    payloads: Mapping[str, Payload]  # the assumed payloads, by mounting
    experiments: tuple[Experiment, ...] = ()  # the motions, in order of time; empty if the robot has no motion yet
    check: Experiment | None = None  # one more motion, not used for identification; None without a table `cost`

    @property
    def plant(self) -> Plant:
        """The plant of the first mounting; drives and model errors are equal in all of them."""
        return next(iter(self.plants.values()))

    @property
    def true_gain(self) -> Array:
        """The injected drive gains [N m / drive unit], shape (n,)."""
        return self.plant.drives.gain

    def gain_under(self, currents: Sequence[Array]) -> Array:
        """Return the true gains at the rms of the currents (N, n) of the first motion with a payload, or the first."""
        loaded = [each.loaded for each in self.experiments]
        v = currents[loaded.index(True) if any(loaded) else 0]
        return gain_at(self.plant.errors, self.plant.drives, np.sqrt(np.mean(v**2, axis=0)))

    @property
    def protocol(self) -> tuple[str, ...]:
        """The mounting of each motion, `bare` or a name."""
        return self.scenario.table.experiment.protocol

    @property
    def mounted(self) -> tuple[Payload | None, ...]:
        """The assumed payload of each motion, None for a bare flange; motions of one mounting share one object."""
        return tuple(self.payloads.get(name) for name in self.protocol)

    @property
    def true_payloads(self) -> dict[str, PayloadBody]:
        """The true payloads, by mounting."""
        pairs = zip(self.protocol, self.experiments, strict=True)
        return {carried: experiment.plant.payload for carried, experiment in pairs if experiment.loaded}


def setup_without_motion(scenario: Scenario) -> Setup:
    """Prepare a scenario's robot without motions."""
    table, arm = scenario.table, robot_of(scenario)
    if len(table.tolerance.gain) != arm.n:
        raise ScenarioError(
            f"{scenario.name}: tolerance.gain has {len(table.tolerance.gain)} values, but robot {arm.name} has {arm.n} "
            "joints; state arrays of plant, belief and tolerance for this robot, one value per joint"
        )
    structure = believed_structure(arm, tuple((first - 1, second - 1) for first, second in table.belief.couplings))
    believed = stated_payloads(scenario)
    payloads = {name: believed[name] for name in mountings(table.experiment.protocol)}
    drives = _drives(**{field.name: getattr(table.plant, field.name) for field in fields(DriveTruth)})
    plants = {
        name: Plant(robot=arm, drives=drives, payload=body.body, errors=table.plant.errors)
        for name, body in by_mounting(table.plant.payload, table.plant.payloads).items()
    }
    return Setup(scenario, plants, structure, payloads)


def setup_of(scenario: Scenario) -> Setup:
    """Prepare a scenario with its motions."""
    setup = setup_without_motion(scenario)
    table, plant = scenario.table, setup.plant
    protocol, n = table.experiment.protocol, plant.robot.n
    try:
        motion = read_motion(table.experiment.motion, scenario.folder)
    except WrongValue as error:
        raise WrongValue(f"{scenario.name}: {MOTION}: {error}") from error
    if motion.n != n:
        raise ScenarioError(f"{scenario.name}: motion {table.experiment.motion!r} moves {motion.n} joints of {n}")
    belief = ControllerBelief(robot=plant.robot, gain=table.belief.controller_gain)
    stated = {name: getattr(table.experiment, name) for name in ("controller", "sensors", "step", "warm_up", "pause")}
    experiments = tuple(
        Experiment(
            name=name,
            plant=setup.plants.get(carried, plant),
            loaded=carried != BARE,
            trajectory=motion,
            belief=belief,
            earlier=earlier,
            **stated,
        )
        for earlier, (name, carried) in enumerate(zip(motion_names(protocol), protocol, strict=True))
    )
    check = None
    if table.cost is not None:
        weighed = replace(plant, payload=table.cost.payload.body)
        check = replace(experiments[-1], name=CHECK, plant=weighed, loaded=True, earlier=len(experiments))
    return replace(setup, experiments=experiments, check=check)


def changed(setup: Setup, settings: Mapping[str, Value]) -> Setup:
    """Return the setup with changed values of its scenario."""
    return setup_of(with_settings(setup.scenario, settings)) if settings else setup


@lru_cache(maxsize=16)
def _drives(**stated: tuple[float, ...]) -> DriveTruth:
    """Return the drives of given numbers, cached, so that scenarios that differ in something else share them."""
    return DriveTruth(**{name: readonly(values) for name, values in stated.items()})
