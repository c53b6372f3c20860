"""Recordings in Parquet files."""

from pathlib import Path

import numpy as np

from ident.arrays import Array
from ident.errors import RecordingError
from ident.file_access import check_file
from ident.logs.columns import MOST_VALUES, Columns, LogFormat, used_columns
from ident.naming import one_line

LARGEST = 4_000_000_000
"""Bytes of a file; only the columns of a recording are read of it."""
LARGEST_FOOTER = 16_000_000
"""Bytes of the description of columns and row groups, which is read whole."""


def read_parquet(path: Path) -> Columns:
    """Read the columns of a recording.

    Raises:
        RecordingError: If the file is no Parquet, too large, or one of these columns holds no numbers.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    check_file(path, most_bytes=LARGEST, error=RecordingError)
    _check_footer(path)
    try:
        with pq.ParquetFile(path) as file:
            names, schema = used_columns(path, file.schema_arrow.names), file.schema_arrow
            for name in names:
                _check_type(path, name, schema.field(name).type)
            if file.metadata.num_rows * len(names) > MOST_VALUES:
                raise RecordingError(
                    f"{one_line(path)}: {file.metadata.num_rows} rows of {len(names)} columns; up to {MOST_VALUES} "
                    "numbers are read, take a part"
                )
            table = file.read(columns=names)
    except (OSError, pa.ArrowException) as error:
        reason = one_line(str(error).splitlines()[0]) if str(error) else type(error).__name__
        raise RecordingError(f"{one_line(path)}: not a readable Parquet file ({reason})") from error
    return {name: _numbers(path, name, table[name]) for name in names}


def _numbers(path: Path, name: str, column: object) -> Array:
    """A column as float64; a missing value is NaN, which a recording refuses with its row."""
    import pyarrow as pa

    assert isinstance(column, pa.ChunkedArray)
    kind = column.type
    if pa.types.is_dictionary(kind):
        column = column.cast(kind.value_type)
    try:
        return np.asarray(column.cast(pa.float64()).to_numpy(), dtype=np.float64)
    except pa.ArrowException as error:
        raise RecordingError(
            f"{one_line(path)}: column {name} of type {kind}: {one_line(error)}; write float64"
        ) from error


def _check_type(path: Path, name: str, kind: object) -> None:
    import pyarrow as pa

    value = kind.value_type if isinstance(kind, pa.DictionaryType) else kind
    if not (pa.types.is_integer(value) or pa.types.is_floating(value) or pa.types.is_decimal(value)):
        advice = "; t is in seconds" if name == "t" and pa.types.is_temporal(value) else ""
        raise RecordingError(f"{one_line(path)}: column {name} is {one_line(value)[:80]}, expected numbers{advice}")


def _check_footer(path: Path) -> None:
    try:
        with path.open("rb") as file:
            file.seek(-min(8, path.stat().st_size), 2)
            end = file.read(8)
    except OSError as error:
        raise RecordingError(f"{one_line(path)}: {error.strerror or 'not readable'}") from error
    size = int.from_bytes(end[:4], "little")
    if end[4:] == b"PAR1" and size > LARGEST_FOOTER:
        raise RecordingError(
            f"{one_line(path)}: {size / 1e6:.4g} MB describe its columns and row groups; write fewer of them"
        )


PARQUET = LogFormat((".parquet", ".pq"), read_parquet)
