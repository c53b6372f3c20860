"""Parts of a study: Parquet files of whole trials, whose names say which.

Finished parts that fill a block of `BLOCK` trials become one, because every file costs its opening: a million trials
are a thousand parts. At no moment are rows there twice. The block is first written whole under a name that no reader of
parts looks at, then its parts go, then it takes their place; whoever finds such a block after a crash ends the move.
"""

import io
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from scenarios.support.errors import StudyError

WHOLE, LOST = ".parquet", ".lost.parquet"
"""How the names of parts end: finished trials, and trials to be tried again."""
BLOCK = 1024
"""Trials that become one part; blocks begin at its multiples."""


@dataclass(frozen=True, slots=True)
class Part:
    """A file of rows: which trials, and whether they are `WHOLE` or `LOST`."""

    trials: range
    ending: str

    @property
    def name(self) -> str:
        """Of its file."""
        return f"{self.trials.start:08d}-{self.trials.stop - 1:08d}{self.ending}"


def block_of(trial: int) -> range:
    """The trials of the block that has a trial."""
    start = trial - trial % BLOCK
    return range(start, start + BLOCK)


def part_named(name: str) -> Part | None:
    """The part that a file name stands for, None if it stands for none."""
    numbers, ending = name.partition(".")[::2]
    try:
        first, last = (int(number) for number in numbers.split("-"))
    except ValueError:
        return None
    return Part(range(first, last + 1), f".{ending}")


def checked_part(path: Path, rows_per_trial: int) -> Part:
    """One file, if it is a whole part under its own name.

    Raises:
        StudyError: If it is no part; if it is not what its name says.
    """
    part = part_named(path.name)
    if part is None:
        raise StudyError(f"{path}: not part of a study; move it away")
    try:
        found = pq.read_metadata(path)
        at = found.schema.names.index("trial")
        groups = [found.row_group(k).column(at).statistics for k in range(found.num_row_groups)]
        held = range(min(group.min for group in groups), max(group.max for group in groups) + 1)
    except (ValueError, OSError, AttributeError, pa.ArrowException) as error:
        raise StudyError(f"{path}: not part of a study; move it away") from error
    if part.ending not in (WHOLE, LOST) or path.name != part.name or held != part.trials:
        raise StudyError(f"{path}: holds trials {held.start} to {held.stop - 1}; move it away")
    if found.num_rows != len(part.trials) * rows_per_trial:
        first, last = held.start, held.stop - 1
        raise StudyError(f"{path}: its {found.num_rows} rows are not those of trials {first} to {last}; move it away")
    return part


def read_part(path: Path, columns: Sequence[str] | None = None) -> pa.Table:
    """The rows of one file, in its order.

    Raises:
        StudyError: If it cannot be read.
    """
    try:
        with pq.ParquetFile(path) as file:
            return file.read(columns=None if columns is None else list(columns), use_threads=False)
    except (OSError, pa.ArrowException) as error:
        raise StudyError(f"{path}: is damaged, move it away: {str(error).splitlines()[0]}") from error


def as_parquet(rows: pa.Table) -> bytes:
    """The content of a part."""
    buffer = io.BytesIO()
    pq.write_table(rows, buffer)
    return buffer.getvalue()


def write_whole(path: Path, content: bytes, unfinished: Path) -> None:
    """Write a file so that it is there whole or not at all, even if the machine loses power.

    Raises:
        StudyError: If it cannot be written.
    """
    try:
        with unfinished.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        unfinished.replace(path)
    except OSError as error:
        unfinished.unlink(missing_ok=True)
        raise StudyError(
            f"{path}: cannot be written: {error.strerror}; finished trials are kept; free disk space and "
            "repeat the command"
        ) from error


def members_of(block: range, trials: Path) -> list[Part]:
    """The parts in a folder whose finished trials are a block's alone, in their order."""
    found = [part for part in map(part_named, os.listdir(trials)) if part is not None and part.ending == WHOLE]
    inside = [part for part in found if part.trials.start in block and part.trials[-1] in block]
    return sorted(inside, key=lambda part: part.trials.start)


def replace_members(waiting: Path, trials: Path) -> None:
    """Put a block that waits beside a folder of parts in the place of its members.

    Raises:
        StudyError: If its name is no part's; if it cannot be moved.
    """
    part = part_named(waiting.name.removeprefix("."))
    if part is None:
        raise StudyError(f"{waiting}: not part of a study; move it away")
    try:
        _settle(waiting.parent)
        for member in members_of(part.trials, trials):
            (trials / member.name).unlink()
        waiting.replace(trials / part.name)
    except OSError as error:
        raise StudyError(f"{waiting}: cannot be moved: {error.strerror}; repeat the command") from error


def _settle(folder: Path) -> None:
    """See that the names in a folder are on disk, where the system opens folders; Windows does not."""
    if hasattr(os, "O_DIRECTORY"):
        opened = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(opened)
        finally:
            os.close(opened)
