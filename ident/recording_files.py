"""Recordings from and to files: columns `t`, `q1` .. `qn`, `v1` .. `vn`, one row a sample."""

from pathlib import Path

import numpy as np

from ident.errors import RecordingError
from ident.logs import read_columns
from ident.logs.columns import Columns
from ident.naming import one_line
from ident.recording import Recording
from ident.recording_checks import check_log

MOST_JOINTS = 64
"""Joints of a recording; its columns are counted before they are stacked."""


def read_recording(path: str | Path) -> Recording:
    """Read a recording from a Parquet (`.parquet`) or CSV (any other ending) file, packed by gzip or not.

    A CSV file has a header line with the column names; `#` starts a comment. Further columns are ignored.

    Raises:
        RecordingError: If the file is missing or unreadable, a column is missing or not numeric, joints are
            unequal, or the values fail the checks of `Recording` or `check_log`.
    """
    recording = read_unchecked(path)
    check_log(recording)
    return recording


def read_unchecked(path: str | Path) -> Recording:
    """Read a recording as `read_recording` does, but with whatever jumps and spikes it has.

    Raises:
        RecordingError: Likewise, but for the checks of `check_log`.
    """
    path = Path(path)
    table, place = read_columns(path), one_line(path)
    if "t" not in table:
        raise RecordingError(f"{place}: column t is missing; found {', '.join(table)}")
    joints, currents = (_joint_numbers(place, table, kind) for kind in "qv")
    if joints != currents:
        first = min(set(joints) ^ set(currents))
        raise RecordingError(f"{place}: joint {first} has only one of the columns q{first} and v{first}")
    if joints != list(range(1, len(joints) + 1)):
        gap = next(j for j in range(1, joints[-1]) if j not in joints)
        raise RecordingError(f"{place}: columns q{gap} and v{gap} are missing; joints are numbered 1 to n")
    if len(joints) > MOST_JOINTS:
        raise RecordingError(f"{place}: {len(joints)} joints; recordings of up to {MOST_JOINTS} are read")
    q, v = (np.column_stack([table[f"{kind}{j}"] for j in joints]) for kind in "qv")
    return Recording(table["t"], q, v, place)


def write_recording(recording: Recording, path: str | Path) -> None:
    """Write a recording as Parquet (`.parquet`) or CSV (any other ending), every digit kept."""
    path = Path(path)
    names = ["t", *(f"{kind}{j + 1}" for kind in "qv" for j in range(recording.n))]
    columns = np.column_stack((recording.t, recording.q, recording.v))
    if path.suffix.lower() == ".parquet":
        import pyarrow as pa
        import pyarrow.parquet as pq

        table = pa.table(dict(zip(names, columns.T, strict=True)))
        pq.write_table(table, path)
    else:
        np.savetxt(path, columns, fmt="%.17g", delimiter=",", header=",".join(names), comments="")


def _joint_numbers(place: str, table: Columns, kind: str) -> list[int]:
    numbers = sorted(int(name[1:]) for name in table if name[0] == kind)
    if not numbers:
        raise RecordingError(f"{place}: columns {kind}1, {kind}2, .. are missing; found {', '.join(table)}")
    return numbers
