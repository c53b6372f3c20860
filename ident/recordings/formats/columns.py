"""Columns of a log: requests, and the standard names `t`, `q1` .., `v1` .."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

from ident.recordings.formats.description import TextLayout
from ident.support.arrays import Array
from ident.support.naming import one_line

MOST_COLUMNS = 10_000
"""Largest number of columns of a file."""
MOST_VALUES = 50_000_000
"""Largest number of values read from a file; a million samples of 24 joints."""
Columns: TypeAlias = Mapping[str, Array]
"""Values by column name, each of shape (N,)."""
OURS = re.compile(r"t|[qv][1-9][0-9]{0,3}")


@dataclass(frozen=True, slots=True)
class Chosen:
    """Columns of a file that are to be read.

    Attributes:
        names: Their names.
        dated: Those with dates, which are read as seconds since 1970.
    """

    names: tuple[str, ...]
    dated: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """A request for columns of a file.

    Attributes:
        chosen: Selects the columns to read from all names; raises `RecordingError` if one is missing.
        known: Returns how many names belong to the request, for detecting the layout of a text file.
        text: Declared layout of a text file.
        topic: Topic of a bag, if it has several.
        joints: Names of the joints in order, if known.
        episode: Episode of a dataset, if it has several.
    """

    chosen: Callable[[Path, Sequence[str]], Chosen]
    known: Callable[[Sequence[str]], int]
    text: TextLayout = field(default_factory=TextLayout)
    topic: str | None = None
    joints: tuple[str, ...] | None = None
    episode: float | None = None


@dataclass(frozen=True, slots=True)
class LogFormat:
    """A log format.

    Attributes:
        endings: Endings of file names, lower case.
        read: Reads the columns of a request, with their names in the file; raises `RecordingError`.
        marks: Name of a file that identifies a folder of this format, or empty.
    """

    endings: tuple[str, ...]
    read: Callable[[Path, Request], Columns]
    marks: str = ""


def listed(names: Sequence[str], most: int = 8) -> str:
    """Return names for a message, shortened if many or long."""
    text = ", ".join(one_line(name) for name in names[:most])
    return f"{text[:200]}, .." if len(names) > most or len(text) > 200 else text


def entry(name: str, number: int) -> str:
    """Return the name of an entry, from 0, of a column of arrays; entries of `q` and `v` are counted from 1."""
    return f"{name}{number + 1}" if name in ("q", "v") else f"{name}[{number}]"
