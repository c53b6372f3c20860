"""Command-line options from an options dataclass: names, defaults and help are those of the class."""

import argparse
from collections.abc import Callable, Mapping
from dataclasses import Field, fields, replace
from typing import TYPE_CHECKING, TypeVar

import scenarios.command_line.arguments as arguments
from ident.observation.observation import ObserveOptions
from ident.support.options import MEASURED, NAMES
from scenarios.support.texts import attribute_docs

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    from ident.preparation import Policy

    Options = TypeVar("Options", bound=DataclassInstance)


def add_options(parser: argparse.ArgumentParser, kind: "type[Options]") -> None:
    """Add an option `--some-name` for every field `some_name` of an options dataclass. Every field has a default."""
    docs = attribute_docs(kind)
    group = parser.add_argument_group()
    for field in fields(kind):
        group.add_argument(
            flag(field.name),
            type=type_of(field),
            default=field.default,
            choices=field.metadata.get(NAMES),
            metavar="NAME" if NAMES in field.metadata else "X",
            help=f"{_said(field, docs)} (default %(default)s)",
        )


def add_current_delay(parser: argparse.ArgumentParser) -> None:
    """Declare only the delay of the currents, if other filters are those of a file."""
    (field,) = (each for each in fields(ObserveOptions) if MEASURED in each.metadata)
    said = _said(field, attribute_docs(ObserveOptions))
    parser.add_argument(
        flag(field.name), type=type_of(field), metavar="X", help=f"{said} (default: as in the gains file)"
    )


def _said(field: "Field[object]", docs: Mapping[str, str]) -> str:
    """Return the type of a field and its range."""
    said = docs.get(field.name, "").replace("%", "%%")
    if NAMES in field.metadata:
        return f"{said}: {', '.join(field.metadata[NAMES])}"
    if MEASURED in field.metadata:
        return f"{said}; {arguments.AUTO}: {field.metadata[MEASURED]} is estimated and compensated"
    return said


def chosen(kind: "type[Options]", options: argparse.Namespace) -> "Options":
    """Return the options dataclass from the command line; a value to be estimated has its default."""
    given = {field.name: getattr(options, field.name) for field in fields(kind)}
    return kind(**{name: value for name, value in given.items() if value != arguments.AUTO})


def policy_of(options: argparse.Namespace) -> "Policy":
    """Return the policy for logs: whether a delay of the currents is to be estimated."""
    from ident.preparation import DOUBTED

    return replace(DOUBTED, undelay=options.current_delay == arguments.AUTO)


def flag(name: str) -> str:
    """Return the option of a field."""
    return f"--{name.replace('_', '-')}"


def type_of(field: "Field[object]") -> Callable[[str], str | float]:
    """Return the function that converts the option's text to the field's value."""
    if MEASURED in field.metadata:
        return arguments.number_or_auto
    return str if isinstance(field.default, str) else arguments.not_negative
