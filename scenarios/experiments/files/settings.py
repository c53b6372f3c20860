"""Settings: values of a scenario by key path, as `plant.payload.mass` = 7.0."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from functools import lru_cache
from typing import Any

from pydantic import BaseModel, TypeAdapter, ValidationError

from ident.estimation.estimators import ESTIMATORS
from ident.support.naming import nearest
from ident.support.options import options_from_table, table_from_words
from scenarios.experiments.files.loading import check_lengths, refusal
from scenarios.experiments.files.schema import Scenario, ScenarioTable
from scenarios.support.errors import ScenarioError

Value = float | str | list[float]
"""A value of a scenario: a number, a name, or one number per joint or axis."""
OPTIONAL = "plant.errors."
"""Keys whose omitted array means zeros, one per joint."""


def value_at(table: ScenarioTable, place: str) -> Value:
    """Return the value at a key path of a scenario.

    Raises:
        ScenarioError: If it does not exist, or is a table.
    """
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
    if isinstance(inner, list | tuple) and all(_is_number(x) for x in inner):
        return [float(x) for x in inner]
    if isinstance(inner, str):
        return inner
    if isinstance(inner, float | int) and _is_number(inner):
        return float(inner)
    kind = "a table" if _entries(inner) else f"{inner!r}"
    raise ScenarioError(f"{place} holds {kind}; expected a number, an array of numbers or a name")


def place_of(table: ScenarioTable, name: str) -> str:
    """Return the full key path for its end: `identification.observe.cutoff_hz` for `observe.cutoff_hz`.

    Raises:
        ScenarioError: If there is no such path, or more than one.
    """
    found = [place for place in _places(table, "") if f".{place}".endswith(f".{name}")]
    if len(found) > 1 and name not in found:
        raise ScenarioError(f"{name} is ambiguous: {', '.join(found)}; expected one of them")
    place = found[0] if len(found) == 1 else name
    value_at(table, place)
    return place


def _places(node: object, above: str) -> Iterator[str]:
    """Return all key paths below a table that are not tables."""
    for key, value in _entries(node).items():
        yield from _places(value, f"{above}{key}.") if _entries(value) else [f"{above}{key}"]


def with_settings(scenario: Scenario, settings: Mapping[str, Value]) -> Scenario:
    """Return the scenario with changed values and without random tables.

    Only tables with changed values are validated again.

    Raises:
        ScenarioError: If a key path does not exist.
        WrongValue: If a value is not valid.
    """
    changes: dict[str, Any] = {}
    for place, value in settings.items():
        value_at(scenario.table, place)
        *above, last = place.split(".")
        inner = changes
        for key in above:
            inner = inner.setdefault(key, {})
        inner[last] = value
    update = {key: _changed(getattr(scenario.table, key), inner, key, scenario.name) for key, inner in changes.items()}
    table = scenario.table.model_copy(update={**update, "random": {}})
    check_lengths(table, scenario.name)
    return replace(scenario, table=table)


def _changed(node: object, changes: object, place: str, name: str) -> object:
    """Return a table with changes applied and validated; other values are replaced."""
    entries = _entries(node)
    if not isinstance(changes, Mapping):
        return tuple(changes) if isinstance(changes, list) else changes
    values = {**entries, **{k: _changed(entries[k], v, f"{place}.{k}", name) for k, v in changes.items()}}
    try:
        if isinstance(node, BaseModel):
            return type(node).model_validate(values, strict=True)
        if is_dataclass(node):
            return _adapter(type(node)).validate_json(json.dumps(values), strict=True)
    except ValidationError as error:
        raise refusal(error, name, place) from error
    return {k: list(v) if isinstance(v, tuple) else v for k, v in values.items()}


@lru_cache(maxsize=32)
def _adapter(kind: type) -> TypeAdapter[Any]:
    return TypeAdapter(kind)


def _entries(node: object) -> dict[str, Any]:
    """Return the items of a table; empty if it is not a table."""
    if isinstance(node, BaseModel):
        return dict(node.__dict__)
    if is_dataclass(node):
        return {name: getattr(node, name) for name in _names(type(node))}
    return {str(key): value for key, value in node.items()} if isinstance(node, Mapping) else {}


@lru_cache(maxsize=32)
def _names(kind: type) -> tuple[str, ...]:
    return tuple(field.name for field in fields(kind))


def _is_number(value: object) -> bool:
    return isinstance(value, float | int) and not isinstance(value, bool)


def with_method(scenario: Scenario, method: str | None, words: Sequence[str]) -> Scenario:
    """Return the scenario with another method or other options.

    Args:
        scenario: The scenario.
        method: A name in `ESTIMATORS`, None for the scenario's.
        words: `KEY=VALUE`, options of the method; a named method starts from its defaults.

    Raises:
        OptionError: If an option does not exist or a value is not valid.
    """
    stated = scenario.table.identification
    if method is None and not words:
        return scenario
    name = stated.method if method is None else method
    kept = stated.options if method is None else {}
    told = table_from_words(ESTIMATORS[name].options, words)
    options_from_table(ESTIMATORS[name].options, {**kept, **told})
    chosen = stated.model_copy(update={"method": name, "options": {**kept, **told}})
    return replace(scenario, table=scenario.table.model_copy(update={"identification": chosen}))
