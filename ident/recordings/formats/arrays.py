"""Logs in NumPy's files: archives of arrays (`.npz`), or one array (`.npy`) of rows or of named fields.

An array of rows, or a field of them, gives one column per number of a row: `name[0]`, `name[1]`, .. in an
archive, but `q1`, .. and `v1`, .. of arrays `q` and `v`; 1, 2, .. of an array alone.
"""

from pathlib import Path
from zipfile import BadZipFile
from zlib import error as ZlibError

import numpy as np

from ident.recordings.formats.columns import MOST_COLUMNS, MOST_VALUES, Columns, LogFormat, Request, entry, listed
from ident.support.arrays import Array
from ident.support.errors import RecordingError
from ident.support.file_access import check_file
from ident.support.naming import one_line, shown

LARGEST = 4_000_000_000
"""Largest size of a file [bytes]."""
UNREADABLE = (OSError, EOFError, ValueError, TypeError, KeyError, BadZipFile, ZlibError, MemoryError)
"""Exceptions of NumPy for files of other formats."""


def read_arrays(path: Path, request: Request) -> Columns:
    """Read the columns of a log.

    Raises:
        RecordingError: If the file is not NumPy's, or a selected column is missing or not numeric.
    """
    check_file(path, most_bytes=LARGEST, error=RecordingError)
    try:
        loaded = np.load(path, allow_pickle=False)
        if isinstance(loaded, np.ndarray):
            _check_turned(path, {"the array": loaded}, MOST_COLUMNS)
            columns = _of_one(loaded)
        else:
            with loaded:
                _check_archive(path, loaded)
                arrays = {name: loaded[name] for name in loaded.files}
                _check_turned(path, arrays, max((len(each) for each in arrays.values() if each.ndim == 1), default=0))
                columns = [each for name, array in arrays.items() for each in _of_archive(name, array)]
    except RecordingError:
        raise
    except UNREADABLE as error:
        raise RecordingError(
            f"{one_line(path)}: expected arrays of numbers as numpy.savez or numpy.save writes them "
            f"({one_line(error)[:120] or type(error).__name__})"
        ) from error
    table = dict(columns)
    chosen = request.chosen(path, [name for name, _ in columns])
    _check_lengths(path, {name: len(table[name]) for name in chosen.names})
    return {name: _numbers(path, name, table[name], dated=name in chosen.dated) for name in chosen.names}


def _of_archive(name: str, array: np.ndarray) -> list[tuple[str, np.ndarray]]:
    if array.dtype.names:
        return [each for field in array.dtype.names for each in _of_archive(field, array[field])]
    if array.ndim == 2 and array.shape[1] <= MOST_COLUMNS:
        return [(entry(name, k), array[:, k]) for k in range(array.shape[1])]
    return [(name, array)] if array.ndim == 1 else []


def _of_one(array: np.ndarray) -> list[tuple[str, np.ndarray]]:
    if array.dtype.names:
        return _of_archive("", array)
    if array.ndim == 2 and array.shape[1] <= MOST_COLUMNS:
        return [(str(k + 1), array[:, k]) for k in range(array.shape[1])]
    return []


def _numbers(path: Path, name: str, array: np.ndarray, *, dated: bool) -> Array:
    if dated and np.issubdtype(array.dtype, np.datetime64):
        ns = array.astype("datetime64[ns]").astype(np.int64)
        return np.where(np.isnat(array), np.nan, ns // 10**9 + 1e-9 * (ns % 10**9))
    number = np.issubdtype(array.dtype, np.integer) or np.issubdtype(array.dtype, np.floating)
    if dated or not number:
        raise RecordingError(
            f"{one_line(path)}: {shown(name)} is {array.dtype}, expected {'datetime64' if dated else 'numbers'}"
        )
    return np.ascontiguousarray(array, dtype=np.float64)


def _check_turned(path: Path, arrays: dict[str, np.ndarray], samples: int) -> None:
    """Refuse a transposed array, with joints as rows and samples as columns."""
    for name, array in arrays.items():
        if array.ndim == 2 and array.shape[0] < samples <= array.shape[1]:
            rows, columns = array.shape
            raise RecordingError(
                f"{one_line(path)}: {one_line(name)} has {rows} rows of {columns} numbers; expected one "
                "row per sample; it is transposed, save its .T"
            )


def _check_archive(path: Path, archive: "np.lib.npyio.NpzFile") -> None:
    size = 0 if archive.zip is None else sum(each.file_size for each in archive.zip.infolist())
    if size > LARGEST:
        raise RecordingError(f"{one_line(path)}: {size / 1e6:.4g} MB unpacked; take a part of it")


def _check_lengths(path: Path, lengths: dict[str, int]) -> None:
    if len(set(lengths.values())) > 1:
        each = listed([f"{name}: {length}" for name, length in lengths.items()])
        raise RecordingError(f"{one_line(path)}: columns of different lengths: {each}")
    if sum(lengths.values()) > MOST_VALUES:
        raise RecordingError(f"{one_line(path)}: more than {MOST_VALUES} numbers; take a part")


ARRAYS = LogFormat((".npz", ".npy"), read_arrays)
