"""What the columns of a foreign log mean, from a TOML file or a command line: `t=time[ms]`, `q=pos_{1..6}[deg]`.

The quantity of v (a current, a torque before or after the drive, a share of a rating) cannot be inferred from its
values but determines the meaning of gains, so it must be declared.
"""

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from pathlib import Path
from typing import Annotated, NamedTuple, cast

import numpy as np

from ident.support.errors import RecordingError
from ident.support.files import parsed_toml, read_toml
from ident.support.naming import one_line, shown
from ident.support.options import Key, is_number, is_table, keys_of, one_of, strict_table

OWN, UR, UR_TARGET, JOINT_STATES, LEROBOT = "own", "ur-rtde", "ur-rtde-target", "joint-states", "lerobot"
FIXED: dict[str, tuple[str | None, str, str, str, str]] = {
    OWN: (None, "", "t=t[s]", "q=q{1..n}[rad]", "v=v{1..n}"),
    UR: (
        "current", f"v is actual_current_0 .. [A], as measured; --layout {UR_TARGET} selects target_current",
        "t=timestamp[s]", "q=actual_q_{0..5}[rad]", "v=actual_current_{0..5}[A]",
    ),
    UR_TARGET: (
        "current", "v is target_current_0 .. [A], as commanded by the controller",
        "t=timestamp[s]", "q=actual_q_{0..5}[rad]", "v=target_current_{0..5}[A]",
    ),
}  # fmt: skip
"""Layouts of known columns: quantity of v, a note on it, and columns as on a command line, n the number of joints."""
LAYOUTS = (*FIXED, JOINT_STATES, LEROBOT)
"""Names of the layouts, in the order in which they are tried; the last ones are those of formats that name joints."""
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
    """A quantity of v."""

    words: str
    units: Mapping[str, float]  # allowed units, with their factors to the unit of the recording
    unit: str  # unit of v in the recording
    note: str = ""  # meaning of gains, if not N m per ampere
    refused: str = ""  # why no gain is identifiable from it, or empty


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


UNKNOWN = "unknown"
LARGEST = 1e12
"""Largest plausible number."""
MOST = 64
"""Largest number of columns of a range."""
LAST_LINE = 100_000
"""Largest number of lines before the first row."""
_RANGE = re.compile(r"\{(\d{1,4})\.\.(\d{1,4})\}")
_WORD = re.compile(r"([tqv])=(.*?)(?:\[([^\[\]]*[^\d\[\]][^\[\]]*)\])?", re.DOTALL)
"""A word of a command line; brackets with a number belong to the name of a column."""
_HZ = re.compile(r"([0-9]+(?:\.[0-9]+)?) *Hz")


def _is_text(value: object) -> bool:
    return isinstance(value, str) and bool(value.strip())


_is_number = partial(is_number, largest=LARGEST)


def _is_selection(value: object) -> bool:
    return isinstance(value, dict) and all(map(_is_number, cast("dict[str, object]", value).values()))


def _is_encoding(value: object) -> bool:
    try:
        return isinstance(value, str) and bool(b"a".decode(value)) and _is_text(value)
    except UnicodeError:  # incomplete multi-byte character
        return True
    except (LookupError, ValueError):  # unknown, a bytes-to-bytes codec, or not a name
        return False


def _is_coupling(value: object) -> bool:
    pair = cast("list[object]", value) if isinstance(value, list) else []
    whole = [x for x in pair if isinstance(x, int) and not isinstance(x, bool) and 1 <= abs(x) <= MOST]
    return len(pair) == len(whole) == 2 and whole[0] > 0 and abs(whole[1]) != whole[0]


NUMBERS = "a number, or an array of numbers, one per joint"
NOT_ZERO = Key(f"{NUMBERS}, not 0", lambda value: _is_number(value) and value != 0, many=True)
RATE = Key("a sampling rate [Hz], above 0", lambda value: is_number(value, LARGEST) and value > 0.0)
TEXTS = Key("a text, or an array of texts, one per joint", _is_text, many=True)
SIGNS = Key("1 or -1, or an array of them", lambda value: is_number(value) and value in (1, -1), many=True)
BITS = Key("a number of a bit, 1 to 32, or an array of them", lambda x: isinstance(x, int) and 1 <= x <= 32, many=True)
COUPLING = Key("pairs of joints, such as [[3, -2]]", _is_coupling, many=True)
LINE = Key(
    f"a line number, 1 to {LAST_LINE}",
    lambda value: isinstance(value, int) and is_number(value) and 1 <= value <= LAST_LINE,
)
SEPARATOR = Key("one character", lambda value: isinstance(value, str) and len(value) == 1 and value not in "\"'\r\n#\0")


@dataclass(frozen=True, slots=True, kw_only=True)
class TextLayout:
    """Layout of a text file; None for values to be detected.

    Attributes:
        separator: Separator of columns, one character.
        decimal: Decimal sign, `.` or `,`.
        header: Line of the column names, from 1; 0 without a header, then columns are named 1, 2, ...
        rows: Line of the first row, from 1.
        encoding: Encoding, as named in Python.
        series: Column that names the joint or signal of each row of a long table; a column `value` then is one of
            `value[name]` for each name.
    """

    separator: Annotated[str | None, SEPARATOR] = None
    decimal: Annotated[str | None, one_of((".", ","))] = None
    header: Annotated[int | None, LINE.or_word("none", 0)] = None
    rows: Annotated[int | None, LINE] = None
    encoding: Annotated[str | None, Key("an encoding of Python, such as utf-16-le or cp1252", _is_encoding)] = None
    series: Annotated[str | None, Key("a text", _is_text)] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Channels:
    """Description of time, positions or currents; empty if not declared. One entry for all joints, or one each.

    Attributes:
        columns: Names of the columns by joint; `{joint}` is replaced by the joint's name.
        unit: Units.
        counts_per_turn: Encoder counts per turn of the joint, for positions in ticks.
        sign: 1 or -1.
        factor: Factor of the result: 1 / ratio for a position of the motor, a rated current for shares of it, ..
        zero: Offset added to a position after its sign, in the log's unit: the position at a logged 0, without factor.
        coupling: Pairs J, I of joints, from 1: the position of J is that logged plus that logged of I, or minus it
            for a negative I.
        sign_bit: Bit that is set for negative numbers, beside their magnitude; 0 for none.
        bits: Length of a word in two's complement that was logged as unsigned; 0 if it was not.
        constant: Torque constant with which the controller multiplied the current [N m/A]; None if not declared, empty
            if declared unknown.
    """

    columns: Annotated[tuple[str, ...], TEXTS] = ()
    unit: Annotated[tuple[str, ...], TEXTS] = ()
    counts_per_turn: Annotated[tuple[float, ...], NOT_ZERO] = ()
    sign: Annotated[tuple[float, ...], SIGNS] = ()
    factor: Annotated[tuple[float, ...], NOT_ZERO] = ()
    zero: Annotated[tuple[float, ...], Key(NUMBERS, _is_number, many=True)] = ()
    coupling: Annotated[tuple[tuple[int, int], ...], COUPLING] = ()
    sign_bit: Annotated[tuple[float, ...], BITS] = ()
    bits: Annotated[tuple[float, ...], BITS] = ()
    constant: Annotated[tuple[float, ...] | None, NOT_ZERO.or_word(UNKNOWN, ())] = None

    def over(self, known: "Channels") -> "Channels":
        """Return these completed by those of a layout, unless columns are declared."""
        return self if self.columns else replace(known, **self.stated)

    @property
    def stated(self) -> dict[str, tuple[object, ...]]:
        """What is declared, by key."""
        own = {each.name: getattr(self, each.name) for each in fields(self)}
        return {name: value for name, value in own.items() if value != getattr(NOTHING, name)}

    @property
    def each(self) -> Iterator["Channel"]:
        """The channel of each joint, if there is one entry for each."""
        values = (getattr(self, key) or () for key in Channel._field_defaults)
        return (Channel(*own) for own in zip(self.columns, *values, strict=True))


class Channel(NamedTuple):
    """Description of one column, as in `Channels`; the defaults are what a column has that is not declared."""

    column: str
    unit: str = ""
    counts_per_turn: float = 1.0
    sign: float = 1.0
    factor: float = 1.0
    zero: float = 0.0
    sign_bit: float = 0.0
    bits: float = 0.0
    constant: float = 1.0


NOTHING = Channels()


@dataclass(frozen=True, slots=True, kw_only=True)
class LogDescription:
    """Description of a log; missing parts are taken from its layout.

    Attributes:
        signal: Quantity of v, a name of `MEANINGS`.
        layout: A name of `LAYOUTS`; recognised by the columns if not declared.
        joints: Names of the joints, base to flange, if the log has joints by name.
        only: Columns and the values that select rows.
        rate_hz: Sampling rate of a log without times; None for one with times.
    """

    signal: Annotated[str | None, one_of(MEANINGS)] = None
    layout: Annotated[str | None, one_of(LAYOUTS)] = None
    joints: Annotated[tuple[str, ...] | None, TEXTS] = None
    topic: Annotated[str | None, Key("a text", _is_text)] = None
    only: Annotated[
        tuple[tuple[str, float], ...],
        Key("a table of columns and the number that selects rows, such as { episode_index = 3 }", _is_selection),
    ] = ()
    rate_hz: Annotated[float | None, RATE] = None
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


PARTS = {
    "t": {"column": TEXTS, "unit": TEXTS, "rate_hz": RATE, "factor": NOT_ZERO},
    "q": keys_of(Channels, without=("constant",)),
    "v": keys_of(Channels, without=("counts_per_turn", "zero", "coupling")),
    "file": keys_of(TextLayout),
}
"""Keys of the tables of a description."""


STATE = "--state"
"""Option that adds a line to a description."""


def line_of(key: str, values: Iterable[float]) -> str:
    """Return the option that states a key of a part, such as `q.factor`: one value for all joints if they are equal."""
    each = [f"{value:.7g}" for value in values]
    value = each[0] if len(set(each)) == 1 else f"[{', '.join(each)}]"
    return f"{STATE} '{key} = {value}'"


def read_description(path: str | Path | None, lines: Sequence[str] = ()) -> LogDescription:
    """Read the description of a log, None for an empty one, with more lines such as `q.factor = 0.5`.

    Factors that are stated several times are multiplied. Raises `RecordingError` if the file cannot be read, a part is
    not valid, or another key is stated twice.
    """
    place, table = "log description", dict[str, object]()
    if path is not None:
        place, table = one_line(path), read_toml(Path(path), error=RecordingError)
    for line in lines:
        own = f"{STATE} {shown(line)}"
        for key, value in parsed_toml(line, own, error=RecordingError).items():
            table[key] = _stated_also(table.get(key), value, key, own)
    parts = {part: Key(f"a table of {', '.join(keys)}", is_table) for part, keys in PARTS.items()}
    found = strict_table(
        table, keys_of(LogDescription, without=("t", "q", "v", "text", "rate_hz")) | parts, RecordingError, place
    )
    for part, keys in PARTS.items():
        within = f"{place}: [{part}]"
        values = strict_table(found.pop(part, {}), keys, RecordingError, within)
        if part == "file":
            header, rows, decimal = (values.get(key) for key in ("header", "rows", "decimal"))
            if decimal and decimal == values.get("separator"):
                raise RecordingError(f"{within}: decimal = {decimal!r}: expected a character other than the separator")
            if header and rows and rows <= header:
                raise RecordingError(f"{within}: rows = {rows}: expected a line after that of the header, {header}")
            found["text"] = TextLayout(**values)
        else:
            if "rate_hz" in values:
                found["rate_hz"] = float(values.pop("rate_hz"))
            names = values.pop("column", ()) or values.pop("columns", ())
            columns = tuple(name for word in names for name in spread(word, within))
            found[part] = Channels(columns=columns, **values)
    found["only"] = tuple((name, float(value)) for name, value in found.get("only", {}).items())
    return LogDescription(**found)


def _stated_also(known: object, value: object, key: str, place: str) -> object:
    """Return a value of a description that a line states beside a known one, None if it is the first."""
    if known is None:
        return value
    if isinstance(known, dict) and isinstance(value, dict):
        first, more = cast("dict[str, object]", known), cast("dict[str, object]", value)
        return first | {name: _stated_also(first.get(name), own, name, place) for name, own in more.items()}
    each, other = (np.atleast_1d(np.asarray(one, dtype=object)) for one in (known, value))
    sizes, numbers = {len(each), len(other)} - {1}, all(map(_is_number, (*each, *other)))
    if key != "factor" or not numbers or len(sizes) > 1:
        raise RecordingError(f"{place}: {key} = {shown(known)} is stated already; state it once")
    product = (each * other).tolist()
    return product if sizes else product[0]


def spread(word: str, place: str) -> list[str]:
    """Return the names of a range `name{a..b}`, or the name; raises `RecordingError` if it is empty or too long."""
    found = _RANGE.search(word)
    if found is None:
        return [word]
    first, last = int(found[1]), int(found[2])
    if not first <= last < first + MOST:
        raise RecordingError(f"{place}: {shown(word)}; expected a range of 1 to {MOST} numbers, such as {{1..6}}")
    return [word[: found.start()] + str(k) + word[found.end() :] for k in range(first, last + 1)]


def described(words: Sequence[str]) -> LogDescription:
    """Return the description of a log from command-line words; raises `RecordingError` if one is not valid.

    Each is `t=`, `q=` or `v=` with names, separated by commas, and a unit in brackets, which may be left out.
    """
    parts, rate = dict.fromkeys("tqv", NOTHING), None
    for word in words:
        found = _WORD.fullmatch(word)
        if found is None or not (found[2] or found[3]):
            raise RecordingError(f"--columns: {shown(word)}; expected t=NAME[unit], q=NAME,NAME,..[unit] or v=..")
        kind, given, unit = found.groups()
        if kind == "t" and not given and (hz := _HZ.fullmatch(unit)) and float(hz[1]) > 0.0:
            rate = float(hz[1])
            continue
        if parts[kind] != NOTHING:
            raise RecordingError(f"--columns: {kind}= is given twice")
        names = [name for each in given.split(",") for name in spread(each.strip(), "--columns")] if given else []
        if not all(names):
            raise RecordingError(f"--columns: {kind}={shown(given)} lacks a name")
        parts[kind] = Channels(columns=tuple(names), unit=(unit,) if unit else ())
    return LogDescription(rate_hz=rate, t=parts["t"], q=parts["q"], v=parts["v"])
