"""Recordings from and to files: one row a sample, columns `t`, `q1` .., `v1` .. or what they are said to be."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ident.recordings.checks import check_clock, check_log
from ident.recordings.formats import format_of, ur_rtde
from ident.recordings.formats.columns import OURS, Chosen, Request
from ident.recordings.formats.conversion import converted
from ident.recordings.formats.description import LogDescription
from ident.recordings.formats.notes import notes_of
from ident.recordings.formats.parquet import arrow_array
from ident.recordings.formats.resolution import Resolved, resolved
from ident.recordings.formats.units import ISO
from ident.recordings.recording import Recording


@dataclass(frozen=True, slots=True)
class Log:
    """A log file as it was read.

    Attributes:
        recording: The recording that it holds.
        read: Which columns were taken for what.
        notes: What one should know of how it was read.
    """

    recording: Recording
    read: Resolved
    notes: tuple[str, ...]


def read_recording(path: str | Path, description: LogDescription | None = None) -> Recording:
    """Read a recording from a file of any format of `formats.LOGS`; what none claims is CSV, packed by gzip or not.

    A CSV file has a header line with the column names; `#` starts a comment. Further columns are ignored.

    Args:
        path: The file.
        description: What its columns are, where they are not ours or of a layout that is known.

    Raises:
        RecordingError: If the file is missing or unreadable, a column is missing or not numeric, joints are
            unequal, or the values fail the checks of `Recording` or `check_log`.
    """
    return read_log(path, description or LogDescription()).recording


def read_log(path: str | Path, description: LogDescription) -> Log:
    """Read a recording, and what was taken for what.

    Args:
        path: The file.
        description: What is said of it.

    Raises:
        RecordingError: As `read_recording`.
    """
    log = read_unchecked(path, description)
    check_log(log.recording, t_unit=_stated_unit(log, description))
    return log


def read_unrepaired(path: str | Path, description: LogDescription) -> Log:
    """Read a recording that `ident.preparation` checks once it has repaired what needs no guess.

    Raises:
        RecordingError: As `read_recording`, but for what jumps.
    """
    log = read_unchecked(path, description)
    check_clock(log.recording, t_unit=_stated_unit(log, description))
    return log


def read_unchecked(path: str | Path, description: LogDescription) -> Log:
    """Read a recording as `read_log` does, but with whatever jumps and spikes it has.

    Raises:
        RecordingError: As `read_recording`, but for the checks of `check_log`.
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
    """The unit that time is said to have; None where nothing is said, or it is a date."""
    unit = log.read.description.t.unit
    return unit[0] if unit and description.t.unit and unit[0] != ISO else None


def request_of(description: LogDescription, chosen: Callable[[Path, Sequence[str]], Chosen]) -> Request:
    """What is asked of a file of which something is said.

    Args:
        description: What is said; the header of a text is found by the columns that it or a known layout names.
        chosen: Of the names of all columns, those to read.
    """
    meant = re.compile("|".join((OURS.pattern, ur_rtde.COLUMNS, *map(re.escape, _stated_columns(description)))))
    return Request(
        chosen=chosen,
        known=lambda names: sum(bool(meant.fullmatch(name) or OURS.fullmatch(name.lower())) for name in names),
        text=description.text,
        topic=description.topic,
        joints=description.joints,
    )


def _stated_columns(description: LogDescription) -> list[str]:
    """Names of columns that a description says, the joints' filled in."""
    names = (*description.t.columns, *description.q.columns, *description.v.columns, *dict(description.only))
    joints = description.joints or ("",)
    return [name.replace("{joint}", joint) for name in names for joint in joints]


def write_recording(recording: Recording, path: str | Path, *, signal: str = "") -> None:
    """Write a recording as Parquet (`.parquet`) or CSV (any other ending), every digit kept.

    Args:
        recording: The recording.
        path: The file.
        signal: What v is, for people who read the file: a comment of CSV, metadata of Parquet.
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
