"""Logs as arrays: Parquet, NumPy's archives (`.npz`) and arrays (`.npy`), HDF5, MATLAB's `.mat`, JSON lines.

Arrays in groups of HDF5, structures of MATLAB and objects of JSON have the names of these before a dot: `state.q`.

A column of arrays of one length gives one column per number of a row: `name[0]`, `name[1]`, .., but `q1`, .. and `v1`,
.. of NumPy's arrays `q` and `v`; 1, 2, .. of an array alone.
"""

import importlib.util
import math
from collections.abc import Callable, Mapping, Sequence, Set
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ident.recordings.description import LogDescription
from ident.recordings.formats import (
    MOST_COLUMNS,
    DataFrame,
    LogFormat,
    Table,
    check_kind,
    check_size,
    readable,
    table_of,
)
from ident.support.arrays import Array, Indices
from ident.support.errors import RecordingError, placed
from ident.support.files import check_file
from ident.support.naming import needed_extra, one_line

if TYPE_CHECKING:
    import pyarrow as pa

LARGEST = 4_000_000_000
"""Largest size of a file [bytes]; of Parquet, only requested columns are read."""
LARGEST_JSON = 1_000_000_000
"""Largest size of a text in JSON [bytes]; it is read whole."""
MOST_NESTED = 1000
"""Largest number of arrays, and of objects, of a sample in JSON."""


def open_arrays(path: Path, _: LogDescription) -> Table:
    """Read the arrays of NumPy's files; raises `RecordingError` for others."""
    check_file(path, most_bytes=LARGEST, error=RecordingError)
    with readable("arrays of numbers as numpy.savez or numpy.save writes them"):
        loaded = np.load(path, allow_pickle=False)
        if isinstance(loaded, np.ndarray):
            arrays = {"": loaded}
        else:
            with loaded:
                check_size(0 if loaded.zip is None else sum(each.file_size for each in loaded.zip.infolist()) // 8)
                arrays = {name: loaded[name] for name in loaded.files}
    return array_table(arrays)


def open_hdf5(path: Path, _: LogDescription, *, matlab: bool = False) -> Table:
    """Read the arrays of numbers of an HDF5 file; those of MATLAB (`-v7.3`) are stored with rows as columns."""
    check_file(path, most_bytes=LARGEST, error=RecordingError)
    if importlib.util.find_spec("h5py") is None:
        raise RecordingError(needed_extra("h5py") or "")
    import h5py

    arrays = dict[str, np.ndarray]()
    with readable("a readable HDF5 file"), h5py.File(path, "r") as file:

        def keep(name: str, found: "h5py.Dataset | h5py.Group") -> None:
            if isinstance(found, h5py.Dataset) and found.dtype.kind in "iufV" and found.ndim in (1, 2):
                own = math.prod(found.shape) * found.dtype.itemsize
                check_size((sum(each.nbytes for each in arrays.values()) + own) // 8)
                arrays[name.replace("/", ".")] = np.squeeze(found[()].T) if matlab else found[()]

        file.visititems(keep)
    return array_table(arrays)


def open_matlab(path: Path, description: LogDescription) -> Table:
    """Read the arrays of a MATLAB file, of any version; a row or a column is one channel."""
    check_file(path, most_bytes=LARGEST, error=RecordingError)
    with path.open("rb") as file:
        if b"MATLAB 7.3" in file.read(128):
            return open_hdf5(path, description, matlab=True)
    from scipy.io import loadmat, whosmat

    with readable("a readable MATLAB file", NotImplementedError):
        check_size(sum(math.prod(shape) for _, shape, _ in whosmat(path)))
        found, arrays = loadmat(path, simplify_cells=True), dict[str, np.ndarray]()
    structures = [("", found)]
    for within, structure in structures:  # grows
        for name, x in structure.items():
            if isinstance(x, dict):
                structures.append((f"{within}{name}.", x))
            elif isinstance(x, np.ndarray) and x.dtype.kind in "iuf":
                arrays[f"{within}{name}"] = x
    return array_table(arrays)


def open_json_lines(path: Path, _: LogDescription) -> Table:
    """Read a file with one JSON object per line and sample."""
    import pyarrow as pa
    import pyarrow.json as pj

    check_file(path, most_bytes=LARGEST_JSON, error=RecordingError)
    with path.open("rb") as lines:  # nesting overflows the stack of pyarrow
        deep = next((k for k, line in enumerate(lines, 1) if max(map(line.count, (b"[", b"{"))) > MOST_NESTED), None)
    if deep is not None:
        raise RecordingError(f"line {deep} has more than {MOST_NESTED} arrays or objects; expected one of a sample")
    with readable("JSON lines, an object with the same keys per line"):
        table: pa.Table = pj.read_json(path)
        while any(isinstance(kind, pa.StructType) for kind in table.schema.types):
            table = table.flatten()

    def read(names: Sequence[str]) -> "pa.Table":
        return table.select(list(names))

    return arrow_table(table.schema, lambda name: len(table[name][0].as_py() or ()), read)


def frame_table(frame: DataFrame) -> Table:
    """Return the table of a data frame."""
    return array_table({str(name): np.asarray(column) for name, column in frame.items()})


def array_table(arrays: Mapping[str, np.ndarray]) -> Table:
    """Return the table of arrays (N,) or (N, width), with or without named fields; refuses transposed ones."""
    lengths = [len(each) for each in arrays.values() if each.ndim == 1]
    samples = max(lengths, default=MOST_COLUMNS if "" in arrays else 0)
    fields: dict[str, np.ndarray] = {}
    for name, array in arrays.items():
        if array.ndim == 2 and array.shape[0] < samples <= array.shape[1]:
            raise RecordingError(
                f"{one_line(name) or 'the array'} has {array.shape[0]} rows of {array.shape[1]} numbers; "
                "expected one row per sample; it is transposed, save its .T"
            )
        own = {name: array} if array.dtype.names is None else {each: array[each] for each in array.dtype.names}
        fields |= {label: x for label, x in own.items() if x.ndim == 2 or (x.ndim == 1 and label)}

    def read(names: Sequence[str], dated: Set[str]) -> Mapping[str, np.ndarray]:
        check_size(sum(fields[name].size for name in names))
        for name in names:
            kind = fields[name].dtype
            check_kind(name, kind, dates=kind.kind == "M", numbers=kind.kind in "iuf", dated=name in dated)
        return {name: fields[name] for name in names}

    return table_of({name: None if x.ndim == 1 else x.shape[1] for name, x in fields.items()}, read)


def open_parquet(path: Path, _: LogDescription) -> Table:
    """Open a Parquet file; raises `RecordingError` for others, or if it is too large."""
    import pyarrow.parquet as pq

    check_file(path, most_bytes=LARGEST, error=RecordingError)
    with readable("a readable Parquet file"):
        file = pq.ParquetFile(path, page_checksum_verification=True)

    def values(name: str) -> int:
        groups = map(file.metadata.row_group, range(file.metadata.num_row_groups))
        parts = [group.column(k) for group in groups for k in range(group.num_columns)]
        return sum(part.num_values for part in parts if f"{part.path_in_schema}.".startswith(f"{name}."))

    def read(names: Sequence[str]) -> "pa.Table":
        check_size(sum(map(values, names)))
        with readable("a readable Parquet file"):
            return file.read(columns=list(names))

    return arrow_table(file.schema_arrow, lambda name: round(values(name) / max(1, file.metadata.num_rows)), read)


def arrow_table(schema: "pa.Schema", width: Callable[[str], int], read: "Callable[[Sequence[str]], pa.Table]") -> Table:
    """Return the table of columns of Arrow; `width` is the number of entries of a row, of a column of arrays."""
    import pyarrow as pa

    lists = {field.name: getattr(field.type, "list_size", 0) for field in schema if _is_list(field.type)}
    widths = {name: lists[name] or width(name) if name in lists else None for name in schema.names}

    def arrays(names: Sequence[str], dated: Set[str]) -> Mapping[str, np.ndarray]:
        for name in names:
            kind = schema.field(name).type
            while hasattr(kind, "value_type"):  # of arrays, or by a dictionary
                kind = kind.value_type
            numbers = pa.types.is_decimal(kind) or pa.types.is_integer(kind) or pa.types.is_floating(kind)
            check_kind(name, kind, dates=pa.types.is_timestamp(kind), numbers=numbers, dated=name in dated)
        table = read(names)
        return {name: _numbers(name, table[name]) for name in names}

    return table_of(widths, arrays)


def _is_list(kind: object) -> bool:
    import pyarrow as pa

    return isinstance(kind, pa.ListType | pa.FixedSizeListType)


def _numbers(name: str, column: "pa.ChunkedArray") -> np.ndarray:
    """Return a column as an array, shape (N,), or (N, k) of arrays; a missing value is NaN, which recordings refuse."""
    import pyarrow as pa

    kind = column.type
    if isinstance(kind, pa.ListType | pa.FixedSizeListType):
        import pyarrow.compute as pc

        lengths = np.array(pc.list_value_length(column).to_pylist(), np.float64)  # NaN for a missing row
        width = int(np.fmax.reduce(lengths, initial=getattr(kind, "list_size", 0)))
        if (odd := lengths != width).any():
            row = int(odd.argmax()) + 1
            raise RecordingError(f"column {one_line(name)}: row {row} does not have {width} numbers, as others have")
        flat = pa.chunked_array([chunk.flatten() for chunk in column.chunks], kind.value_type)
        return _numbers(name, flat).reshape(len(lengths), width)
    if isinstance(kind, pa.DictionaryType):
        column, kind = column.cast(kind.value_type), kind.value_type
    if pa.types.is_timestamp(kind):
        ns = column.cast(pa.timestamp("ns", kind.tz)).cast(pa.int64())
        return _plain(ns.fill_null(np.iinfo(np.int64).min)).view("M8[ns]")  # not a time
    # a cast imports compute kernels, a tenth of the time of a command
    if pa.types.is_decimal(kind) or column.null_count:
        with placed(f"column {one_line(name)}"), readable(f"exact as float64, write it so; it is {kind}"):
            column = column.cast(pa.float64(), safe=not pa.types.is_integer(kind)).fill_null(np.nan)
    return _plain(column)


def _plain(column: "pa.ChunkedArray") -> np.ndarray:
    """Return a column without missing values; pyarrow's own conversion imports pandas, which takes half a second."""
    return np.from_dlpack(column.combine_chunks())


def arrow_array(x: Array | Indices) -> "pa.Array":
    """Return numbers as a column without missing ones, shape (N,); pyarrow's own conversion imports pandas too."""
    import pyarrow as pa

    return pa.Array.from_buffers(pa.from_numpy_dtype(x.dtype), len(x), [None, pa.py_buffer(np.ascontiguousarray(x))])


ARRAYS = LogFormat((".npz", ".npy"), open_arrays)
PARQUET = LogFormat((".parquet", ".pq"), open_parquet)
HDF5 = LogFormat((".h5", ".hdf5", ".hdf"), open_hdf5)
MATLAB = LogFormat((".mat",), open_matlab)
JSON_LINES = LogFormat((".jsonl", ".ndjson"), open_json_lines)
