"""Temperatures of joints in a log, where it has them: `T1` .. `Tn`, or what a UR's client writes [degrees Celsius]."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ident.recordings.files import request_of
from ident.recordings.formats import format_of
from ident.recordings.formats.columns import Chosen
from ident.recordings.formats.description import LogDescription
from ident.support.arrays import Array

NAMES = {"T1, T2, ..": ("T{}", 1), "joint_temperatures_0, ..": ("joint_temperatures_{}", 0)}
"""Patterns of the columns, and the number of the first joint's."""


class _NotThere(Exception):
    """The file has no temperatures."""


def read_temperatures(path: Path, description: LogDescription, joints: int) -> Array | None:
    """Temperatures of all joints, one row a row of the file, shape (N, n); None where the file has none.

    Args:
        path: A log that has been read as a recording before.
        description: What is said of it.
        joints: Of the arm; a column must be there for each.

    Raises:
        RecordingError: If a cell of such a column is no number.
    """

    def chosen(path: Path, names: Sequence[str]) -> Chosen:
        for pattern, first in NAMES.values():
            wanted = tuple(pattern.format(first + j) for j in range(joints))
            if set(wanted) <= set(names):
                return Chosen(wanted)
        raise _NotThere

    try:
        table = format_of(path).read(path, request_of(description, chosen))
    except _NotThere:
        return None
    return np.column_stack(list(table.values()))
