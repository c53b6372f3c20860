"""Reading and writing of recordings: one row per sample, columns `t`, `q1` .., `v1` .. or declared ones.

open      names of the columns of a file                          `formats`
resolve   what they mean: description and layout                  `layouts`
load      their numbers, in seconds, radians or metres, and one unit of v
check     a `Recording`, its clock, jumps and spikes              `checks`
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from ident.payload.payload import Payload, read_payload
from ident.recordings.checks import check_clock, check_log
from ident.recordings.description import ISO, MEANINGS, POSITION, TICKS, TIME, TORQUE_FROM_CURRENT, LogDescription
from ident.recordings.formats import LogFormat
from ident.recordings.formats.arrays import ARRAYS, PARQUET, arrow_array
from ident.recordings.formats.csv import CSV
from ident.recordings.formats.lerobot import LEROBOT
from ident.recordings.formats.ros import ROS
from ident.recordings.layouts import TAKEN, UR_CURRENT, resolved
from ident.recordings.recording import Motion, Recording
from ident.support.arrays import Array
from ident.support.errors import RecordingError
from ident.support.naming import one_line, shown

LOGS: dict[str, LogFormat] = {
    "parquet": PARQUET,
    "numpy": ARRAYS,
    "ros": ROS,
    "lerobot": LEROBOT,
    "csv": CSV,
}
"""Log formats by name; the ending of a file's name selects the format, and CSV is the default."""
TEMPERATURES = {"T1, T2, ..": ("T{}", 1), "joint_temperatures_0, ..": ("joint_temperatures_{}", 0)}
"""Patterns of temperature columns, and the number of the first joint."""
Value = TypeVar("Value", str, float)


@dataclass(frozen=True, slots=True)
class Log:
    """A log file as it was read.

    Attributes:
        recording: The recording.
        description: Columns with their names in the file, one per joint; units; quantity of v, None for drive units.
        layout: Name of the recognised layout, None if everything was declared.
        t_unit: Declared unit of time; None if not declared, or for dates.
    """

    recording: Recording
    description: LogDescription
    layout: str | None
    t_unit: str | None

    @property
    def signal(self) -> str | None:
        """Quantity of v in the recording, a name of `MEANINGS`; None for drive units."""
        return "current" if self._divided else self.description.signal

    @property
    def v(self) -> str:
        """Quantity of v in the recording in words, with its unit."""
        if self._divided:
            return "current, from torque by the specified constants [A]"
        meaning = MEANINGS.get(self.description.signal or "")
        return f"{meaning.words} [{meaning.unit}]" if meaning else "as logged [drive units]"

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on the interpretation, one line each."""
        taken = TAKEN.get(self.layout or "", "") if all(map(UR_CURRENT.fullmatch, self.description.v.columns)) else ""
        meaning = MEANINGS.get(self.description.signal or "")
        divided = "v is the current: torque divided by the specified constants"
        return tuple(filter(None, (taken, divided if self._divided else meaning.note if meaning else "")))

    @property
    def _divided(self) -> bool:
        return self.description.signal == TORQUE_FROM_CURRENT and bool(self.description.v.constant)


def read(
    path: str | Path, payload: str | Path | Payload | None = None, description: LogDescription | None = None
) -> Motion:
    """Read a motion for `identify`, which makes unambiguous repairs and refuses faults.

    Args:
        path: The log, of any format of `LOGS`.
        payload: Payload file, or result of `read_payload`; None for a bare flange. Use one `Payload` object for all
            motions of one mounting.
        description: Description of the log's columns, unless they have standard names or a known layout.

    Raises:
        RecordingError: If the log is missing, unreadable or not valid.
        PayloadError: If the payload file is missing or not valid.
    """
    recording = read_unrepaired(path, description).recording
    return Motion(recording, payload if payload is None or isinstance(payload, Payload) else read_payload(payload))


def read_recording(path: str | Path, description: LogDescription | None = None) -> Recording:
    """Read a recording from a file of any format of `LOGS`; others are read as CSV, also gzipped.

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
    check_log(log.recording, t_unit=log.t_unit)
    return log


def read_unrepaired(path: str | Path, description: LogDescription | None = None) -> Log:
    """Read a recording that `ident.preparation` repairs and checks: as `read_log`, but not checked for jumps."""
    log = read_unchecked(path, description)
    check_clock(log.recording, t_unit=log.t_unit)
    return log


def read_unchecked(path: str | Path, description: LogDescription | None = None) -> Log:
    """Read a recording as `read_log`, without checks for clock, jumps and spikes."""
    path, given = Path(path), description or LogDescription()
    place, table = one_line(path), format_of(path).open(path, given)
    meant, layout = resolved(path, table.names, given)
    columns = table.load(meant.names, meant.dated)
    kept = np.ones(len(columns[meant.t.columns[0]]), dtype=np.bool_)
    for name, value in meant.only:
        x = columns[name]
        if not (x == value).any():
            raise RecordingError(
                f"{place}: no row has {shown(name)} = {value:g}; it ranges from {np.min(x):g} to {np.max(x):g}"
            )
        kept &= x == value
    if meant.only and not kept.any():
        raise RecordingError(f"{place}: no row satisfies all conditions of only = {{ .. }}")
    q, v = list[Array](), list[Array]()
    for joint, name in enumerate(meant.q.columns):  # unit (sign x + zero)
        unit = _of(meant.q.unit, joint, "")
        turn = _of(meant.q.counts_per_turn, joint, 1.0) if unit == TICKS else 1.0
        signed = _of(meant.q.sign, joint, 1.0) * columns[name][kept]
        q.append(POSITION[unit] / turn * (signed + _of(meant.q.zero, joint, 0.0)))
    for joint, name in enumerate(meant.v.columns):
        unit = 1.0 if meant.signal is None else MEANINGS[meant.signal].units[_of(meant.v.unit, joint, "")]
        scale = _of(meant.v.sign, joint, 1.0) * unit / _of(meant.v.constant or (), joint, 1.0)
        v.append(scale * columns[name][kept])
    t = columns[meant.t.columns[0]][kept] * TIME[meant.t.unit[0]]
    recording = Recording(t, np.column_stack(q), np.column_stack(v), place)
    return Log(recording, meant, layout, next((unit for unit in given.t.unit if unit != ISO), None))


def format_of(path: Path) -> LogFormat:
    """Return the format of a file by its name, of a folder by its content."""
    name = path.name.lower()
    for log in LOGS.values():
        if name.endswith(log.endings) or (log.marks and (path / log.marks).is_file()):
            return log
    return CSV


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
