"""Files as strict tables: a fault is one line that names the key, and for an unknown key the nearest known one."""

import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Annotated, Any, NamedTuple, TypeVar, get_args, get_origin, get_type_hints

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, ValidationError
from pydantic_core.core_schema import CoreSchema, no_info_after_validator_function

from ident.support.arrays import Array, readonly
from ident.support.naming import nearest, one_line, shown

BRANCHES = ("Table", "]", "float", "str", "bool")
"""Endings of what pydantic inserts into a place for the branches of a union; keys are in small letters."""
Model = TypeVar("Model", bound=BaseModel)


class Table(BaseModel):
    """A table of a file: unknown keys are errors, values are frozen and strictly typed."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)


class ValueOf(NamedTuple):
    """Annotation of a number, or of an array (n,), that a file states as a table with its `value`."""

    table: type[BaseModel]

    def __get_pydantic_core_schema__(self, _: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Validate as the table, and keep its value."""

        def value(stated: Any) -> float | Array:
            return readonly(stated.value) if isinstance(stated.value, list) else stated.value

        return no_info_after_validator_function(value, handler.generate_schema(self.table))


def validated_table(kind: type[Model], table: object, where: str, error: type[Exception]) -> Model:
    """Validate a table as parsed from TOML or JSON; raises `error`, with the name `where` of its file."""
    unknown = unknown_key(table, kind)
    if unknown is not None:
        raise error(f"{where}: {unknown}")
    try:
        # Strict, so that "1" and true are not numbers; as JSON, where an array may become a tuple.
        return kind.model_validate_json(json.dumps(table, default=str), strict=True)
    except ValidationError as fault:
        raise error(f"{where}: {fault_of(fault)}") from fault
    except ValueError as fault:  # a hexadecimal number of more digits than Python prints
        raise error(f"{where}: {one_line(fault)}") from fault


def unknown_key(table: object, hint: Any, where: str = "") -> str | None:
    """Return the first key that the type of a table does not have, and the nearest one; None if all are known."""
    if isinstance(table, list):
        found = (unknown_key(value, hint, f"{where}{number}.") for number, value in enumerate(table, 1))
        return next(filter(None, found), None)
    if not isinstance(table, Mapping):
        return None
    if get_origin(hint) is Annotated:
        stated = next((each.table for each in hint.__metadata__ if isinstance(each, ValueOf)), None)
        return unknown_key(table, stated or get_args(hint)[0], where)
    if get_origin(hint) is dict:  # names of the user's choice
        known = dict.fromkeys(table, get_args(hint)[1])
    elif is_dataclass(hint) or (isinstance(hint, type) and issubclass(hint, BaseModel)):
        names = [each.name for each in fields(hint)] if is_dataclass(hint) else hint.model_fields
        types = get_type_hints(hint, include_extras=True)
        known = {name: types[name] for name in names}
    else:  # str | X is a name or a table
        return next(filter(None, (unknown_key(table, each, where) for each in get_args(hint))), None)
    for key, value in table.items():
        if key not in known:
            return f"unknown key {where}{key}{nearest(key, known)}; known: {', '.join(known)}"
        below = unknown_key(value, known[key], f"{where}{key}.")
        if below is not None:
            return below
    return None


def fault_of(error: ValidationError, above: str = "") -> str:
    """Return the most specific error of pydantic in one line, `above` its table; places of arrays count from 1."""
    first = max(error.errors(), key=lambda fault: len(fault["loc"]))
    parts = [part + 1 if isinstance(part, int) else part for part in first["loc"] if not str(part).endswith(BRANCHES)]
    place = ".".join(map(str, [above, *parts] if above else parts))
    if first["type"] == "missing":
        return f"{place} is missing"
    what = one_line(first["msg"])
    return f"{place + ': ' if place else ''}{what[0].lower()}{what[1:]}, got {shown(first['input'])}"


class InertiaTable(Table):
    """Inertia about the centre of mass, axes of the last link [kg m^2]."""

    ixx: float  # moment about x [kg m^2]
    iyy: float  # moment about y [kg m^2]
    izz: float  # moment about z [kg m^2]
    ixy: float = 0.0  # product of x and y [kg m^2]
    ixz: float = 0.0  # product of x and z [kg m^2]
    iyz: float = 0.0  # product of y and z [kg m^2]
