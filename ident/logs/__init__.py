"""Formats of log files that recordings are read from, one file each; `LOGS` names them."""

from pathlib import Path

from ident.logs.columns import Columns, LogFormat
from ident.logs.csv import CSV
from ident.logs.parquet import PARQUET

LOGS: dict[str, LogFormat] = {"parquet": PARQUET, "csv": CSV}
"""Log formats by name; the ending of a file's name decides, and what no format claims is read as CSV."""


def read_columns(path: Path) -> Columns:
    """The columns of a recording, by whatever format the file's name tells.

    Raises:
        RecordingError: If the file cannot be read.
    """
    name = path.name.lower()
    return next((log for log in LOGS.values() if name.endswith(log.endings)), CSV).read(path)
