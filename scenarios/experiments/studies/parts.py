"""Parts of a study: Parquet files of whole trials, with the trial numbers in their names.

Finished parts that fill a block of `BLOCK` trials are merged, because opening a file takes time: a million trials are a
thousand parts. Rows never exist twice: the merged block is first written under a name that readers ignore, then its
parts are deleted, then it is renamed. After a crash, the next process completes this.
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
"""Endings of names of parts: finished trials, and trials to be repeated."""
BLOCK = 1024
"""Number of trials of a block; blocks begin at its multiples."""


@dataclass(frozen=True, slots=True)
class Part:
    """A file of rows: its trials, and whether they are `WHOLE` or `LOST`."""

    trials: range
    ending: str

    @property
    def name(self) -> str:
        """Name of its file."""
        return f"{self.trials.start:08d}-{self.trials.stop - 1:08d}{self.ending}"


def block_of(trial: int) -> range:
    """Return the trials of the block that contains a trial."""
    start = trial - trial % BLOCK
    return range(start, start + BLOCK)


def part_named(name: str) -> Part | None:
    """Return the part of a file name, None if it is not one."""
    numbers, ending = name.partition(".")[::2]
    try:
        first, last = (int(number) for number in numbers.split("-"))
    except ValueError:
        return None
    return Part(range(first, last + 1), f".{ending}")


def checked_part(path: Path, rows_per_trial: int) -> Part:
    """Return the part of a file, checked.

    Raises:
        StudyError: If it is not a part, or does not match its name.
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
        raise StudyError(f"{path}: contains trials {held.start} to {held.stop - 1}; move it away")
    if found.num_rows != len(part.trials) * rows_per_trial:
        first, last = held.start, held.stop - 1
        raise StudyError(f"{path}: its {found.num_rows} rows are not those of trials {first} to {last}; move it away")
    return part


def read_part(path: Path, columns: Sequence[str] | None = None) -> pa.Table:
    """Return the rows of one file, in its order.

    Raises:
        StudyError: If it cannot be read.
    """
    try:
        with pq.ParquetFile(path) as file:
            return file.read(columns=None if columns is None else list(columns), use_threads=False)
    except (OSError, pa.ArrowException) as error:
        raise StudyError(f"{path}: is damaged, move it away: {str(error).splitlines()[0]}") from error


def as_parquet(rows: pa.Table) -> bytes:
    """Return the content of a part."""
    buffer = io.BytesIO()
    pq.write_table(rows, buffer)
    return buffer.getvalue()


def write_whole(path: Path, content: bytes, unfinished: Path) -> None:
    """Write a file atomically, even if the machine loses power.

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
    """Return the finished parts of a block in a folder, in order."""
    found = [part for part in map(part_named, os.listdir(trials)) if part is not None and part.ending == WHOLE]
    inside = [part for part in found if part.trials.start in block and part.trials[-1] in block]
    return sorted(inside, key=lambda part: part.trials.start)


def replace_members(waiting: Path, trials: Path) -> None:
    """Replace the parts of a block by its merged file.

    Raises:
        StudyError: If its name is not that of a part; if it cannot be moved.
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
    """Sync the directory entry to disk, where the system supports it (not Windows)."""
    if hasattr(os, "O_DIRECTORY"):
        opened = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(opened)
        finally:
            os.close(opened)
