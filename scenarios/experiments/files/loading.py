"""A scenario read from its tables: unknown keys, wrong values and contradictions are one line each."""

import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import get_args

from pydantic import BaseModel, ValidationError

from ident.estimation.estimators import ESTIMATORS
from ident.payload.payload import Payload
from ident.support.errors import OptionError
from ident.support.naming import nearest, shown
from scenarios.experiments.files.mountings import BARE, LOADED, by_mounting, check_protocol
from scenarios.experiments.files.places import BUILT_IN
from scenarios.experiments.files.resolved import resolved, stated_payloads
from scenarios.experiments.files.schema import (
    DRAWABLE,
    TABLES_OF_TABLES,
    DrawTable,
    Scenario,
    ScenarioTable,
    SourceTable,
)
from scenarios.experiments.files.tables import scenario_table, stating_file
from scenarios.support.errors import ScenarioError, UnknownName, WrongDraw, WrongValue

UNNAMED = "scenario"
"""Name of files that are known by the name of their folder."""


def load_scenario(name: str) -> Scenario:
    """Read, validate and resolve a built-in scenario or a user's file.

    Raises:
        ScenarioError: If it is missing, has an unknown key or a wrong value; the message names both.
        RobotError: If the file of its robot is not valid.
    """
    return resolved(_as_stated(name))


def payloads_as_stated(name: str) -> dict[str, Payload]:
    """Return the assumed payloads of a scenario, with specified standard deviations even if they are taken as exact.

    Raises:
        ScenarioError: As `load_scenario`.
    """
    return stated_payloads(_as_stated(name))


def _as_stated(name: str) -> Scenario:
    """Return a scenario as specified by its file and the extended ones."""
    table, path = scenario_table(name)
    loaded = scenario_from_table(table, _name_of(path), path.parent, str(path))
    wanted = stating_file(name, ("tolerance", "identifiable"))
    asking = {key: str(stating_file(name, tuple(key.split("."))) or path) for key in BUILT_IN}
    return replace(loaded, expectation="" if wanted is None else wanted.name, asking=asking)


def _name_of(path: Path) -> str:
    """Return the name of a scenario: of its file, or of the folder if the file has the common name."""
    return path.parent.name or path.stem if path.stem == UNNAMED else path.stem


def scenario_from_table(table: Mapping[str, object], name: str, folder: Path, where: str) -> Scenario:
    """Validate a scenario's tables; `folder` is the folder of its motions, `where` the name for messages.

    Raises:
        ScenarioError: If there is an unknown key or a wrong value; the message names both.
    """
    _refuse_unknown(table, ScenarioTable, where, "")
    try:
        # Strict, so that "1" and true are not numbers; as JSON, where an array may become a tuple.
        parsed = ScenarioTable.model_validate_json(json.dumps(table, default=str), strict=True)
    except ValidationError as error:
        raise refusal(error, where, "") from error
    check_lengths(parsed, where)
    _check_payloads(parsed, where)
    _check_draws(parsed, where)
    return Scenario(name, folder, parsed)


def refusal(error: ValidationError, where: str, place: str) -> WrongValue:
    """Return the error of pydantic in one line."""
    first = max(error.errors(), key=lambda fault: len(fault["loc"]))  # for a union, the most specific branch
    below = [str(part) for part in first["loc"] if not str(part).endswith(("Table", "]", "float", "str", "bool"))]
    what = first["msg"][0].lower() + first["msg"][1:]
    got = "" if first["type"] == "missing" else f", got {shown(first['input'])}"
    return WrongValue(f"{where}: {'.'.join([place, *below] if place else below)}: {what}{got}")


def _refuse_unknown(table: object, kind: type, path: str, where: str) -> None:
    """Check keys against the schema; the message suggests the nearest key, which pydantic does not."""
    if not isinstance(table, Mapping):
        return
    known = _subtables(kind)
    for key, value in table.items():
        if key not in known:
            raise ScenarioError(f"{path}: unknown key {where}{key}{nearest(key, known)}; known: {', '.join(known)}")
        inner = known[key]
        if inner is not None and key in TABLES_OF_TABLES and isinstance(value, Mapping):
            for name, each in value.items():
                _refuse_unknown(each, inner, path, f"{where}{key}.{name}.")
        elif inner is not None:
            _refuse_unknown(value, inner, path, f"{where}{key}.")


def _subtables(kind: type) -> dict[str, type | None]:
    """Return the keys of a table, with the class of subtables."""
    if is_dataclass(kind):
        return {field.name: None for field in fields(kind)}
    if issubclass(kind, BaseModel):
        return {name: _table_class(field.annotation) for name, field in kind.model_fields.items()}
    return {}


def _table_class(hint: object) -> type | None:
    """Return the class of a key's table, or of each table in a table of tables; None otherwise."""
    if isinstance(hint, type) and (is_dataclass(hint) or issubclass(hint, BaseModel)):
        return hint
    below = map(_table_class, get_args(hint))  # dict[str, X] has tables of class X, str | X is a table or its name
    return next((each for each in below if each is not None), None)


def check_lengths(table: ScenarioTable, path: str) -> None:
    """Check that every array has one entry per joint, and that the options of the method are valid.

    Raises:
        ScenarioError: If an array has another length (the first one).
        WrongValue: If a value is not one of the known ones.
    """
    n = len(table.tolerance.gain)
    arrays = {
        "tolerance.identifiable": table.tolerance.identifiable,
        "belief.controller_gain": table.belief.controller_gain,
        **{f"plant.{name}": value for name, value in table.plant if isinstance(value, tuple)},
    }
    for where, values in arrays.items():
        if len(values) != n:
            raise ScenarioError(f"{path}: {where}: {len(values)} values, but tolerance.gain has {n}; one per joint")
    if not all(table.belief.controller_gain):
        raise WrongValue(f"{path}: belief.controller_gain: a gain of zero commands nothing")
    for first, second in table.belief.couplings:
        if first == second or not {first, second} <= set(range(1, n + 1)):
            raise WrongValue(
                f"{path}: belief.couplings: joints {first} and {second}; expected two joints from 1 to {n}, "
                "such as [[5, 6]]"
            )
    method = table.identification.method
    if method not in ESTIMATORS:
        raise UnknownName(f"{path}: identification.method: unknown {method!r}{nearest(method, ESTIMATORS)}")
    try:
        _ = table.identification.method_options
    except OptionError as error:
        raise WrongValue(f"{path}: identification.options: {error}") from error


def _check_payloads(table: ScenarioTable, path: str) -> None:
    """Check that every payload of the protocol is described once in plant and belief."""
    for side, stated in (("plant", table.plant), ("belief", table.belief)):
        if stated.payload is not None and LOADED in stated.payloads:
            raise WrongValue(
                f"{path}: {side}: payload and payloads.{LOADED} denote the same payload; state one of them"
            )
    plant, belief = (
        by_mounting(table.plant.payload, table.plant.payloads),
        by_mounting(table.belief.payload, table.belief.payloads),
    )
    check_protocol(table.experiment.protocol, plant, belief, path)
    if table.cost is not None and len({name == BARE for name in table.experiment.protocol}) < 2:
        raise WrongValue(
            f"{path}: cost: needs a bare and a loaded motion in experiment.protocol, got "
            f"{', '.join(table.experiment.protocol)}"
        )
    for key, named in (("known", table.belief.known), ("exact", table.belief.exact)):
        for name in named if isinstance(named, Mapping) else ():
            if name not in belief:
                raise UnknownName(
                    f"{path}: belief.{key}: no payload {name!r}{nearest(name, belief)}; known: {', '.join(belief)}"
                )


def _check_draws(table: ScenarioTable, path: str) -> None:
    """Check that no two draws change the same value, and that each has exactly one form."""
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
                raise WrongDraw(
                    f"{where}: size applies to noise only; a drawn source gets its size from its distribution"
                )
            if not draw.targets:
                raise WrongDraw(f"{where}: target is empty; name the value to draw")
            for place in (*draw.targets, *([] if stream is None else [f"the stream {stream}"])):
                if stream is None and not place.startswith(DRAWABLE):
                    raise WrongDraw(f"{where}: {place!r} cannot be drawn; targets begin with {', '.join(DRAWABLE)}")
                if place in owner:
                    raise WrongDraw(f"{where}: {place} is already used by {group}.{owner[place]}; draw each value once")
                owner[place] = name
