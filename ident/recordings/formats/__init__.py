"""Formats of log files, one file each; `LOGS` lists them."""

from pathlib import Path

from ident.recordings.formats.arrays import ARRAYS
from ident.recordings.formats.csv import CSV
from ident.recordings.formats.lerobot import LEROBOT
from ident.recordings.formats.parquet import PARQUET
from ident.recordings.formats.ros import ROS
from ident.recordings.formats.table import LogFormat

LOGS: dict[str, LogFormat] = {
    "parquet": PARQUET,
    "numpy": ARRAYS,
    "ros": ROS,
    "lerobot": LEROBOT,
    "csv": CSV,
}
"""Log formats by name; the ending of a file's name selects the format, and CSV is the default."""


def format_of(path: Path) -> LogFormat:
    """Return the format of a file by its name, of a folder by its content."""
    name = path.name.lower()
    for log in LOGS.values():
        if name.endswith(log.endings) or (log.marks and (path / log.marks).is_file()):
            return log
    return CSV
