"""Strict tables, as parsed from TOML or JSON, and options: frozen dataclasses, created from a table or from words.

Ranges are annotations, `Annotated[float, Interval(ge=0.0, le=1.0), Unit("m")]`, of options, model errors and sensors;
scenario files and their schema use the same ones.
"""

import types
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from math import isfinite
from sys import float_info
from typing import TYPE_CHECKING, Annotated, Any, TypeGuard, TypeVar, Union, cast, get_args, get_origin, get_type_hints

from annotated_types import Interval, Unit

from ident.support.errors import OptionError
from ident.support.naming import nearest, shown

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Options = TypeVar("Options")
NAMES = "names"
"""Key of a field's metadata: the allowed names, which a command line lists."""
MEASURED = "measured"
"""Key of a field's metadata: what `auto` estimates from the logs; the number may be negative."""
DESCRIBED: dict[type, str] = {float: "a number", int: "a whole number", bool: "true or false", str: "a name"}
"""What a field of a type takes, in words."""


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """A key of a strict table, by itself or as the annotation of a field."""

    expected: str  # what it takes, in words
    allowed: Callable[[object], bool]  # whether it takes a value
    many: bool = False  # whether an array of such values is taken too; the result is a tuple
    words: Mapping[str, object] = field(default_factory=dict[str, object])  # texts that stand for a value

    def or_word(self, word: str, value: object) -> "Key":
        """Return a key that also takes a text for a value."""
        return replace(self, expected=f"{self.expected}, or {word!r}", words={word: value})


def one_of(names: Collection[str]) -> Key:
    """Return a key that takes one of some names."""
    known = tuple(names)
    return Key(f"one of {', '.join(map(repr, known))}", lambda value: value in known)


def is_number(value: object, largest: float = float_info.max) -> TypeGuard[float]:
    """Return whether a value is a finite number of limited size, not true or false."""
    return not isinstance(value, bool) and isinstance(value, int | float) and abs(value) <= largest


def is_table(value: object) -> bool:
    """Return whether a value is a table."""
    return isinstance(value, Mapping)


def keys_of(kind: type, *, without: Collection[str] = ()) -> dict[str, Key]:
    """Return the keys of a dataclass: those that annotate its fields, or what a field of their type takes."""
    keys = dict[str, Key]()
    for name, (kinds, details) in _fields(kind).items():
        expected = " or ".join(DESCRIBED[each] for each in kinds if each in DESCRIBED)
        own = [each for each in details if isinstance(each, Key)]
        keys[name] = own[0] if own else Key(expected, partial(_takes, kinds))
    return {name: key for name, key in keys.items() if name not in without}


def _takes(kinds: tuple[type, ...], value: object) -> bool:
    if isinstance(value, bool):
        return bool in kinds
    return (float in kinds and is_number(value)) or isinstance(
        value, tuple(each for each in kinds if each is not float)
    )


def strict_table(
    table: Mapping[str, object], keys: Mapping[str, Key], error: Callable[[str], Exception], place: str = ""
) -> dict[str, Any]:
    """Return the values of a parsed table; numbers of keys that take many are of type float.

    Raises `error`, with the name `place` of the table, if a key is not among `keys` or its value not allowed.
    """
    within, found = f"{place}: " if place else "", dict[str, Any]()
    for name, value in table.items():
        if name not in keys:
            known = f"{nearest(name, keys)}; known: {', '.join(keys) or 'none'}"
            raise error(f"{within}unknown key {shown(name)}{known}")
        key = keys[name]
        if isinstance(value, str) and value in key.words:
            found[name] = key.words[value]
            continue
        each = cast("list[object]", value) if key.many and isinstance(value, list) else [value]
        if not each or not all(map(key.allowed, each)):
            raise error(f"{within}{name} = {shown(value)}: expected {key.expected}")
        found[name] = tuple(float(x) if isinstance(x, int) else x for x in each) if key.many else value
    return found


def unknown_name(option: str, value: str, known: Iterable[str]) -> OptionError:
    """Return the message for an option whose value is not an allowed name."""
    return OptionError(f"{option} = {value!r}: expected one of {', '.join(known)}{nearest(value, known)}")


def options_from_words(kind: type[Options], words: Sequence[str]) -> Options:
    """Create an options object from words `KEY=VALUE`; raises as `table_from_words` and `options_from_table`."""
    return options_from_table(kind, table_from_words(kind, words))


def options_from_table(kind: type[Options], table: Mapping[str, object]) -> Options:
    """Create an options object from a table, as in TOML; raises `OptionError` for an unknown key or a wrong value."""
    found = strict_table(table, keys_of(kind), OptionError)
    for name, (kinds, _) in _fields(kind).items():
        if float in kinds and int not in kinds and isinstance(found.get(name), int):
            found[name] = float(found[name])
    return kind(**found)


def table_from_words(kind: type, words: Sequence[str]) -> dict[str, object]:
    """Return keys and values of words `KEY=VALUE`, unchecked; raises `OptionError` for another form or a double key."""
    by_name, table = _fields(kind), dict[str, object]()
    for word in words:
        name, equals, text = (part.strip() for part in word.partition("="))
        name = name.replace("-", "_")
        if not equals or not name:
            raise OptionError(f"option {word!r}: expected KEY=VALUE")
        if name in table:
            raise OptionError(f"option {name} is given twice")
        table[name] = text  # unless it matches another type
        kinds, _ = by_name.get(name, ((), ()))
        if bool in kinds and text.lower() in ("true", "false"):
            table[name] = text.lower() == "true"
        for number in (float, int):
            with suppress(ValueError):
                table[name] = number(text) if number in kinds else table[name]
    return table


def refuse_outside(values: "DataclassInstance", error: Callable[..., Exception], place: str = "") -> None:
    """Check that every number of a dataclass is finite and inside its annotated range; raises `error` at `place`."""
    within = f"{place}: " if place else ""
    for name, (kinds, details) in _fields(type(values)).items():
        value = getattr(values, name)
        if not isinstance(value, float | int):
            if kinds in ((float,), (int,)):
                raise error(f"{within}{name} = {shown(value)}: expected a number")
            continue
        if not isfinite(value):
            raise error(f"{within}{name} = {value}: expected a finite number")
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
def _fields(kind: type) -> Mapping[str, tuple[tuple[type, ...], tuple[object, ...]]]:
    """Return the types of each field of a dataclass, several of a union, and its annotations."""
    found = dict[str, tuple[tuple[type, ...], tuple[object, ...]]]()
    for name, hint in get_type_hints(kind, include_extras=True).items():
        base, *details = get_args(hint) if get_origin(hint) is Annotated else (hint,)
        kinds = get_args(base) if get_origin(base) in (Union, types.UnionType) else (base,)
        found[name] = kinds, tuple(details)
    return found
