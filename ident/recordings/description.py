"""What the columns of a foreign log mean, from a TOML file or a command line: `t=time[ms]`, `q=pos_{1..6}[deg]`.

The quantity of v (a current, a torque before or after the drive, a share of a rating) cannot be inferred from its
values but determines the meaning of gains, so it must be declared.
"""

import math
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, NamedTuple, TypeGuard, cast

from ident.support.errors import RecordingError
from ident.support.files import read_toml
from ident.support.naming import nearest, one_line, shown

OWN, UR, UR_TARGET, JOINT_STATES, LEROBOT = "own", "ur-rtde", "ur-rtde-target", "joint-states", "lerobot"
FIXED = {
    UR: ("current", "t=timestamp[s]", "q=actual_q_{0..5}[rad]", "v=actual_current_{0..5}[A]"),
    UR_TARGET: ("current", "t=timestamp[s]", "q=actual_q_{0..5}[rad]", "v=target_current_{0..5}[A]"),
}
"""Layouts with the same columns in every file: quantity of v, and columns as on a command line."""
LAYOUTS = (OWN, *FIXED, JOINT_STATES, LEROBOT)
"""Names of the layouts, in the order in which they are tried; `layouts` has the rules of the others."""
EPISODE = "episode_index"
"""Column by which datasets of LeRobot select their rows."""
ISO = "iso"
"""Time as dates, 2031-07-19T09:41:07.125."""
TICKS = "ticks"
"""Positions as encoder counts, with separately declared counts per turn."""
TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, ISO: 1.0}
"""Seconds."""
POSITION = {"rad": 1.0, "deg": math.pi / 180.0, "rev": 2.0 * math.pi, "m": 1.0, "mm": 1e-3, TICKS: 2.0 * math.pi}
"""Radians or metres; for ticks, a turn."""
CURRENT = {"A": 1.0, "mA": 1e-3}
"""Amperes."""
SHARE = {"%": 1.0, "per mille": 0.1}
"""Percent."""
TORQUE = {"N m": 1.0, "Nm": 1.0, "mN m": 1e-3, "N": 1.0}
"""Newton metres, newtons for prismatic joints."""


@dataclass(frozen=True, slots=True)
class Meaning:
    """A quantity of v.

    Attributes:
        words: Description.
        units: Allowed units, with their factors to the unit of the recording.
        unit: Unit of v in the recording.
        note: Meaning of gains, if not N m per ampere.
        refused: Why no gain is identifiable from it, or empty.
    """

    words: str
    units: Mapping[str, float]
    unit: str
    note: str = ""
    refused: str = ""


TORQUE_FROM_CURRENT = "torque-from-current"
MEANINGS: dict[str, Meaning] = {
    "current": Meaning("motor current, measured or commanded", CURRENT, "A"),
    TORQUE_FROM_CURRENT: Meaning(
        "the controller's torque: current times its constant", TORQUE, "N m",
        "v is a torque computed by the controller: a gain is the correction factor of its torque constant",
    ),
    "torque-after-drive": Meaning(
        "torque measured behind gear and friction", TORQUE, "N m",
        "v is measured after the drive: a gain is the scale of the torque sensor, not of the drive",
    ),
    "percent": Meaning(
        "share of a rated current or torque", SHARE, "%", "v is a share of a rating: a gain is N m per percent"
    ),
    "gravity-compensated": Meaning(
        "current or torque after gravity compensation", CURRENT | TORQUE | SHARE, "",
        refused="it lacks the weight of the payload, from which gains are identified; log the motor current, or the "
        "whole commanded torque including the compensation",
    ),
}  # fmt: skip
"""Quantities by their names in a description."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TextLayout:
    """Layout of a text file; None for values to be detected.

    Attributes:
        separator: Separator of columns, one character.
        decimal: Decimal sign, `.` or `,`.
        header: Line of the column names, from 1; 0 without a header, then columns are named 1, 2, ...
        rows: Line of the first row, from 1.
        encoding: Encoding, as named in Python.
    """

    separator: str | None = None
    decimal: str | None = None
    header: int | None = None
    rows: int | None = None
    encoding: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Channels:
    """Description of time, positions or currents; empty if not declared. One entry for all joints, or one each.

    Attributes:
        columns: Names of the columns by joint; `{joint}` is replaced by the joint's name.
        unit: Units.
        counts_per_turn: Encoder counts per turn of the joint, for positions in ticks.
        sign: 1 or -1.
        zero: Offset added to a position after its sign, in the log's unit: the position at a logged 0.
        constant: Torque constant with which the controller multiplied the current [N m/A]; None if not declared, empty
            if declared unknown.
    """

    columns: tuple[str, ...] = ()
    unit: tuple[str, ...] = ()
    counts_per_turn: tuple[float, ...] = ()
    sign: tuple[float, ...] = ()
    zero: tuple[float, ...] = ()
    constant: tuple[float, ...] | None = None

    def over(self, known: "Channels") -> "Channels":
        """Return these completed by those of a layout, unless columns are declared."""
        if self.columns:
            return self
        own = {each.name: getattr(self, each.name) for each in fields(self)}
        return replace(known, **{name: value for name, value in own.items() if value != getattr(NOTHING, name)})


NOTHING = Channels()


@dataclass(frozen=True, slots=True, kw_only=True)
class LogDescription:
    """Description of a log; missing parts are taken from its layout.

    Attributes:
        signal: Quantity of v, a name of `MEANINGS`.
        layout: A name of `LAYOUTS`; recognised by the columns if not declared.
        joints: Names of the joints, base to flange, if the log has joints by name.
        topic: Topic of a bag.
        only: Columns and the values that select rows.
        t: Description of time.
        q: Description of positions.
        v: Description of currents.
        text: Layout of a text file.
    """

    signal: str | None = None
    layout: str | None = None
    joints: tuple[str, ...] | None = None
    topic: str | None = None
    only: tuple[tuple[str, float], ...] = ()
    t: Channels = NOTHING
    q: Channels = NOTHING
    v: Channels = NOTHING
    text: TextLayout = field(default_factory=TextLayout)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all columns, each once."""
        of_rows = (name for name, _ in self.only)
        return tuple(dict.fromkeys((*self.t.columns, *self.q.columns, *self.v.columns, *of_rows)))

    @property
    def dated(self) -> frozenset[str]:
        """Names of the columns with dates."""
        return frozenset(self.t.columns if self.t.unit == (ISO,) else ())


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


class Key(NamedTuple):
    """A key of a table: what is expected, which values are allowed, whether an array may have one for each joint."""

    expected: str
    allowed: Callable[[object], bool]
    many: bool = False
    known: Collection[str] = ()
    words: Mapping[str, object] = {}


def _is_text(value: object) -> bool:
    return isinstance(value, str) and bool(value.strip())


def _is_number(value: object) -> TypeGuard[float]:
    return not isinstance(value, bool) and isinstance(value, int | float) and abs(value) <= LARGEST


def _is_not_zero(value: object) -> bool:
    return _is_number(value) and value != 0.0


def _is_sign(value: object) -> bool:
    return _is_number(value) and abs(value) == 1.0


def _is_table(value: object) -> bool:
    return isinstance(value, dict)


def _is_selection(value: object) -> bool:
    return isinstance(value, dict) and all(map(_is_number, cast("dict[str, object]", value).values()))


def _is_separator(value: object) -> bool:
    return isinstance(value, str) and len(value) == 1 and value not in "\"'\r\n#\0"


def _is_line(value: object) -> bool:
    return _is_number(value) and isinstance(value, int) and 1 <= value <= LAST_LINE


def _is_encoding(value: object) -> bool:
    try:
        return isinstance(value, str) and bool(b"a".decode(value)) and _is_text(value)
    except UnicodeError:  # incomplete multi-byte character
        return True
    except (LookupError, ValueError):  # unknown, a bytes-to-bytes codec, or not a name
        return False


TEXTS = Key("a text, or an array of texts, one per joint", _is_text, many=True)
NUMBER = "a number, or an array of numbers, one per joint"
SIGN = Key("1 or -1, or an array of them", _is_sign, many=True)
LINE = f"a line number, 1 to {LAST_LINE}"
TOP = {
    "signal": Key(f"one of {', '.join(MEANINGS)}", _is_text, known=MEANINGS),
    "layout": Key(f"one of {', '.join(LAYOUTS)}", _is_text, known=LAYOUTS),
    "joints": TEXTS,
    "topic": Key("a text", _is_text),
    "only": Key(
        "a table of columns and the number that selects rows, such as { episode_index = 3 }",
        _is_selection,
    ),
}
CHANNELS = {
    "t": {"column": TEXTS, "unit": TEXTS},
    "q": {
        "columns": TEXTS,
        "unit": TEXTS,
        "counts_per_turn": Key(f"{NUMBER}, not 0", _is_not_zero, many=True),
        "sign": SIGN,
        "zero": Key(NUMBER, _is_number, many=True),
    },
    "v": {
        "columns": TEXTS,
        "unit": TEXTS,
        "sign": SIGN,
        "constant": Key(f"{NUMBER}, not 0, or {UNKNOWN!r}", _is_not_zero, many=True, words={UNKNOWN: ()}),
    },
}
FILE = {
    "separator": Key("one character", _is_separator),
    "decimal": Key("'.' or ','", _is_text, known=(".", ",")),
    "header": Key(f"{LINE}, or 'none'", _is_line, words={"none": 0}),
    "rows": Key(LINE, _is_line),
    "encoding": Key("an encoding that Python knows: utf-8, utf-16-le, latin-1, cp1252, ..", _is_encoding),
}
TOP |= {name: Key(f"a table with {', '.join(keys)}", _is_table) for name, keys in (CHANNELS | {"file": FILE}).items()}


def read_description(path: str | Path) -> LogDescription:
    """Read the description of a log.

    Raises:
        RecordingError: If the file cannot be read or is not valid.
    """
    path = Path(path)
    place, table = one_line(path), read_toml(path, error=RecordingError)
    found = _values(place, table, TOP)
    for kind, keys in CHANNELS.items():
        values = _values(f"{place}: [{kind}]", found.get(kind, {}), keys)
        names = values.pop("column", None) or values.pop("columns", ())
        columns = tuple(name for word in names for name in spread(word, f"{place}: [{kind}]"))
        found[kind] = Channels(columns=columns, **values)
    text = _values(f"{place}: [file]", found.pop("file", {}), FILE)
    separator, header, rows = map(text.get, ("separator", "header", "rows"))
    if text.get("decimal") and text["decimal"] == separator:
        raise _wrong(f"{place}: [file]", "decimal", separator, "a character other than the separator")
    if header and rows and rows <= header:
        raise _wrong(f"{place}: [file]", "rows", rows, f"a line after that of the header, {header}")
    only = tuple((name, float(value)) for name, value in found.pop("only", {}).items())
    return LogDescription(text=TextLayout(**text), only=only, **found)


def _values(place: str, table: Mapping[str, Any], keys: Mapping[str, Key]) -> dict[str, Any]:
    """Return the values of a table, those that may be many as tuples."""
    found: dict[str, Any] = {}
    for name, value in table.items():
        if name not in keys:
            raise RecordingError(f"{place}: unknown key {shown(name)}{nearest(name, keys)}; known: {', '.join(keys)}")
        key = keys[name]
        if isinstance(value, str) and value in key.words:
            found[name] = key.words[value]
            continue
        each = cast("list[Any]", value) if key.many and isinstance(value, list) else [value]
        if not each or not all(map(key.allowed, each)) or (key.known and value not in key.known):
            near = nearest(value, key.known) if isinstance(value, str) else ""
            raise _wrong(place, name, value, f"{key.expected}{near}")
        found[name] = tuple(x if isinstance(x, str) else float(x) for x in each) if key.many else value
    return found


def _wrong(place: str, key: str, value: object, expected: str) -> RecordingError:
    return RecordingError(f"{place}: {key} = {shown(value)}; expected {expected}")


def spread(word: str, place: str) -> list[str]:
    """Return the names of a range `name{a..b}`.

    Args:
        word: A name with or without a range.
        place: Name for messages.

    Raises:
        RecordingError: If the range is empty or too long.
    """
    found = _RANGE.search(word)
    if found is None:
        return [word]
    first, last = int(found[1]), int(found[2])
    if not first <= last < first + MOST:
        raise RecordingError(f"{place}: {shown(word)}; expected a range of 1 to {MOST} numbers, such as {{1..6}}")
    return [word[: found.start()] + str(k) + word[found.end() :] for k in range(first, last + 1)]


def described(words: Sequence[str]) -> LogDescription:
    """Return the description of a log from command-line words.

    Args:
        words: Each `t=`, `q=` or `v=` with names, separated by commas, and optionally a unit in brackets; brackets
            without a unit belong to the name of a column.

    Raises:
        RecordingError: If a word is not valid.
    """
    found = dict.fromkeys("tqv", NOTHING)
    for word in words:
        kind, equals, given = word.partition("=")
        if kind not in UNITS or not equals or not given:
            raise RecordingError(f"--columns: {shown(word)}; expected t=NAME[unit], q=NAME,NAME,..[unit] or v=..")
        if found[kind] != NOTHING:
            raise RecordingError(f"--columns: {kind}= is given twice")
        unit: tuple[str, ...] = ()
        ending = _UNIT.fullmatch(given)
        if ending is not None and not ending[2].isdigit():
            given, unit = ending[1], (ending[2],)
            if unit[0] not in UNITS[kind]:
                known = f"{nearest(unit[0], UNITS[kind])}; known: {', '.join(UNITS[kind])}"
                raise RecordingError(f"--columns: unit {shown(unit[0])} of {kind} is unknown{known}")
        names = [name for each in given.split(",") for name in spread(each.strip(), "--columns")] if given else []
        if not all(names):
            raise RecordingError(f"--columns: {kind}={shown(given)} lacks a name")
        found[kind] = Channels(columns=tuple(names), unit=unit)
    return LogDescription(t=found["t"], q=found["q"], v=found["v"])
