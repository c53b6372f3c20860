"""Formats of log files, one file each: a table's names of columns, of which a reader loads those that are asked for."""

import re
from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from ident.recordings.description import LogDescription
from ident.support.arrays import Array
from ident.support.errors import RecordingError
from ident.support.naming import nearest, one_line, shown

MOST_COLUMNS = 10_000
"""Largest number of columns of a file."""
MOST_VALUES = 50_000_000
"""Largest number of values read from a file; a million samples of 24 joints."""
OURS = re.compile(r"t|[qv][1-9][0-9]{0,3}")
"""Standard names."""
KNOWN = re.compile(OURS.pattern + r"|timestamp|(?:actual|target)_(?:q|current)_[0-5]")
"""Names by which the header of a text is recognised: the standard ones, and those of Universal Robots."""
Columns: TypeAlias = Mapping[str, Array]
"""Values by column name, each of shape (N,)."""


@dataclass(frozen=True, slots=True)
class Table:
    """A table that has been opened.

    Attributes:
        names: Names of all columns.
        load: Returns some columns; those of the second argument hold dates, and are loaded as seconds since 1970.
            Raises `RecordingError` if one is not numeric.
    """

    names: Sequence[str]
    load: Callable[[Sequence[str], Set[str]], Columns]


@dataclass(frozen=True, slots=True)
class LogFormat:
    """A log format.

    Attributes:
        endings: Endings of file names, lower case.
        open: Opens a file; its description may state topic, episode and layout of the text. Raises `RecordingError`.
        marks: Name of a file that identifies a folder of this format, or empty.
    """

    endings: tuple[str, ...]
    open: Callable[[Path, LogDescription], Table]
    marks: str = ""


def listed(names: Sequence[str], most: int = 8) -> str:
    """Return names for a message, shortened if many or long."""
    text = ", ".join(one_line(name) for name in names[:most])
    return f"{text[:200]}, .." if len(names) > most or len(text) > 200 else text


def entry(name: str, number: int) -> str:
    """Return the name of an entry, from 0, of a column of arrays; entries of `q` and `v` are counted from 1."""
    return f"{name}{number + 1}" if name in ("q", "v") else f"{name}[{number}]"


def check_joint(place: str, joint: str, there: Sequence[str]) -> None:
    """Refuse the name of a joint that a log does not have."""
    if joint not in there:
        raise RecordingError(
            f"{place}: no joint {shown(joint)}{nearest(joint, there)}; there are {listed(there)}; give the log's joint "
            "names, base to flange (--joints)"
        )
