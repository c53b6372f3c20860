"""Recordings from and to Parquet and CSV files: columns `t`, `q1` .. `qn`, `v1` .. `vn`, one row a sample."""

import re
from pathlib import Path

import numpy as np

from ident.arrays import Array
from ident.errors import RecordingError
from ident.recording import Recording


def read_recording(path: str | Path) -> Recording:
    """Read a recording from a Parquet (`.parquet`) or CSV (any other ending) file.

    A CSV file has a header line with the column names; `#` starts a comment. Further columns are ignored.

    Raises:
        RecordingError: If the file is missing or unreadable, a column is missing or not numeric, joints are
            unequal, or the values fail the checks of `Recording`.
    """
    path = Path(path)
    if not path.is_file():
        raise RecordingError(f"{path}: no such file")
    table = _read_parquet(path) if path.suffix.lower() == ".parquet" else _read_csv(path)
    if "t" not in table:
        raise RecordingError(f"{path}: column t is missing; found {_listed(table)}")
    joints = _joint_numbers(path, table, "q")
    if joints != _joint_numbers(path, table, "v"):
        missing = sorted(set(joints) ^ set(_joint_numbers(path, table, "v")))
        raise RecordingError(f"{path}: joint {missing[0]} has only one of the columns q{missing[0]} and v{missing[0]}")
    if joints != list(range(1, len(joints) + 1)):
        gap = next(j for j in range(1, joints[-1]) if j not in joints)
        raise RecordingError(f"{path}: columns q{gap} and v{gap} are missing; joints are numbered 1 to n")
    q = np.column_stack([table[f"q{j}"] for j in joints])
    v = np.column_stack([table[f"v{j}"] for j in joints])
    return Recording(table["t"], q, v, str(path))


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


def _read_parquet(path: Path) -> dict[str, Array]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(path)
    except (OSError, pa.ArrowException) as error:
        raise RecordingError(f"{path}: not a readable Parquet file ({str(error).splitlines()[0]})") from error
    columns: dict[str, Array] = {}
    for name in table.column_names:
        if _is_ours(name):
            try:
                columns[name] = np.asarray(table[name].cast(pa.float64()).to_numpy(), dtype=np.float64)
            except pa.ArrowException as error:
                raise RecordingError(f"{path}: column {name} is {table[name].type}, expected numbers") from error
    return columns


def _read_csv(path: Path) -> dict[str, Array]:
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise RecordingError(f"{path}: not a text file; expected CSV, or a name ending in .parquet") from error
    rows = [(k, text) for k, line in enumerate(lines, 1) if (text := line.split("#", 1)[0].strip())]
    if len(rows) < 2:
        raise RecordingError(f"{path}: expected a header line and at least one row")
    header = [name.strip().strip('"') for name in rows[0][1].split(",")]
    doubled = {name for name in header if _is_ours(name) and header.count(name) > 1}
    if doubled:
        raise RecordingError(f"{path}: column {sorted(doubled)[0]} appears twice in the header")
    used = [k for k, name in enumerate(header) if _is_ours(name)]
    if not used:
        raise RecordingError(
            f"{path}: line {rows[0][0]} names no column t, q1.. or v1..; found {', '.join(header[:8])}"
        )
    try:
        values = np.loadtxt([text for _, text in rows[1:]], delimiter=",", usecols=used, ndmin=2)
    except (ValueError, IndexError):
        raise _csv_fault(path, header, used, rows[1:]) from None
    return {header[k]: values[:, c] for c, k in enumerate(used)}


def _csv_fault(path: Path, header: list[str], used: list[int], rows: list[tuple[int, str]]) -> RecordingError:
    """Find the first cell that is no number."""
    for line, text in rows:
        cells = text.split(",")
        for k in used:
            cell = cells[k].strip() if k < len(cells) else ""
            try:
                float(cell)
            except ValueError:
                return RecordingError(f"{path}: line {line}, column {header[k]}: {cell!r} is not a number")
    return RecordingError(f"{path}: not readable as CSV")


def _joint_numbers(path: Path, table: dict[str, Array], kind: str) -> list[int]:
    numbers = sorted(int(name[1:]) for name in table if name != "t" and name[0] == kind)
    if not numbers:
        raise RecordingError(f"{path}: columns {kind}1, {kind}2, .. are missing; found {_listed(table)}")
    return numbers


def _is_ours(name: str) -> bool:
    return re.fullmatch(r"t|[qv][1-9][0-9]*", name) is not None


def _listed(table: dict[str, Array]) -> str:
    return ", ".join(table) if table else "none of t, q1.., v1.."
