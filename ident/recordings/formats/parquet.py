"""Logs in Parquet files.

A column whose cells are arrays of one length gives that number of columns, `name[0]`, `name[1]`, ..
"""

from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from ident.recordings.formats.columns import MOST_COLUMNS, MOST_VALUES, OURS, Columns, LogFormat, Request, entry
from ident.support.arrays import Array, Indices
from ident.support.errors import RecordingError
from ident.support.file_access import check_file
from ident.support.naming import one_line

if TYPE_CHECKING:
    import pyarrow as pa
    import pyarrow.parquet as pq

LARGEST = 4_000_000_000
"""Largest size of a file [bytes]; only requested columns are read."""
LARGEST_FOOTER = 16_000_000
"""Largest size of the metadata [bytes], which are read completely."""
Place: TypeAlias = tuple[str, int | None]
"""A column, and the entry of its arrays if it has arrays."""


def read_parquet(path: Path, request: Request) -> Columns:
    """Read the columns of a log.

    Raises:
        RecordingError: If the file is not Parquet, too large, or a requested column is missing or not numeric.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    check_file(path, most_bytes=LARGEST, error=RecordingError)
    _check_footer(path)
    try:
        with pq.ParquetFile(path) as file:
            places = _places(file)
            found = dict(places)
            chosen = request.chosen(path, [name for name, _ in places])
            wanted = {name: found[name] for name in chosen.names}
            for name, (column, number) in wanted.items():
                kind = file.schema_arrow.field(column).type
                _check_type(path, name, kind if number is None else kind.value_type, dated=name in chosen.dated)
            columns = list(dict.fromkeys(column for column, _ in wanted.values()))
            _check_size(path, file.metadata.num_rows, sum(column in columns for _, (column, _) in places))
            table = file.read(columns=columns)
    except (OSError, pa.ArrowException) as error:
        reason = one_line(str(error).splitlines()[0]) if str(error) else type(error).__name__
        raise RecordingError(f"{one_line(path)}: not a readable Parquet file ({reason})") from error
    listed = dict.fromkeys(column for column, number in wanted.values() if number is not None)
    rows = {column: _rows(path, column, table[column]) for column in listed}
    return {
        name: _numbers(path, name, table[column]) if number is None else rows[column][:, number]
        for name, (column, number) in wanted.items()
    }


def _places(file: "pq.ParquetFile") -> list[tuple[str, Place]]:
    """Return the location of the numbers of each name."""
    import pyarrow as pa

    found: list[tuple[str, Place]] = []
    for field in file.schema_arrow:
        rows = pa.types.is_list(field.type) or pa.types.is_fixed_size_list(field.type)
        if rows and not OURS.fullmatch(field.name):
            found += [(entry(field.name, k), (field.name, k)) for k in range(_width(file, field))]
        else:
            found.append((field.name, (field.name, None)))
    return found


def _width(file: "pq.ParquetFile", field: "pa.Field") -> int:
    """Return the length of arrays of a column; that of the first row if the type does not state it."""
    import pyarrow as pa

    if isinstance(field.type, pa.FixedSizeListType):
        return min(field.type.list_size, MOST_COLUMNS)
    first = next(file.iter_batches(batch_size=1, columns=[field.name]), None)
    cell = None if first is None else first.column(0)[0].as_py()
    return 0 if cell is None else min(len(cell), MOST_COLUMNS)


def _rows(path: Path, name: str, column: "pa.ChunkedArray") -> Array:
    """Return a column of arrays, shape (N, k)."""
    import pyarrow as pa
    import pyarrow.compute as pc

    lengths = pc.list_value_length(column).to_numpy()  # NaN for a missing row
    if not len(lengths):
        raise RecordingError(f"{one_line(path)}: column {one_line(name)} has no row")
    width = lengths[0]
    odd = np.flatnonzero(~(lengths == width))
    if len(odd):
        raise RecordingError(
            f"{one_line(path)}: column {one_line(name)}: row {odd[0] + 1} does not have {width:g} numbers, as row 1 has"
        )
    flat = _numbers(path, name, pa.chunked_array([chunk.flatten() for chunk in column.chunks], column.type.value_type))
    return flat.reshape(len(lengths), int(width))


def _numbers(path: Path, name: str, column: "pa.ChunkedArray") -> Array:
    """Return a column as float64; a missing value is NaN, which a recording refuses with its row."""
    import pyarrow as pa

    kind = column.type
    if pa.types.is_dictionary(kind):
        column = column.cast(kind.value_type)
    if pa.types.is_timestamp(kind):
        return seconds(column)
    try:
        if column.type == pa.float64():
            return floats(column)  # a cast would import compute kernels, a tenth of the time of a command
        exact = not pa.types.is_integer(column.type)  # nanoseconds since 1970 exceed the integers of float64
        return floats(column.cast(pa.float64(), safe=exact))
    except pa.ArrowException as error:
        raise RecordingError(
            f"{one_line(path)}: column {one_line(name)} of type {kind}: {one_line(error)}; write float64"
        ) from error


def floats(column: "pa.ChunkedArray") -> Array:
    """Return numbers as float64, NaN if missing; pyarrow's own conversion imports pandas, which takes half a second."""
    if column.null_count:
        return np.asarray(column.to_numpy(), dtype=np.float64)
    return np.array(np.from_dlpack(column.combine_chunks()), dtype=np.float64)


def arrow_array(x: Array | Indices) -> "pa.Array":
    """Return numbers as a column without missing ones, shape (N,); pyarrow's own conversion imports pandas too."""
    import pyarrow as pa

    return pa.Array.from_buffers(pa.from_numpy_dtype(x.dtype), len(x), [None, pa.py_buffer(np.ascontiguousarray(x))])


def seconds(column: "pa.ChunkedArray") -> Array:
    """Return dates as seconds since 1970, NaN if missing."""
    import pyarrow as pa

    ns = column.cast(pa.timestamp("ns", column.type.tz)).cast(pa.int64())
    whole = np.asarray(ns.fill_null(0).to_numpy(), dtype=np.int64)
    return np.where(ns.is_null().to_numpy(), np.nan, whole // 10**9 + 1e-9 * (whole % 10**9))


def _check_type(path: Path, name: str, kind: object, *, dated: bool) -> None:
    import pyarrow as pa

    value = kind.value_type if isinstance(kind, pa.DictionaryType) else kind
    if dated and not pa.types.is_timestamp(value):
        raise RecordingError(
            f"{one_line(path)}: column {one_line(name)} is {one_line(value)[:80]}, not dates; state its unit, s, ms, "
            "us or ns"
        )
    if not dated and not (pa.types.is_integer(value) or pa.types.is_floating(value) or pa.types.is_decimal(value)):
        advice = '; t is in seconds; set unit = "iso" for dates' if pa.types.is_timestamp(value) else ""
        raise RecordingError(
            f"{one_line(path)}: column {one_line(name)} is {one_line(value)[:80]}, expected numbers{advice}"
        )


def _check_size(path: Path, rows: int, columns: int) -> None:
    if rows * columns > MOST_VALUES:
        raise RecordingError(
            f"{one_line(path)}: {rows} rows of {columns} columns; up to {MOST_VALUES} numbers are read, take a part"
        )


def _check_footer(path: Path) -> None:
    try:
        with path.open("rb") as file:
            file.seek(-min(8, path.stat().st_size), 2)
            end = file.read(8)
    except OSError as error:
        raise RecordingError(f"{one_line(path)}: {error.strerror or 'not readable'}") from error
    size = int.from_bytes(end[:4], "little")
    if end[4:] == b"PAR1" and size > LARGEST_FOOTER:
        raise RecordingError(f"{one_line(path)}: {size / 1e6:.4g} MB of metadata; write fewer columns or row groups")


PARQUET = LogFormat((".parquet", ".pq"), read_parquet)
