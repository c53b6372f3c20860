"""Columns of a log: what is asked of a file, and our own names, `t`, `q1` .., `v1` .."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

from ident.recordings.formats.description import TextLayout
from ident.support.arrays import Array
from ident.support.naming import one_line

MOST_COLUMNS = 10_000
"""Columns of a file, used or not."""
MOST_VALUES = 50_000_000
"""Numbers that are read of a file; a million samples of 24 joints."""
Columns: TypeAlias = Mapping[str, Array]
"""Values by column name, all (N,)."""
OURS = re.compile(r"t|[qv][1-9][0-9]{0,3}")


@dataclass(frozen=True, slots=True)
class Chosen:
    """Columns of a file that are to be read.

    Attributes:
        names: Their names.
        dated: Those of them that hold dates, to be read as seconds since 1970.
    """

    names: tuple[str, ...]
    dated: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """What is asked of a file.

    Attributes:
        chosen: Of the names of all its columns, those to read; raises `RecordingError` if one is not there.
        known: How many of some names are meant by the request, to find out how a text file is laid out.
        text: How a text file is laid out, as far as it is said.
        topic: Of a bag, where it has several.
        joints: Names of the joints in their order, where they are known.
        episode: Of a dataset, where it has several.
    """

    chosen: Callable[[Path, Sequence[str]], Chosen]
    known: Callable[[Sequence[str]], int]
    text: TextLayout = field(default_factory=TextLayout)
    topic: str | None = None
    joints: tuple[str, ...] | None = None
    episode: float | None = None


@dataclass(frozen=True, slots=True)
class LogFormat:
    """A kind of file that recordings are read from.

    Attributes:
        endings: How the names of such files end, lower case.
        read: Reads the columns that a request chooses, under their names in the file; raises `RecordingError`.
        marks: Name of a file that a folder of this kind holds, empty if none is.
    """

    endings: tuple[str, ...]
    read: Callable[[Path, Request], Columns]
    marks: str = ""


def listed(names: Sequence[str], most: int = 8) -> str:
    """Names for a message, cut where they are many or long."""
    text = ", ".join(one_line(name) for name in names[:most])
    return f"{text[:200]}, .." if len(names) > most or len(text) > 200 else text


def entry(name: str, number: int) -> str:
    """Name of an entry, from 0, of a column that holds a row of numbers; `q` and `v` are our own, counted from 1."""
    return f"{name}{number + 1}" if name in ("q", "v") else f"{name}[{number}]"
