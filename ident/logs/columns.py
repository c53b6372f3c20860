"""Columns of a recording: `t`, `q1` .. `qn`, `v1` .. `vn`; which of a file's are used, and which look misnamed."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from ident.arrays import Array
from ident.errors import RecordingError
from ident.naming import one_line, shown

MOST_COLUMNS = 10_000
"""Columns of a file, used or not."""
MOST_VALUES = 50_000_000
"""Numbers that are read of a file; a million samples of 24 joints."""
Columns: TypeAlias = Mapping[str, Array]
"""Values by column name, all (N,)."""
OURS = re.compile(r"t|[qv][1-9][0-9]{0,3}")


@dataclass(frozen=True, slots=True)
class LogFormat:
    """A kind of file that recordings are read from.

    Attributes:
        endings: How the names of such files end, lower case.
        read: Reads the columns that are ours; raises `RecordingError`.
    """

    endings: tuple[str, ...]
    read: Callable[[Path], Columns]


def used_columns(path: Path, header: Sequence[str]) -> list[str]:
    """Those of a file's columns that make a recording, in their order.

    Raises:
        RecordingError: If a name is there twice, counts joints from 0, or differs in its case; or there are none.
    """
    if len(header) > MOST_COLUMNS:
        raise RecordingError(f"{one_line(path)}: {len(header)} columns; files of up to {MOST_COLUMNS} are read")
    used = [name for name in header if OURS.fullmatch(name)]
    if len(set(used)) < len(used):
        doubled = next(name for name in used if used.count(name) > 1)
        raise RecordingError(f"{one_line(path)}: column {doubled} appears twice in the header")
    for name in header:
        if name in ("q0", "v0"):
            raise RecordingError(
                f"{one_line(path)}: column {name}: joints are numbered from 1; rename them q1, q2, .., v1, v2, .."
            )
        if name not in used and OURS.fullmatch(name.lower()) and name.lower() not in used:
            raise RecordingError(
                f"{one_line(path)}: column {shown(name)}: names are lower case; rename it {name.lower()}"
            )
    if not used:
        found = ", ".join(one_line(name) for name in header[:8])
        raise RecordingError(f"{one_line(path)}: the header names no column t, q1.. or v1..; found {found[:200]}")
    return used
