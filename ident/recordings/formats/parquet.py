"""Logs in Parquet files.

A column whose cells are arrays of one length gives that number of columns, `name[0]`, `name[1]`, ..
"""

from collections.abc import Generator, Sequence, Set
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ident.recordings.description import LogDescription
from ident.recordings.formats.table import MOST_COLUMNS, MOST_VALUES, OURS, Columns, LogFormat, Table, entry
from ident.support.arrays import Array, Indices
from ident.support.errors import RecordingError
from ident.support.files import check_file
from ident.support.naming import one_line

if TYPE_CHECKING:
    import pyarrow as pa
    import pyarrow.parquet as pq

LARGEST = 4_000_000_000
"""Largest size of a file [bytes]; only requested columns are read."""
LARGEST_FOOTER = 16_000_000
"""Largest size of the metadata [bytes], which are read completely."""


def open_parquet(path: Path, description: LogDescription | None = None) -> Table:
    """Open a file; descriptions do not matter.

    Raises:
        RecordingError: If the file is not Parquet, or too large.
    """
    import pyarrow as pa

    with _opened(path) as file:
        places: dict[str, tuple[str, int | None]] = {}  # the column of each name, and the entry of its arrays
        names: list[str] = []
        for field in file.schema_arrow:
            rows = pa.types.is_list(field.type) or pa.types.is_fixed_size_list(field.type)
            width = _width(file, field) if rows and not OURS.fullmatch(field.name) else None
            each = [field.name] if width is None else [entry(field.name, k) for k in range(width)]
            names += each
            places |= {name: (field.name, None if width is None else k) for k, name in enumerate(each)}

    def load(names: Sequence[str], dated: Set[str]) -> Columns:
        with _opened(path) as file:
            for name in names:
                column, number = places[name]
                kind = file.schema_arrow.field(column).type
                _check_type(path, name, kind if number is None else kind.value_type, dated=name in dated)
            columns = list(dict.fromkeys(places[name][0] for name in names))
            count, most = file.metadata.num_rows, sum(column in columns for column, _ in places.values())
            if count * most > MOST_VALUES:
                raise RecordingError(
                    f"{one_line(path)}: {count} rows of {most} columns; up to {MOST_VALUES} numbers are read, take a "
                    "part"
                )
            table = file.read(columns=columns)
        arrays = {column for column, number in places.values() if number is not None}
        values = {each: (_rows if each in arrays else _numbers)(path, each, table[each]) for each in columns}
        found: dict[str, Array] = {}
        for name in names:
            column, number = places[name]
            found[name] = values[column] if number is None else values[column][:, number]
        return found

    return Table(names, load)


@contextmanager
def _opened(path: Path) -> "Generator[pq.ParquetFile]":
    """Open a file, with errors of the library as errors of the file."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    check_file(path, most_bytes=LARGEST, error=RecordingError)
    try:
        with path.open("rb") as file:
            file.seek(-min(8, path.stat().st_size), 2)
            end = file.read(8)
        size = int.from_bytes(end[:4], "little")
        if end[4:] == b"PAR1" and size > LARGEST_FOOTER:
            raise RecordingError(
                f"{one_line(path)}: {size / 1e6:.4g} MB of metadata; write fewer columns or row groups"
            )
        with pq.ParquetFile(path) as opened:
            yield opened
    except (OSError, pa.ArrowException) as error:
        reason = one_line(str(error).splitlines()[0]) if str(error) else type(error).__name__
        raise RecordingError(f"{one_line(path)}: not a readable Parquet file ({reason})") from error


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
    odd = np.flatnonzero(~(lengths == lengths[0]))
    if len(odd):
        raise RecordingError(
            f"{one_line(path)}: column {one_line(name)}: row {odd[0] + 1} does not have {lengths[0]:g} numbers, as row "
            "1 has"
        )
    flat = pa.chunked_array([chunk.flatten() for chunk in column.chunks], column.type.value_type)
    return _numbers(path, name, flat).reshape(len(lengths), int(lengths[0]))


def _numbers(path: Path, name: str, column: "pa.ChunkedArray") -> Array:
    """Return a column as float64; a missing value is NaN, which a recording refuses with its row."""
    import pyarrow as pa

    kind = column.type
    if pa.types.is_dictionary(kind):
        column = column.cast(kind.value_type)
    if pa.types.is_timestamp(kind):
        ns = column.cast(pa.timestamp("ns", kind.tz)).cast(pa.int64())
        whole = np.asarray(ns.fill_null(0).to_numpy(), dtype=np.int64)
        return np.where(ns.is_null().to_numpy(), np.nan, whole // 10**9 + 1e-9 * (whole % 10**9))
    try:
        if column.type != pa.float64():  # a cast would import compute kernels, a tenth of the time of a command
            exact = not pa.types.is_integer(column.type)  # nanoseconds since 1970 exceed the integers of float64
            column = column.cast(pa.float64(), safe=exact)
    except pa.ArrowException as error:
        raise RecordingError(
            f"{one_line(path)}: column {one_line(name)} of type {kind}: {one_line(error)}; write float64"
        ) from error
    if column.null_count:
        return np.asarray(column.to_numpy(), dtype=np.float64)
    # pyarrow's own conversion imports pandas, which takes half a second
    return np.array(np.from_dlpack(column.combine_chunks()), dtype=np.float64)


def arrow_array(x: Array | Indices) -> "pa.Array":
    """Return numbers as a column without missing ones, shape (N,); pyarrow's own conversion imports pandas too."""
    import pyarrow as pa

    return pa.Array.from_buffers(pa.from_numpy_dtype(x.dtype), len(x), [None, pa.py_buffer(np.ascontiguousarray(x))])


def _check_type(path: Path, name: str, kind: object, *, dated: bool) -> None:
    import pyarrow as pa

    value = kind.value_type if isinstance(kind, pa.DictionaryType) else kind
    dates, number = pa.types.is_timestamp(value), (pa.types.is_integer, pa.types.is_floating, pa.types.is_decimal)
    if dated and not dates:
        wrong = "not dates; state its unit, s, ms, us or ns"
    elif not dated and not any(is_kind(value) for is_kind in number):
        wrong = "expected numbers" + ('; t is in seconds; set unit = "iso" for dates' if dates else "")
    else:
        return
    raise RecordingError(f"{one_line(path)}: column {one_line(name)} is {one_line(value)[:80]}, {wrong}")


PARQUET = LogFormat((".parquet", ".pq"), open_parquet)
