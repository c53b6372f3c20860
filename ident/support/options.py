"""Options of the identification: frozen dataclasses with validation, created from a table or from words.

Ranges are annotations, `Annotated[float, Interval(ge=0.0, le=1.0), Unit("m")]`, of options, model errors and sensors;
scenario files and their schema use the same ones.
"""

import sys
import types
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields, is_dataclass
from functools import lru_cache
from math import isfinite
from typing import TYPE_CHECKING, Any, TypeVar, Union, cast, get_args, get_origin, get_type_hints

from annotated_types import Interval, Unit

from ident.support.errors import OptionError
from ident.support.naming import nearest

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Options = TypeVar("Options")
NAMES = "names"
"""Key of a field's metadata: the allowed names, which a command line lists."""
MEASURED = "measured"
"""Key of a field's metadata: what `auto` estimates from the logs; the number may be negative."""
DESCRIBED: dict[type, str] = {float: "a number", int: "a whole number", bool: "true or false", str: "a name"}


def unknown_name(option: str, value: str, known: Iterable[str]) -> OptionError:
    """Return the message for an option whose value is not an allowed name."""
    return OptionError(f"{option} = {value!r}: expected one of {', '.join(known)}{nearest(value, known)}")


def options_from_words(kind: type[Options], words: Sequence[str]) -> Options:
    """Create an options object from words `KEY=VALUE`; raises as `table_from_words` and `options_from_table`."""
    return options_from_table(kind, table_from_words(kind, words))


def options_from_table(kind: type[Options], table: Mapping[str, object]) -> Options:
    """Create an options object from a table, as in TOML.

    Args:
        kind: A frozen dataclass with a default for every field.
        table: Values by field name; omitted fields have defaults.

    Raises:
        OptionError: If a key is unknown, or a value has the wrong type or is out of range.
    """
    hints, values = option_types(kind), dict[str, object]()
    for name, value in table.items():
        if name not in hints:
            raise OptionError(f"unknown option {name!r}{nearest(name, hints)}; known: {', '.join(hints) or 'none'}")
        kinds = _kinds(hints[name])
        values[name] = value
        if isinstance(value, int) and not isinstance(value, bool) and float in kinds and int not in kinds:
            values[name] = float(value) if abs(value) <= sys.float_info.max else float("inf")
        elif (isinstance(value, bool) and bool not in kinds) or not isinstance(value, kinds):
            expected = " or ".join(DESCRIBED[each] for each in kinds if each in DESCRIBED)
            raise OptionError(f"{name} = {value!r}: expected {expected}")
    return kind(**values)


def table_from_words(kind: type, words: Sequence[str]) -> dict[str, object]:
    """Return keys and values of words `KEY=VALUE`, for `options_from_table`, which checks them.

    Raises:
        OptionError: If a word has another form or a key is duplicate.
    """
    hints, table = option_types(kind), dict[str, object]()
    for word in words:
        name, equals, text = (part.strip() for part in word.partition("="))
        name = name.replace("-", "_")
        if not equals or not name:
            raise OptionError(f"option {word!r}: expected KEY=VALUE")
        if name in table:
            raise OptionError(f"option {name} is given twice")
        table[name] = text  # unless it matches another type
        kinds = _kinds(hints.get(name, str))
        if bool in kinds and text.lower() in ("true", "false"):
            table[name] = text.lower() == "true"
        for number in (float, int):
            with suppress(ValueError):
                table[name] = number(text) if number in kinds else table[name]
    return table


def option_types(kind: type) -> dict[str, object]:
    """Return the types of an options class by field name."""
    if not is_dataclass(kind):
        raise TypeError(f"{kind.__name__} is no dataclass")
    hints = get_type_hints(kind)
    return {field.name: hints[field.name] for field in fields(kind)}


def _kinds(hint: object) -> tuple[type, ...]:
    return cast("tuple[type, ...]", get_args(hint) if get_origin(hint) in (Union, types.UnionType) else (hint,))


def refuse_outside(values: "DataclassInstance", error: Callable[..., Exception], place: str = "") -> None:
    """Check that every number of a dataclass is finite and inside its annotated range.

    Args:
        values: A dataclass; fields that are not numbers are ignored.
        error: Class of the error that is raised.
        place: Context for the message.
    """
    within = f"{place}: " if place else ""
    for name, hint in _annotated(type(values)).items():
        value = getattr(values, name)
        if not isinstance(value, float | int):
            continue
        if not isfinite(value):
            raise error(f"{within}{name} = {value}: expected a finite number")
        details = get_args(hint)[1:]
        unit = "".join(f" {each.unit}" for each in details if isinstance(each, Unit))
        for each in details:
            if not isinstance(each, Interval):
                continue
            low: Any = each.gt if each.ge is None else each.ge
            high: Any = each.lt if each.le is None else each.le
            above = value > low if each.ge is None else value >= low
            if not (above and (value < high if each.le is None else value <= high)):
                more, less = "more than " * (each.ge is None), "less than " * (each.le is None)
                said = f"{within}{name} = {value:g}: expected {more}{low:g} to {less}{high:g}{unit}"
                raise error(said, value=value, bounds=(low, high))


@lru_cache(maxsize=64)
def _annotated(kind: type) -> Mapping[str, object]:
    return get_type_hints(kind, include_extras=True)
