"""Formats of log files, one file each: the columns of a table by name, and a function that reads some of them."""

import re
import struct
import zipfile
import zlib
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence, Set
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from io import BufferedIOBase
from itertools import islice
from pathlib import Path
from typing import Protocol, TypeAlias, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from ident.recordings.description import FIXED, OWN, LogDescription, described
from ident.support.arrays import Array
from ident.support.errors import RecordingError
from ident.support.naming import one_line

MOST_COLUMNS = 10_000
"""Largest number of columns of a file."""
MOST_VALUES = 50_000_000
"""Largest number of values read from a file; a million samples of 24 joints."""
OURS = re.compile(r"t|[qv][1-9][0-9]{0,3}")
"""Standard names."""
KNOWN = {name for layout, (_, _, *words) in FIXED.items() if layout != OWN for name in described(words).names}
"""Names by which the header of a text is recognised, beside the standard ones."""
DAMAGED = (
    OSError, EOFError, ValueError, TypeError, KeyError, IndexError, AttributeError, AssertionError, RuntimeError,
    MemoryError, OverflowError, struct.error, zlib.error, zipfile.BadZipFile,
)  # fmt: skip
"""What libraries raise for damaged files and other formats."""
Columns: TypeAlias = Mapping[str, Array]
"""Values by column name, each of shape (N,)."""
Entries: TypeAlias = Mapping[str, tuple[str, str]]
"""Column and unit of each joint; the unit is empty if the file does not imply it."""


@runtime_checkable
class DataFrame(Protocol):
    """A data frame, as of pandas."""

    @property
    def columns(self) -> Iterable[object]:
        """Names of its columns."""
        ...

    def items(self) -> Iterable[tuple[object, ArrayLike]]:
        """Names and columns."""
        ...


@dataclass(frozen=True, slots=True)
class Table:
    """A table that has been opened.

    `load` returns some columns; those of its second argument hold dates, and are loaded as seconds since 1970. It
    raises `RecordingError` if one is not numeric. Currents are by the pattern of their names, `{joint}` for a joint.
    """

    names: Sequence[str]  # names of all columns
    load: Callable[[Sequence[str], Set[str]], Columns]
    layout: str | None = None  # name of the layout of a format that knows its joints by name
    time: str = ""  # column of the time [s] in it
    positions: Entries = field(default_factory=dict[str, tuple[str, str]])  # columns of the positions in it
    currents: Mapping[str, Entries] = field(default_factory=dict[str, Entries])
    joints: tuple[str, ...] | None = None  # joints in the order of the file; None if it has no meaning
    notes: list[str] = field(default_factory=list[str])  # remarks on what has been loaded


@dataclass(frozen=True, slots=True)
class LogFormat:
    """A log format."""

    endings: tuple[str, ...]  # endings of file names, lower case
    open: Callable[[Path, LogDescription], Table]  # opens a file by its description; raises `RecordingError`
    marks: str = ""  # name of a file that identifies a folder of this format, or empty


@contextmanager
def readable(what: str, *more: type[Exception]) -> Generator[None]:
    """Convert errors of a library for damaged files, those of `DAMAGED` and more, to a `RecordingError`."""
    try:
        yield
    except RecordingError:
        raise
    except (*DAMAGED, *more) as error:
        reason = one_line(str(error).splitlines()[0])[:150] if str(error) else type(error).__name__
        raise RecordingError(f"not {what} ({reason})") from error


def table_of(
    widths: Mapping[str, int | None], read: Callable[[Sequence[str], Set[str]], Mapping[str, np.ndarray]]
) -> Table:
    """Return a table of fields of shape (N,), whose width is None, or (N, width).

    `read` returns some fields; those of its second argument must hold dates, the others numbers.
    """
    places = dict[str, tuple[str, int | None]]()
    for name, width in widths.items():
        own = [None] if width is None else range(min(width, MOST_COLUMNS))
        places |= {name if k is None else entry(name, k): (name, k) for k in own}

    def load(names: Sequence[str], dated: Set[str]) -> Columns:
        found = read(list(dict.fromkeys(places[name][0] for name in names)), {places[name][0] for name in dated})
        if len({len(x) for x in found.values()}) > 1:
            lengths = [f"{name}: {len(found[places[name][0]])}" for name in names]
            raise RecordingError(f"columns of different lengths: {listed(lengths)}")
        columns = dict[str, Array]()
        for name in names:
            field, k = places[name]
            x = found[field] if k is None else found[field][:, k]
            if name in dated:
                ns = x.astype("M8[ns]").astype(np.int64)
                columns[name] = np.where(np.isnat(x), np.nan, ns // 10**9 + 1e-9 * (ns % 10**9))
            else:
                columns[name] = np.ascontiguousarray(x, np.float64)
        return columns

    return Table(list(places), load)


SAMPLE = "number of the sample"
"""Column of the time of a log without times."""


def with_times(table: Table, rate_hz: float) -> Table:
    """Return a table with times from its declared sampling rate, in the column `SAMPLE` [s]."""

    def load(names: Sequence[str], dated: Set[str]) -> Columns:
        found = table.load([name for name in names if name != SAMPLE], dated)
        return {SAMPLE: np.arange(len(next(iter(found.values())))) / rate_hz, **found}

    return replace(table, names=[SAMPLE, *table.names], load=load)


def merged(columns: Columns, times: Columns, time: str, remarks: list[str]) -> Columns:
    """Bring channels with times of their own, or with values in some rows alone, to the samples of the first channel.

    Between two samples a channel is interpolated. A sample between two of a channel that are further apart than twice
    its usual interval is left out, so that a gap of one channel is a gap of the log. Columns are NaN in rows without a
    value; `times` are those of each of them, `time` is the name of the column of time.
    """
    channels = {name: x for name, x in columns.items() if name != time}
    t, kept, found = np.empty(0), np.empty(0, np.bool_), dict[str, Array]()
    for name, x in channels.items():
        here = np.isfinite(x) & np.isfinite(times[name])
        own, values = times[name][here], x[here]
        back = np.flatnonzero(np.diff(own) <= 0.0)
        if len(own) < 2 or len(back):
            where = (
                f"its time does not increase after {own[back[0]]:.9g}" if len(back) else "it has fewer than two values"
            )
            raise RecordingError(f"column {one_line(name)}: {where}")
        if not found:
            t, kept = own, np.ones(len(own), dtype=np.bool_)
        after = np.clip(np.searchsorted(own, t), 1, len(own) - 1)
        gap = np.where((t < own[0]) | (t > own[-1]), np.inf, own[after] - own[after - 1])
        kept &= (gap <= 2.0 * float(np.median(np.diff(own)))) | (t == own[after]) | (t == own[after - 1])
        found[name] = np.interp(t, own, values)
    remarks.append(
        f"channels have samples at different times: interpolated at those of {one_line(next(iter(channels)))}"
    )
    return {name: x[kept] for name, x in {time: t, **found}.items()}


def check_kind(name: str, kind: object, *, dates: bool, numbers: bool, dated: bool) -> None:
    """Refuse a field that does not hold what is declared, dates or numbers."""
    if not (dates if dated else numbers):
        iso = '; t is in seconds; set unit = "iso" for dates' if dates else ""
        expected = "dates; for numbers, state the unit, s, ms, us or ns" if dated else f"numbers{iso}"
        raise RecordingError(f"column {one_line(name)} is {one_line(kind)[:80]}, expected {expected}")


def check_size(values: int) -> None:
    """Refuse to read more than `MOST_VALUES` values."""
    if values > MOST_VALUES:
        raise RecordingError(f"{values} numbers; up to {MOST_VALUES} are read, take a part of it")


def check_unpacked(stream: BufferedIOBase, most: int) -> None:
    """Refuse a stream that unpacks to more than `most` bytes, before it is unpacked whole; to its beginning if not."""
    size = 0
    while piece := stream.read(1_000_000):
        size += len(piece)
        if size > most:
            raise RecordingError(f"more than {most / 1e6:g} MB unpacked; take a part of it")


def listed(names: Iterable[str], most: int = 8) -> str:
    """Return names for a message, shortened if many or long."""
    shown = [one_line(name) for name in islice(names, most + 1)]
    text = ", ".join(shown[:most])
    return f"{text[:200]}, .." if len(shown) > most or len(text) > 200 else text


def entry(name: str, number: int) -> str:
    """Return the name of an entry, from 0, of a column of arrays; those of `q`, `v` and a nameless array from 1."""
    return f"{name}{number + 1}" if name in ("q", "v", "") else f"{name}[{number}]"
