"""Options of the identification: frozen dataclasses with validation, created from a table or from words."""

import types
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import TypeVar, Union, get_args, get_origin, get_type_hints

from ident.support.errors import OptionError
from ident.support.naming import nearest

Options = TypeVar("Options")
NAMES = "names"
"""Key of a field's metadata: the allowed names, which a command line lists."""
MEASURED = "measured"
"""Key of a field's metadata: what `auto` estimates from the logs; the number may be negative."""


def unknown_name(option: str, value: str, known: Iterable[str]) -> OptionError:
    """Return the message for an option whose value is not an allowed name."""
    return OptionError(f"{option} = {value!r}: expected one of {', '.join(known)}{nearest(value, known)}")


def options_from_table(kind: type[Options], table: Mapping[str, object]) -> Options:
    """Create an options object from a table, as in TOML.

    Args:
        kind: A frozen dataclass with a default for every field.
        table: Values by field name; omitted fields have defaults.

    Raises:
        OptionError: If a key is unknown, or a value has the wrong type or is out of range.
    """
    hints = option_types(kind)
    for name, value in table.items():
        if name not in hints:
            raise OptionError(f"unknown option {name!r}{nearest(name, hints)}; known: {', '.join(hints) or 'none'}")
        if not _fits(value, hints[name]):
            raise OptionError(f"{name} = {value!r}: expected {_described(hints[name])}")
    return kind(**{name: _converted(value, hints[name]) for name, value in table.items()})


def options_from_words(kind: type[Options], words: Sequence[str]) -> Options:
    """Create an options object from words `KEY=VALUE`.

    Raises:
        OptionError: If a word has another form, a key is duplicate, and as `options_from_table`.
    """
    return options_from_table(kind, table_from_words(kind, words))


def table_from_words(kind: type, words: Sequence[str]) -> dict[str, object]:
    """Return keys and values of words `KEY=VALUE`, for `options_from_table`, which checks them.

    Args:
        kind: Class of the options, whose fields determine the types.
        words: Words of a command line.

    Raises:
        OptionError: If a word has another form or a key is duplicate.
    """
    hints, table = option_types(kind), dict[str, object]()
    for word in words:
        name, equals, text = word.partition("=")
        name = name.strip().replace("-", "_")
        if not equals or not name:
            raise OptionError(f"option {word!r}: expected KEY=VALUE")
        if name in table:
            raise OptionError(f"option {name} is given twice")
        table[name] = _read(text.strip(), hints.get(name, str))
    return table


def option_types(kind: type) -> dict[str, object]:
    """Return the types of an options class by field name."""
    if not is_dataclass(kind):
        raise TypeError(f"{kind.__name__} is no dataclass")
    hints = get_type_hints(kind)
    return {field.name: hints[field.name] for field in fields(kind)}


def _choices(hint: object) -> tuple[object, ...]:
    return get_args(hint) if get_origin(hint) in (Union, types.UnionType) else (hint,)


def _fits(value: object, hint: object) -> bool:
    """Return whether a value has the type; integers are numbers, booleans are not."""
    for kind in _choices(hint):
        if kind is None or kind is type(None):
            if value is None:
                return True
        elif kind is float:
            if isinstance(value, float | int) and not isinstance(value, bool):
                return True
        elif kind is int:
            if isinstance(value, int) and not isinstance(value, bool):
                return True
        elif isinstance(kind, type) and isinstance(value, kind):
            return True
    return False


def _converted(value: object, hint: object) -> object:
    if isinstance(value, int) and not isinstance(value, bool) and float in _choices(hint) and int not in _choices(hint):
        try:
            return float(value)
        except OverflowError:
            return float("inf")
    return value


def _read(text: str, hint: object) -> object:
    """Return the value of a word; the text itself if it does not match the type."""
    kinds = _choices(hint)
    if bool in kinds and text.lower() in ("true", "false"):
        return text.lower() == "true"
    for kind in (int, float):
        if kind in kinds:
            try:
                return kind(text)
            except ValueError:
                continue
    return text


def _described(hint: object) -> str:
    names = {float: "a number", int: "a whole number", bool: "true or false", str: "a name"}
    return " or ".join(names[kind] for kind in _choices(hint) if isinstance(kind, type) and kind in names)
