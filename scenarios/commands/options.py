"""Command line options from an options dataclass: names, defaults and help come from the class itself."""

import argparse
from collections.abc import Callable
from dataclasses import Field, fields
from typing import TYPE_CHECKING, TypeVar

import scenarios.commands.arguments as arguments
from ident.options import NAMES
from scenarios.files.attribute_docs import attribute_docs

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    Options = TypeVar("Options", bound=DataclassInstance)


def add_options(parser: argparse.ArgumentParser, kind: "type[Options]") -> None:
    """Add an option `--some-name` for every field `some_name` of an options dataclass.

    Args:
        parser: To add to.
        kind: The class; every field has a default.
    """
    docs = attribute_docs(kind)
    group = parser.add_argument_group()
    for field in fields(kind):
        said = docs.get(field.name, "").replace("%", "%%")
        if NAMES in field.metadata:
            said += f": {', '.join(field.metadata[NAMES])}"
        group.add_argument(
            flag(field.name),
            type=type_of(field),
            default=field.default,
            choices=field.metadata.get(NAMES),
            metavar="NAME" if NAMES in field.metadata else "X",
            help=f"{said} (default %(default)s)",
        )


def chosen(kind: "type[Options]", options: argparse.Namespace) -> "Options":
    """The options dataclass as given on the command line."""
    return kind(**{field.name: getattr(options, field.name) for field in fields(kind)})


def flag(name: str) -> str:
    """The option of a field."""
    return f"--{name.replace('_', '-')}"


def type_of(field: "Field[object]") -> Callable[[str], str | float]:
    """What turns the option's text into the field's value."""
    return str if isinstance(field.default, str) else arguments.not_negative
