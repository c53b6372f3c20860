"""Logs as arrays: Parquet files, NumPy's archives (`.npz`), one array (`.npy`) of rows or of named fields.

A column of arrays of one length gives one column per number of a row: `name[0]`, `name[1]`, .., but `q1`, .. and `v1`,
.. of NumPy's arrays `q` and `v`; 1, 2, .. of an array alone.
"""

from collections.abc import Generator, Sequence, Set
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING
from zipfile import BadZipFile
from zlib import error as ZlibError

import numpy as np

from ident.recordings.description import LogDescription
from ident.recordings.formats import MOST_COLUMNS, MOST_VALUES, OURS, Columns, LogFormat, Table, entry, listed
from ident.support.arrays import Array, Indices
from ident.support.errors import RecordingError
from ident.support.files import check_file
from ident.support.naming import one_line, shown

if TYPE_CHECKING:
    import pyarrow as pa
    import pyarrow.parquet as pq

LARGEST = 4_000_000_000
"""Largest size of a file [bytes]; of Parquet, only requested columns are read."""
LARGEST_FOOTER = 16_000_000
"""Largest size of the metadata of Parquet [bytes], which are read completely."""
UNREADABLE = (OSError, EOFError, ValueError, TypeError, KeyError, BadZipFile, ZlibError, MemoryError)
"""Exceptions of NumPy for files of other formats."""


def open_arrays(path: Path, _: LogDescription) -> Table:
    """Read the arrays of NumPy's files; raises `RecordingError` for others."""
    place = one_line(path)
    check_file(path, most_bytes=LARGEST, error=RecordingError)
    try:
        loaded = np.load(path, allow_pickle=False)
        if isinstance(loaded, np.ndarray):
            arrays = {"": loaded}
        else:
            with loaded:
                size = 0 if loaded.zip is None else sum(each.file_size for each in loaded.zip.infolist())
                if size > LARGEST:
                    raise RecordingError(f"{place}: {size / 1e6:.4g} MB unpacked; take a part of it")
                arrays = {name: loaded[name] for name in loaded.files}
    except RecordingError:
        raise
    except UNREADABLE as error:
        raise RecordingError(
            f"{place}: expected arrays of numbers as numpy.savez or numpy.save writes them "
            f"({one_line(error)[:120] or type(error).__name__})"
        ) from error
    lengths = [len(each) for each in arrays.values() if each.ndim == 1]
    samples = max(lengths, default=MOST_COLUMNS if "" in arrays else 0)
    columns: dict[str, np.ndarray] = {}
    for name, array in arrays.items():
        if array.ndim == 2 and array.shape[0] < samples <= array.shape[1]:
            raise RecordingError(
                f"{place}: {one_line(name) or 'the array'} has {array.shape[0]} rows of {array.shape[1]} numbers; "
                "expected one row per sample; it is transposed, save its .T"
            )
        fields = {name: array} if array.dtype.names is None else {each: array[each] for each in array.dtype.names}
        for label, values in fields.items():
            if values.ndim == 2 and values.shape[1] <= MOST_COLUMNS:
                columns |= {entry(label, k) if label else str(k + 1): x for k, x in enumerate(values.T)}
            elif values.ndim == 1 and label:
                columns[label] = values

    def load(names: Sequence[str], dated: Set[str]) -> Columns:
        lengths = {name: len(columns[name]) for name in names}
        if len(set(lengths.values())) > 1:
            each = listed([f"{name}: {length}" for name, length in lengths.items()])
            raise RecordingError(f"{place}: columns of different lengths: {each}")
        if sum(lengths.values()) > MOST_VALUES:
            raise RecordingError(f"{place}: more than {MOST_VALUES} numbers; take a part")
        found: dict[str, Array] = {}
        for name in names:
            x = columns[name]
            expected = "datetime64" if name in dated else "numbers"
            if x.dtype.kind not in ("M" if name in dated else "iuf"):
                raise RecordingError(f"{place}: {shown(name)} is {x.dtype}, expected {expected}")
            if name in dated:
                found[name] = _seconds(x.astype("datetime64[ns]").astype(np.int64), np.isnat(x))
            else:
                found[name] = np.ascontiguousarray(x, np.float64)
        return found

    return Table(list(columns), load)


def open_parquet(path: Path, _: LogDescription | None = None) -> Table:
    """Open a Parquet file; raises `RecordingError` for others, or if it is too large."""
    import pyarrow as pa

    places: dict[str, tuple[str, int | None]] = {}  # the column of each name, and the entry of its arrays
    names: list[str] = []
    with _opened(path) as file:
        for field in file.schema_arrow:
            own, width = [field.name], None
            if _is_list(field.type) and not OURS.fullmatch(field.name):
                if isinstance(field.type, pa.FixedSizeListType):
                    width = field.type.list_size
                else:  # that of the first row
                    first = next(file.iter_batches(batch_size=1, columns=[field.name]), None)
                    cell = None if first is None else first.column(0)[0].as_py()
                    width = 0 if cell is None else len(cell)
                own = [entry(field.name, k) for k in range(min(width, MOST_COLUMNS))]
            names += own
            places |= {name: (field.name, None if width is None else k) for k, name in enumerate(own)}

    def load(names: Sequence[str], dated: Set[str]) -> Columns:
        with _opened(path) as file:
            columns = list(dict.fromkeys(places[name][0] for name in names))
            count, most = file.metadata.num_rows, sum(column in columns for column, _ in places.values())
            if count * most > MOST_VALUES:
                raise RecordingError(
                    f"{one_line(path)}: {count} rows of {most} columns; up to {MOST_VALUES} numbers are read, take a "
                    "part"
                )
            table = file.read(columns=columns)
        dates = {places[name][0] for name in dated}
        values = {each: arrow_numbers(path, each, table[each], dated=each in dates) for each in columns}
        return {name: values[column] if k is None else values[column][:, k] for name in names
                for column, k in [places[name]]}  # fmt: skip

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


def _is_list(kind: object) -> bool:
    import pyarrow as pa

    return isinstance(kind, pa.ListType | pa.FixedSizeListType)


def arrow_numbers(path: Path, name: str, column: "pa.ChunkedArray", *, dated: bool = False) -> Array:
    """Return a column as float64, shape (N,), or (N, k) of arrays; dates are seconds since 1970.

    A missing value is NaN, which a recording refuses with its row.
    """
    import pyarrow as pa

    kind, place = column.type, f"{one_line(path)}: column {one_line(name)}"
    if _is_list(kind):
        import pyarrow.compute as pc

        lengths = pc.list_value_length(column).to_numpy()  # NaN for a missing row
        if not len(lengths):
            raise RecordingError(f"{place} has no row")
        odd = np.flatnonzero(~(lengths == lengths[0]))
        if len(odd):
            raise RecordingError(f"{place}: row {odd[0] + 1} does not have {lengths[0]:g} numbers, as row 1 has")
        flat = pa.chunked_array([chunk.flatten() for chunk in column.chunks], kind.value_type)
        return arrow_numbers(path, name, flat, dated=dated).reshape(len(lengths), int(lengths[0]))
    value = kind.value_type if isinstance(kind, pa.DictionaryType) else kind
    dates, numeric = pa.types.is_timestamp(value), (pa.types.is_integer, pa.types.is_floating, pa.types.is_decimal)
    if dated and not dates:
        raise RecordingError(f"{place} is {one_line(value)[:80]}, not dates; state its unit, s, ms, us or ns")
    if not dated and not any(is_kind(value) for is_kind in numeric):
        iso = '; t is in seconds; set unit = "iso" for dates' if dates else ""
        raise RecordingError(f"{place} is {one_line(value)[:80]}, expected numbers{iso}")
    if value is not kind:
        column = column.cast(value)
    if dated:
        ns = column.cast(pa.timestamp("ns", value.tz)).cast(pa.int64())
        return _seconds(np.asarray(ns.fill_null(0).to_numpy(), dtype=np.int64), ns.is_null().to_numpy())
    try:
        if column.type != pa.float64():  # a cast would import compute kernels, a tenth of the time of a command
            exact = not pa.types.is_integer(column.type)  # nanoseconds since 1970 exceed the integers of float64
            column = column.cast(pa.float64(), safe=exact)
    except pa.ArrowException as error:
        raise RecordingError(f"{place} of type {kind}: {one_line(error)}; write float64") from error
    if column.null_count:
        return np.asarray(column.to_numpy(), dtype=np.float64)
    # pyarrow's own conversion imports pandas, which takes half a second
    return np.array(np.from_dlpack(column.combine_chunks()), dtype=np.float64)


def _seconds(ns: np.ndarray, missing: np.ndarray) -> Array:
    return np.where(missing, np.nan, ns // 10**9 + 1e-9 * (ns % 10**9))


def arrow_array(x: Array | Indices) -> "pa.Array":
    """Return numbers as a column without missing ones, shape (N,); pyarrow's own conversion imports pandas too."""
    import pyarrow as pa

    return pa.Array.from_buffers(pa.from_numpy_dtype(x.dtype), len(x), [None, pa.py_buffer(np.ascontiguousarray(x))])


ARRAYS = LogFormat((".npz", ".npy"), open_arrays)
PARQUET = LogFormat((".parquet", ".pq"), open_parquet)
