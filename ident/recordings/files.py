"""Reading and writing of recordings: one row per sample, columns `t`, `q1` .., `v1` .. or declared ones.

open      names of the columns of a file                          `formats`
resolve   what they mean: description and layout                  `layouts`
load      their numbers, in seconds, radians or metres, and one unit of v
check     a `Recording`, its clock, jumps and spikes              `checks`
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ident.numerics.neighbours import DIGITS, WHOLE
from ident.payload.payload import Payload, read_payload
from ident.recordings.checks import check_clock, check_log
from ident.recordings.description import (
    FIXED,
    MEANINGS,
    POSITION,
    STATE,
    TICKS,
    TIME,
    Channel,
    Channels,
    LogDescription,
)
from ident.recordings.formats import SAMPLE, DataFrame, LogFormat, Table, with_times
from ident.recordings.formats.arrays import ARRAYS, HDF5, JSON_LINES, MATLAB, PARQUET, arrow_array, frame_table
from ident.recordings.formats.csv import CSV
from ident.recordings.formats.lerobot import LEROBOT
from ident.recordings.formats.ros import ROS
from ident.recordings.layouts import resolved
from ident.recordings.recording import Motion, Recording
from ident.support.arrays import Array
from ident.support.errors import RecordingError, placed
from ident.support.naming import one_line, shown

LOGS: dict[str, LogFormat] = {
    "parquet": PARQUET,
    "numpy": ARRAYS,
    "hdf5": HDF5,
    "matlab": MATLAB,
    "json-lines": JSON_LINES,
    "ros": ROS,
    "lerobot": LEROBOT,
    "csv": CSV,
}
"""Log formats by name; the ending of a file's name selects the format, and CSV is the default."""
TEMPERATURES = ("T{}", 1), ("joint_temperatures_{}", 0)
"""Patterns of temperature columns, and the number of the first joint."""
DRIVE_UNITS = "as logged [drive units]"
SIGN_BITS, WORDS = range(7, 31), (8, 16, 32)
"""Bits that may hold a sign beside a magnitude, and lengths of words [bits], of registers that are logged as read."""
LESS = 0.25
"""Largest size of the steps across zero of a decoded column, relative to those as logged; .5 for a turn of an encoder
whose range is taken for sign and magnitude."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Log:
    """A log file as it was read."""

    recording: Recording  # the recording
    description: LogDescription  # columns with their names in the file, units, signs and zeros, one per joint
    layout: str | None  # name of the recognised layout, None if everything was declared
    signal: str | None  # quantity of v in the recording, a name of `MEANINGS`; None for drive units
    v: str  # quantity of v in the recording in words, with its unit
    notes: tuple[str, ...]  # remarks on the interpretation, one line each


def read(
    path: str | Path | DataFrame, payload: str | Path | Payload | None = None, description: LogDescription | None = None
) -> Motion:
    """Read a motion for `identify`, which makes unambiguous repairs and refuses faults.

    Args:
        path: The log, of any format of `LOGS`, or a data frame with one column each of time, positions and currents.
        payload: Payload file, or result of `read_payload`; None for a bare flange. Use one `Payload` object for all
            motions of one mounting.
        description: Description of the log's columns, unless they have standard names or a known layout.

    Raises:
        RecordingError: If the log is missing, unreadable or not valid.
        PayloadError: If the payload file is missing or not valid.
    """
    recording = read_log(path, description, check=check_clock).recording
    return Motion(recording, read_payload(payload) if isinstance(payload, str | Path) else payload)


def read_recording(path: str | Path, description: LogDescription | None = None) -> Recording:
    """Read a recording from a file; arguments and errors as `read_log`."""
    return read_log(path, description).recording


def read_log(
    path: str | Path | DataFrame,
    description: LogDescription | None = None,
    *,
    check: Callable[..., None] | None = check_log,
) -> Log:
    """Read a recording, with the meaning of the columns that were used; further columns are ignored.

    The file has any format of `LOGS`, others are read as CSV, also gzipped: a header line with the column names, `#`
    starts a comment. `check` is `check_clock` for logs that `ident.preparation` repairs and checks for jumps, None for
    a report. Raises `RecordingError` if the file is unreadable, a column is missing or not numeric, or the values fail
    the checks of `Recording` or `check`.
    """
    given = description or LogDescription()
    if not isinstance(path, str | Path | DataFrame):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise RecordingError(f"a log is {type(path).__name__}; expected a path or a data frame")
    place = one_line(path) if isinstance(path, str | Path) else "data frame"
    with placed(place):
        opened = format_of(Path(path)).open(Path(path), given) if isinstance(path, str | Path) else frame_table(path)
        return _log(place, opened, given, check)


def _log(place: str, table: Table, given: LogDescription, check: Callable[..., None] | None) -> Log:
    """Return the recording of an opened table, as `read_log`."""
    if given.rate_hz is not None:
        table, given = with_times(table, given.rate_hz), replace(given, t=Channels(columns=(SAMPLE,), unit=("s",)))
    meant, layout = resolved(table, given)
    columns = table.load(meant.names, meant.dated)
    kept = np.ones(len(columns[meant.t.columns[0]]), dtype=np.bool_)
    for name, value in meant.only:
        x = columns[name]
        if not (x == value).any():
            raise RecordingError(f"no row has {shown(name)} = {value:g}; it ranges from {np.min(x):g} to {np.max(x):g}")
        kept &= x == value
    if meant.only and not kept.any():
        raise RecordingError("no row satisfies all conditions of only = { .. }")
    meaning = MEANINGS.get(meant.signal or "")

    def number(kind: str, own: Channel) -> Array:
        x = decoded(columns[own.column][kept], own.sign_bit, own.bits)
        turn = own.counts_per_turn if own.unit == TICKS else 0.0  # an encoder jumps at its end
        if (likely := likely_encoding(x)) and float(x.max()) >= abs(turn):
            raise RecordingError(
                f"column {shown(own.column)} jumps where it crosses zero, as a register logged as read; add "
                f"{STATE} '{kind}.{likely}'"
            )
        return own.sign * x

    q = [
        own.factor * POSITION[own.unit] / (own.counts_per_turn if own.unit == TICKS else 1.0)
        * (number("q", own) + own.zero)
        for own in meant.q.each
    ]  # fmt: skip
    units = meaning.units if meaning else {"": 1.0}
    v = [own.factor * units[own.unit] / own.constant * number("v", own) for own in meant.v.each]
    t = np.sum([own.factor * columns[own.column][kept] * TIME[own.unit] for own in meant.t.each], axis=0)
    positions = np.column_stack(q)
    for j, i in meant.q.coupling:
        if max(j, abs(i)) > len(q):
            raise RecordingError(f"coupling of joints {j} and {abs(i)}: the log has {len(q)} joints")
        positions[:, j - 1] += np.sign(i) * q[abs(i) - 1]
    recording = Recording(t, positions, np.column_stack(v), place)
    if check is not None:
        check(recording, t_unit=meant.t.unit[0])
    signal, words, note = meant.signal, f"{meaning.words} [{meaning.unit}]" if meaning else DRIVE_UNITS, ""
    if given.v.constant:
        signal, words = "current", "current, from torque by the specified constants [A]"
        note = "v is the current: torque divided by the specified constants"
    elif meaning:
        note = meaning.note
    taken = FIXED[layout][1] if layout in FIXED and not given.v.columns else ""
    notes = tuple(filter(None, (taken, note, *table.notes)))
    return Log(recording=recording, description=meant, layout=layout, signal=signal, v=words, notes=notes)


def decoded(x: Array, sign_bit: float = 0.0, bits: float = 0.0) -> Array:
    """Return register values, times a unit or not, as numbers, shape (N,).

    `sign_bit`, from 0, is set for negative ones beside the magnitude; `bits` is the length of a word in two's
    complement that was read as unsigned; 0 for none.
    """
    if not sign_bit and not bits:
        return x
    unit = _unit_of_register(x) or 1.0
    number = np.rint(x / unit)
    if sign_bit:
        return np.where(np.floor(number / 2.0**sign_bit) % 2.0 == 1.0, unit * 2.0**sign_bit - x, x)
    return np.where(number >= 2.0 ** (bits - 1.0), x - unit * 2.0**bits, x)


def _unit_of_register(x: Array) -> float:
    """Unit of a column of whole numbers times a unit, such as a servo's 2.69 mA; 0 if it is none."""
    step, most = np.diff(np.unique(x)), float(np.abs(x).max())
    for unit in (1.0, float(step[step > DIGITS * step.max(initial=0.0)].min(initial=np.inf))):
        if (np.abs(x / unit - np.rint(x / unit)) < WHOLE).all():
            return most / float(np.rint(most / unit)) if most > 0.5 * unit else unit
    return 0.0


def likely_encoding(x: Array) -> str:
    """Return the key and value that make a column of registers continuous, such as `sign_bit = 10`; empty for none."""
    if not len(x) or x.min() < 0.0 or not (unit := _unit_of_register(x)):
        return ""
    x = np.rint(x / unit)
    largest, step = float(x.max()), np.abs(np.diff(x))
    for key, values in (("sign_bit", SIGN_BITS), ("bits", WORDS)):
        for value in values:
            most = 2.0 ** (value + (key == "sign_bit"))
            if 0.5 * most <= largest < most:
                across = np.diff(x >= 0.5 * most)  # the sign changes
                after = np.abs(np.diff(decoded(x, **{key: value})))
                if float(after[across].sum()) < LESS * float(step[across].sum()):
                    return f"{key} = {value}"
    return ""


def format_of(path: Path) -> LogFormat:
    """Return the format of a file by its name, of a folder by its content."""
    name = path.name.lower()
    for log in LOGS.values():
        if name.endswith(log.endings) or (log.marks and (path / log.marks).is_file()):
            return log
    return CSV


def read_temperatures(path: Path, description: LogDescription, joints: int) -> Array | None:
    """Return temperatures of all joints [degrees Celsius], (N, n), None without them; refuses cells without number."""
    with placed(one_line(path)):
        table = format_of(path).open(path, description)
        for pattern, first in TEMPERATURES:
            wanted = [pattern.format(first + j) for j in range(joints)]
            if set(wanted) <= set(table.names):
                return np.column_stack(list(table.load(wanted, frozenset()).values()))
    return None


def write_recording(recording: Recording, path: str | Path, *, signal: str = "") -> None:
    """Write a recording with all digits, as Parquet or else CSV; `signal`, its quantity of v, is for readers."""
    path = Path(path)
    names = ["t", *(f"{kind}{j + 1}" for kind in "qv" for j in range(recording.n))]
    columns = np.column_stack((recording.t, recording.q, recording.v))
    if path.suffix.lower() == ".parquet":
        import pyarrow as pa
        import pyarrow.parquet as pq

        table = pa.table([*map(arrow_array, columns.T)], names=names, metadata={"v": signal} if signal else None)
        pq.write_table(table, path, write_page_checksum=True)
    else:
        head = f"# v: {signal}\n" if signal else ""
        np.savetxt(path, columns, fmt="%.17g", delimiter=",", header=head + ",".join(names), comments="")
