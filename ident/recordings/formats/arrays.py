"""Logs in NumPy's files: archives of arrays (`.npz`), or one array (`.npy`) of rows or of named fields.

An array of rows, or a field of them, gives one column per number of a row: `name[0]`, `name[1]`, .. in an
archive, but `q1`, .. and `v1`, .. of arrays `q` and `v`; 1, 2, .. of an array alone.
"""

from collections.abc import Iterator, Sequence, Set
from pathlib import Path
from zipfile import BadZipFile
from zlib import error as ZlibError

import numpy as np

from ident.recordings.description import LogDescription
from ident.recordings.formats.table import MOST_COLUMNS, MOST_VALUES, Columns, LogFormat, Table, entry, listed
from ident.support.arrays import Array
from ident.support.errors import RecordingError
from ident.support.files import check_file
from ident.support.naming import one_line, shown

LARGEST = 4_000_000_000
"""Largest size of a file [bytes]."""
UNREADABLE = (OSError, EOFError, ValueError, TypeError, KeyError, BadZipFile, ZlibError, MemoryError)
"""Exceptions of NumPy for files of other formats."""


def open_arrays(path: Path, description: LogDescription) -> Table:
    """Read the arrays of a file; descriptions do not matter.

    Raises:
        RecordingError: If the file is not NumPy's.
    """
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
    for name, array in arrays.items():
        if array.ndim == 2 and array.shape[0] < samples <= array.shape[1]:
            raise RecordingError(
                f"{place}: {one_line(name) or 'the array'} has {array.shape[0]} rows of {array.shape[1]} numbers; "
                "expected one row per sample; it is transposed, save its .T"
            )
    columns = [each for name, array in arrays.items() for each in _columns(name, array)]
    table = dict(columns)

    def load(names: Sequence[str], dated: Set[str]) -> Columns:
        lengths = {name: len(table[name]) for name in names}
        if len(set(lengths.values())) > 1:
            each = listed([f"{name}: {length}" for name, length in lengths.items()])
            raise RecordingError(f"{place}: columns of different lengths: {each}")
        if sum(lengths.values()) > MOST_VALUES:
            raise RecordingError(f"{place}: more than {MOST_VALUES} numbers; take a part")
        return {name: _numbers(place, name, table[name], dated=name in dated) for name in names}

    return Table([name for name, _ in columns], load)


def _columns(name: str, array: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    for field in array.dtype.names or ():
        yield from _columns(field, array[field])
    if array.dtype.names is None and array.ndim == 2 and array.shape[1] <= MOST_COLUMNS:
        for k in range(array.shape[1]):
            yield entry(name, k) if name else str(k + 1), array[:, k]
    if array.dtype.names is None and array.ndim == 1 and name:
        yield name, array


def _numbers(place: str, name: str, array: np.ndarray, *, dated: bool) -> Array:
    if dated and np.issubdtype(array.dtype, np.datetime64):
        ns = array.astype("datetime64[ns]").astype(np.int64)
        return np.where(np.isnat(array), np.nan, ns // 10**9 + 1e-9 * (ns % 10**9))
    if dated or not (np.issubdtype(array.dtype, np.integer) or np.issubdtype(array.dtype, np.floating)):
        raise RecordingError(
            f"{place}: {shown(name)} is {array.dtype}, expected {'datetime64' if dated else 'numbers'}"
        )
    return np.ascontiguousarray(array, dtype=np.float64)


ARRAYS = LogFormat((".npz", ".npy"), open_arrays)
