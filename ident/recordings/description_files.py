"""Descriptions of logs from TOML files and command lines: `t=time[ms]`, `q=pos_{1..6}[deg]`, `v=a,b,c[mA]`."""

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias, cast

from ident.recordings.description import (
    CURRENT,
    MEANINGS,
    NOTHING,
    POSITION,
    SHARE,
    TIME,
    TORQUE,
    Channels,
    LogDescription,
    TextLayout,
)
from ident.recordings.layouts import LAYOUTS
from ident.support.errors import LogDescriptionError
from ident.support.files import read_toml
from ident.support.naming import nearest, one_line, shown

UNKNOWN = "unknown"
LARGEST = 1e12
"""Largest plausible number."""
UNITS = {"t": TIME, "q": POSITION, "v": CURRENT | SHARE | TORQUE}
MOST = 64
"""Largest number of columns of a range."""
LAST_LINE = 100_000
"""Largest number of lines before the first row."""
_RANGE = re.compile(r"\{(\d{1,4})\.\.(\d{1,4})\}")
_UNIT = re.compile(r"(.*)\[([^\[\]]*)\]", re.DOTALL)
Keys: TypeAlias = Mapping[str, tuple[Callable[[Any], object], str]]
"""Keys of a table: a function that returns a value or raises `ValueError`, and what is expected."""


def read_description(path: str | Path) -> LogDescription:
    """Read the description of a log.

    Raises:
        LogDescriptionError: If the file cannot be read or is not valid.
    """
    path = Path(path)
    return description_of(read_toml(path, error=LogDescriptionError), one_line(path))


def description_of(table: Mapping[str, object], place: str) -> LogDescription:
    """Return the description of a log in a table.

    Raises:
        LogDescriptionError: If it is not valid.
    """
    found = _values(place, table, TOP)
    for kind, keys in CHANNELS.items():
        values = _values(f"{place}: [{kind}]", table.get(kind, {}), keys)
        names = values.pop("column", None) or values.pop("columns", ())
        spread_out = tuple(name for word in names for name in spread(word, f"{place}: [{kind}]"))
        found[kind] = Channels(columns=spread_out, **values)
    text = _values(f"{place}: [file]", table.get("file", {}), FILE)
    separator, header, rows = map(text.get, ("separator", "header", "rows"))
    if text.get("decimal") and text["decimal"] == separator:
        raise _wrong(f"{place}: [file]", "decimal", separator, "a character other than the separator")
    if header and rows and rows <= header:
        raise _wrong(f"{place}: [file]", "rows", rows, f"a line after that of the header, {header}")
    found.pop("file", None)
    return LogDescription(text=TextLayout(**text), **found)


def _values(place: str, table: object, keys: Keys) -> dict[str, Any]:
    """Return the values of a table."""
    if not isinstance(table, dict):
        raise LogDescriptionError(f"{place} = {shown(table)}; expected a table with {', '.join(keys)}")
    found: dict[str, Any] = {}
    for key, value in table.items():
        if key not in keys:
            raise LogDescriptionError(
                f"{place}: unknown key {shown(key)}{nearest(str(key), keys)}; known: {', '.join(keys)}"
            )
        read, expected = keys[key]
        try:
            found[key] = read(value)
        except ValueError as error:
            raise _wrong(place, key, value, f"{expected}{error}") from None
    return found


def _wrong(place: str, key: str, value: object, expected: str) -> LogDescriptionError:
    return LogDescriptionError(f"{place}: {key} = {shown(value)}; expected {expected}")


def _word(value: object, known: Collection[str] = ()) -> str:
    if not isinstance(value, str) or not value.strip():
        raise ValueError
    if known and value not in known:
        raise ValueError(nearest(value, known))
    return value


def _words(value: object) -> tuple[str, ...]:
    texts = tuple(map(_word, value if isinstance(value, list) else [value]))
    if not texts:
        raise ValueError
    return texts


def _numbers(value: object, allowed: Callable[[float], bool] = lambda _: True) -> tuple[float, ...]:
    numbers: list[float] = []
    for each in cast("list[object]", value) if isinstance(value, list) else [value]:
        if isinstance(each, bool) or not isinstance(each, int | float) or not abs(each) <= LARGEST or not allowed(each):
            raise ValueError
        numbers.append(float(each))
    if not numbers:
        raise ValueError
    return tuple(numbers)


def _constant(value: object) -> tuple[float, ...]:
    return () if value == UNKNOWN else _numbers(value, bool)


def _only(value: object) -> tuple[tuple[str, float], ...]:
    if not isinstance(value, dict):
        raise ValueError
    return tuple((str(name), _numbers([each])[0]) for name, each in value.items())


def _line(value: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= LAST_LINE:
        raise ValueError
    return value


def _header(value: object) -> int:
    return 0 if value == "none" else _line(value)


def _separator(value: object) -> str:
    if not isinstance(value, str) or len(value) != 1 or value in "\"'\r\n#\0":
        raise ValueError
    return value


def _encoding(value: object) -> str:
    name = _word(value)
    try:
        b"a".decode(name)
    except UnicodeError:  # incomplete multi-byte character
        return name
    except (LookupError, ValueError):  # unknown, a bytes-to-bytes codec, or not a name
        raise ValueError from None
    return name


TEXTS = "a text, or an array of texts, one per joint"
NUMBERS = "a number, or an array of numbers, one per joint"
LINE = f"a line number, 1 to {LAST_LINE}"
TOP: Keys = {
    "signal": (partial(_word, known=MEANINGS), f"one of {', '.join(MEANINGS)}"),
    "layout": (partial(_word, known=LAYOUTS), f"one of {', '.join(LAYOUTS)}"),
    "joints": (_words, TEXTS),
    "topic": (_word, "a text"),
    "only": (_only, "a table of columns and the number that selects rows, such as { episode_index = 3 }"),
    **dict.fromkeys(("t", "q", "v", "file"), (lambda table: table, "")),
}
CHANNELS: dict[str, Keys] = {
    "t": {"column": (_words, TEXTS), "unit": (_words, TEXTS)},
    "q": {
        "columns": (_words, TEXTS),
        "unit": (_words, TEXTS),
        "counts_per_turn": (partial(_numbers, allowed=bool), f"{NUMBERS}, not 0"),
        "sign": (partial(_numbers, allowed=lambda each: abs(each) == 1.0), "1 or -1, or an array of them"),
        "zero": (_numbers, NUMBERS),
    },
    "v": {
        "columns": (_words, TEXTS),
        "unit": (_words, TEXTS),
        "sign": (partial(_numbers, allowed=lambda each: abs(each) == 1.0), "1 or -1, or an array of them"),
        "constant": (_constant, f"{NUMBERS}, not 0, or {UNKNOWN!r}"),
    },
}
FILE: Keys = {
    "separator": (_separator, "one character"),
    "decimal": (partial(_word, known=(".", ",")), "'.' or ','"),
    "header": (_header, f"{LINE}, or 'none'"),
    "rows": (_line, LINE),
    "encoding": (_encoding, "an encoding that Python knows: utf-8, utf-16-le, latin-1, cp1252, .."),
}


def spread(word: str, place: str) -> list[str]:
    """Return the names of a range `name{a..b}`.

    Args:
        word: A name with or without a range.
        place: Name for messages.

    Raises:
        LogDescriptionError: If the range is empty or too long.
    """
    found = _RANGE.search(word)
    if found is None:
        return [word]
    first, last = int(found[1]), int(found[2])
    if not first <= last < first + MOST:
        raise LogDescriptionError(f"{place}: {shown(word)}; expected a range of 1 to {MOST} numbers, such as {{1..6}}")
    return [word[: found.start()] + str(k) + word[found.end() :] for k in range(first, last + 1)]


def described(words: Sequence[str]) -> LogDescription:
    """Return the description of a log from command-line words.

    Args:
        words: Each `t=`, `q=` or `v=` with names, separated by commas, and optionally a unit in brackets; brackets
            without a unit belong to the name of a column.

    Raises:
        LogDescriptionError: If a word is not valid.
    """
    found = dict.fromkeys("tqv", NOTHING)
    for word in words:
        kind, equals, given = word.partition("=")
        if kind not in UNITS or not equals or not given:
            raise LogDescriptionError(f"--columns: {shown(word)}; expected t=NAME[unit], q=NAME,NAME,..[unit] or v=..")
        if found[kind] != NOTHING:
            raise LogDescriptionError(f"--columns: {kind}= is given twice")
        unit: tuple[str, ...] = ()
        ending = _UNIT.fullmatch(given)
        if ending is not None and not ending[2].isdigit():
            given, unit = ending[1], (ending[2],)
            if unit[0] not in UNITS[kind]:
                known = f"{nearest(unit[0], UNITS[kind])}; known: {', '.join(UNITS[kind])}"
                raise LogDescriptionError(f"--columns: unit {shown(unit[0])} of {kind} is unknown{known}")
        names = [name for each in given.split(",") for name in spread(each.strip(), "--columns")] if given else []
        if not all(names):
            raise LogDescriptionError(f"--columns: {kind}={shown(given)} lacks a name")
        found[kind] = Channels(columns=tuple(names), unit=unit)
    return LogDescription(t=found["t"], q=found["q"], v=found["v"])
