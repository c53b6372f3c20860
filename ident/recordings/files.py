"""Reading and writing of recordings: one row per sample, columns `t`, `q1` .., `v1` .. or declared ones.

open      names of the columns of a file                          `formats`
resolve   what they mean: description and layout                  `layouts`
load      their numbers, in seconds, radians or metres, and one unit of v
check     a `Recording`, its clock, jumps and spikes              `checks`
"""

from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np

from ident.recordings.checks import check_clock, check_log
from ident.recordings.description import MEANINGS, POSITION, TICKS, TIME, Channels, LogDescription
from ident.recordings.formats import format_of
from ident.recordings.formats.parquet import arrow_array
from ident.recordings.formats.table import Columns
from ident.recordings.layouts import Resolved, resolved
from ident.recordings.recording import Recording
from ident.support.arrays import Array
from ident.support.errors import RecordingError
from ident.support.naming import one_line, shown

TEMPERATURES = {"T1, T2, ..": ("T{}", 1), "joint_temperatures_0, ..": ("joint_temperatures_{}", 0)}
"""Patterns of temperature columns, and the number of the first joint."""


Value = TypeVar("Value", str, float)


class Log(NamedTuple):
    """A log file as it was read: the recording, and the meaning of the columns that were used."""

    recording: Recording
    read: Resolved


def read_recording(path: str | Path, description: LogDescription | None = None) -> Recording:
    """Read a recording from a file of any format of `formats.LOGS`; others are read as CSV, also gzipped.

    A CSV file has a header line with the column names; `#` starts a comment. Further columns are ignored.

    Args:
        path: The file.
        description: Description of its columns, unless they have standard names or a known layout.

    Raises:
        RecordingError: If the file is missing or unreadable, a column is missing or not numeric, numbers of columns
            differ, or the values fail the checks of `Recording` or `check_log`.
    """
    return read_log(path, description).recording


def read_log(path: str | Path, description: LogDescription | None = None) -> Log:
    """Read a recording, with the meaning of the columns that were used; arguments and errors as `read_recording`."""
    log = read_unchecked(path, description)
    check_log(log.recording, t_unit=log.read.t_unit)
    return log


def read_unrepaired(path: str | Path, description: LogDescription | None = None) -> Log:
    """Read a recording that `ident.preparation` repairs and checks: as `read_log`, but not checked for jumps."""
    log = read_unchecked(path, description)
    check_clock(log.recording, t_unit=log.read.t_unit)
    return log


def read_unchecked(path: str | Path, description: LogDescription | None = None) -> Log:
    """Read a recording as `read_log`, without checks for clock, jumps and spikes.

    Raises:
        RecordingError: As `read_recording`, except for the checks of `check_log`.
    """
    path, description = Path(path), description or LogDescription()
    table = format_of(path).open(path, description)
    meaning = resolved(path, table.names, description)
    meant = meaning.description
    columns = table.load(meant.names, meant.dated)
    if meant.only:
        columns = _selected(path, columns, meant)
    t = columns[meant.t.columns[0]] * TIME[meant.t.unit[0]]
    q = np.column_stack([_position(columns[name], meant.q, joint) for joint, name in enumerate(meant.q.columns)])
    v = np.column_stack([_scale(meant, joint) * columns[name] for joint, name in enumerate(meant.v.columns)])
    return Log(Recording(t, q, v, one_line(path)), meaning)


def _selected(path: Path, columns: Columns, meant: LogDescription) -> Columns:
    """Return the rows in which columns have the values of `only`."""
    place, kept = one_line(path), np.ones(len(columns[meant.only[0][0]]), dtype=np.bool_)
    for name, value in meant.only:
        there = columns[name] == value
        if not there.any():
            low, high = np.min(columns[name]), np.max(columns[name])
            raise RecordingError(f"{place}: no row has {shown(name)} = {value:g}; it ranges from {low:g} to {high:g}")
        kept &= there
    if not kept.any():
        raise RecordingError(f"{place}: no row satisfies all conditions of only = {{ .. }}")
    return {name: values[kept] for name, values in columns.items()}


def _position(x: Array, channels: Channels, joint: int) -> Array:
    """`unit (sign x + zero)`."""
    unit = _of(channels.unit, joint, "")
    scale = POSITION[unit] / (_of(channels.counts_per_turn, joint, 1.0) if unit == TICKS else 1.0)
    return scale * (_of(channels.sign, joint, 1.0) * x + _of(channels.zero, joint, 0.0))


def _scale(meant: LogDescription, joint: int) -> float:
    """Return the factor from the logged v to that of the recording."""
    unit = 1.0 if meant.signal is None else MEANINGS[meant.signal].units[_of(meant.v.unit, joint, "")]
    return _of(meant.v.sign, joint, 1.0) * unit / _of(meant.v.constant or (), joint, 1.0)


def _of(values: tuple[Value, ...], joint: int, default: Value) -> Value:
    """Return the entry of a joint, the common entry of all joints, or the default."""
    return values[joint if len(values) > 1 else 0] if values else default


def read_temperatures(path: Path, description: LogDescription, joints: int) -> Array | None:
    """Return temperatures of all joints [degrees Celsius], one row per row of the file, (N, n); None without them.

    Args:
        path: A log that has already been read as a recording.
        description: Description of the log.
        joints: Number of joints; each needs a column.

    Raises:
        RecordingError: If a cell of such a column is not a number.
    """
    table = format_of(path).open(path, description)
    for pattern, first in TEMPERATURES.values():
        wanted = [pattern.format(first + j) for j in range(joints)]
        if set(wanted) <= set(table.names):
            return np.column_stack(list(table.load(wanted, frozenset()).values()))
    return None


def write_recording(recording: Recording, path: str | Path, *, signal: str = "") -> None:
    """Write a recording as Parquet (`.parquet`) or CSV (any other ending), with all digits.

    Args:
        recording: The recording.
        path: The file.
        signal: Quantity of v, for readers of the file: a comment of CSV, metadata of Parquet.
    """
    path = Path(path)
    names = ["t", *(f"{kind}{j + 1}" for kind in "qv" for j in range(recording.n))]
    columns = np.column_stack((recording.t, recording.q, recording.v))
    if path.suffix.lower() == ".parquet":
        import pyarrow as pa
        import pyarrow.parquet as pq

        table = pa.table([*map(arrow_array, columns.T)], names=names, metadata={"v": signal} if signal else None)
        pq.write_table(table, path)
    else:
        head = f"# v: {signal}\n" if signal else ""
        np.savetxt(path, columns, fmt="%.17g", delimiter=",", header=head + ",".join(names), comments="")
