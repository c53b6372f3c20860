"""Layouts of logs that are known by their columns: our own, and those that others write always alike; `LAYOUTS`."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeAlias

from ident.recordings.formats import joint_states, own, ur_rtde
from ident.recordings.formats.description import LogDescription

Layout: TypeAlias = Callable[[Path, Sequence[str], LogDescription], LogDescription | None]
"""From a file's name, the names of its columns and what is said of it: what the other columns are; None if the file has
another layout. Raises `RecordingError` where it has this one and cannot be used."""
LAYOUTS: dict[str, Layout] = {
    own.NAME: own.layout,
    ur_rtde.NAME: ur_rtde.actual,
    ur_rtde.TARGET: ur_rtde.target,
    joint_states.NAME: joint_states.layout,
}
"""In the order in which they are tried."""
