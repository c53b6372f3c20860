"""Reading and writing of recordings: one row per sample, columns `t`, `q1` .., `v1` .. or declared ones.

In a recording time is in seconds, positions in radians or metres, v in one unit.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from ident.recordings.checks import check_clock, check_log
from ident.recordings.formats import format_of
from ident.recordings.formats.columns import OURS, Chosen, Columns, Request
from ident.recordings.formats.description import Channels, LogDescription
from ident.recordings.formats.layouts import UR_COLUMNS
from ident.recordings.formats.lerobot import EPISODE
from ident.recordings.formats.meaning import ISO, MEANINGS, POSITION, TICKS, TIME
from ident.recordings.formats.parquet import arrow_array
from ident.recordings.formats.resolution import Resolved, notes_of, resolved
from ident.recordings.recording import Recording
from ident.support.arrays import Array, Mask
from ident.support.errors import RecordingError
from ident.support.naming import one_line, shown

Value = TypeVar("Value", str, float)
TEMPERATURES = {"T1, T2, ..": ("T{}", 1), "joint_temperatures_0, ..": ("joint_temperatures_{}", 0)}
"""Patterns of temperature columns, and the number of the first joint."""


@dataclass(frozen=True, slots=True)
class Log:
    """A log file as it was read.

    Attributes:
        recording: The recording that it holds.
        read: The columns that were used.
        notes: Remarks on its interpretation.
    """

    recording: Recording
    read: Resolved
    notes: tuple[str, ...]


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
    return read_log(path, description or LogDescription()).recording


def read_log(path: str | Path, description: LogDescription) -> Log:
    """Read a recording, with the columns that were used.

    Raises:
        RecordingError: As `read_recording`.
    """
    log = read_unchecked(path, description)
    check_log(log.recording, t_unit=_stated_unit(log, description))
    return log


def read_unrepaired(path: str | Path, description: LogDescription) -> Log:
    """Read a recording that `ident.preparation` repairs and checks.

    Raises:
        RecordingError: As `read_recording`, except for jumps.
    """
    log = read_unchecked(path, description)
    check_clock(log.recording, t_unit=_stated_unit(log, description))
    return log


def read_unchecked(path: str | Path, description: LogDescription) -> Log:
    """Read a recording as `read_log`, without checks for jumps and spikes.

    Raises:
        RecordingError: As `read_recording`, except for the checks of `check_log`.
    """
    path = Path(path)
    found: list[Resolved] = []

    def chosen(path: Path, names: Sequence[str]) -> Chosen:
        found[:] = [resolved(path, names, description)]
        return found[0].chosen

    table = format_of(path).read(path, request_of(description, chosen))
    recording = converted(path, table, found[0].description)
    return Log(recording, found[0], notes_of(found[0]))


def _stated_unit(log: Log, description: LogDescription) -> str | None:
    """Return the declared unit of time; None if not declared, or for dates."""
    unit = log.read.description.t.unit
    return unit[0] if unit and description.t.unit and unit[0] != ISO else None


def request_of(description: LogDescription, chosen: Callable[[Path, Sequence[str]], Chosen]) -> Request:
    """Return the request for a file with a description.

    Args:
        description: The description; the header of a text is found by the columns of it or of a known layout.
        chosen: Function that selects columns to read from all names.
    """
    meant = re.compile("|".join((OURS.pattern, UR_COLUMNS, *map(re.escape, _stated_columns(description)))))
    return Request(
        chosen=chosen,
        known=lambda names: sum(bool(meant.fullmatch(name) or OURS.fullmatch(name.lower())) for name in names),
        text=description.text,
        topic=description.topic,
        joints=description.joints,
        episode=dict(description.only).get(EPISODE),
    )


def _stated_columns(description: LogDescription) -> list[str]:
    """Return the column names of a description, with joint names inserted."""
    names = (*description.t.columns, *description.q.columns, *description.v.columns, *dict(description.only))
    joints = description.joints or ("",)
    return [name.replace("{joint}", joint) for name in names for joint in joints]


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


def converted(path: Path, table: Columns, description: LogDescription) -> Recording:
    """Return the recording of columns.

    Raises:
        RecordingError: If no row is selected, or the values fail the checks of `Recording`.
    """
    kept = _kept(path, table, description)
    t = _scaled(_of(table, description.t.columns[0], kept), TIME[description.t.unit[0]])
    q, v = np.empty((2, len(t), len(description.q.columns)))
    for joint, name in enumerate(description.q.columns):
        q[:, joint] = _position(_of(table, name, kept), description.q, joint)
    for joint, name in enumerate(description.v.columns):
        v[:, joint] = _scaled(_of(table, name, kept), _v_scale(description, joint))
    return Recording(t, q, v, one_line(path))


def _kept(path: Path, table: Columns, description: LogDescription) -> Mask | None:
    """Return the selected rows, None for all."""
    if not description.only:
        return None
    kept = np.ones(len(table[description.only[0][0]]), dtype=bool)
    for name, value in description.only:
        there = table[name] == value
        if not there.any():
            low, high = np.min(table[name]), np.max(table[name])
            raise RecordingError(
                f"{one_line(path)}: no row has {shown(name)} = {value:g}; it ranges from {low:g} to {high:g}"
            )
        kept &= there
    if not kept.any():
        raise RecordingError(f"{one_line(path)}: no row satisfies all conditions of only = {{ .. }}")
    return kept


def _of(table: Columns, name: str, kept: Mask | None) -> Array:
    return table[name] if kept is None else table[name][kept]


def _position(x: Array, channels: Channels, joint: int) -> Array:
    """`unit (sign x + zero)`."""
    unit = _each(channels.unit, joint)
    scale = POSITION[unit]
    if unit == TICKS:
        scale /= _each(channels.counts_per_turn, joint)
    x = _scaled(x, _each(channels.sign, joint) if channels.sign else 1.0)
    if channels.zero:
        x = x + _each(channels.zero, joint)
    return _scaled(x, scale)


def _v_scale(description: LogDescription, joint: int) -> float:
    """Return the factor from the logged v to that of the recording."""
    scale = _each(description.v.sign, joint) if description.v.sign else 1.0
    if description.signal is not None:
        scale *= MEANINGS[description.signal].units[_each(description.v.unit, joint)]
    return scale / _each(description.v.constant, joint) if description.v.constant else scale


def _each(values: tuple[Value, ...], joint: int) -> Value:
    """Return the entry of a joint, or the common entry of all joints."""
    return values[joint if len(values) > 1 else 0]


def _scaled(x: Array, factor: float) -> Array:
    return x if factor == 1.0 else x * factor


class _NotThere(Exception):
    """The file has no temperatures."""


def read_temperatures(path: Path, description: LogDescription, joints: int) -> Array | None:
    """Return temperatures of all joints [degrees Celsius], one row per row of the file, (N, n); None without them.

    Args:
        path: A log that has already been read as a recording.
        description: Description of the log.
        joints: Number of joints; each needs a column.

    Raises:
        RecordingError: If a cell of such a column is not a number.
    """

    def chosen(path: Path, names: Sequence[str]) -> Chosen:
        for pattern, first in TEMPERATURES.values():
            wanted = tuple(pattern.format(first + j) for j in range(joints))
            if set(wanted) <= set(names):
                return Chosen(wanted)
        raise _NotThere

    try:
        table = format_of(path).read(path, request_of(description, chosen))
    except _NotThere:
        return None
    return np.column_stack(list(table.values()))
