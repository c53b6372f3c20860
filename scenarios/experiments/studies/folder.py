"""A study's folder: `study.json`, and in `trials/` one Parquet part per finished chunk, written atomically.

The name of a part contains its trials, `00000064-00000095.parquet`, so the missing trials after a crash follow from the
names. Trials that failed for external reasons are in separate parts, `00000003-00000003.lost.parquet`; readers include
them, and the next run repeats them.
"""

import itertools
import json
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from filelock import FileLock, Timeout

from scenarios.experiments.studies.parts import (
    LOST,
    WHOLE,
    Part,
    as_parquet,
    checked_part,
    members_of,
    read_part,
    replace_members,
    write_whole,
)
from scenarios.support.errors import StudyError
from scenarios.support.versions import files, versions

STUDY, TRIALS, LOCK, UNFINISHED = "study.json", "trials", ".lock", ".unfinished"


@dataclass(frozen=True, slots=True)
class StudyFolder:
    """An open study folder, locked for other processes.

    Attributes:
        path: The folder.
        rows_per_trial: Rows of each trial, one per joint.
        seen: Its parts if the study is complete, None to list them at each access.
    """

    path: Path
    rows_per_trial: int
    seen: tuple[Part, ...] | None = None

    @property
    def trials(self) -> Path:
        """Folder of the parts."""
        return self.path / TRIALS

    def parts(self) -> list[Part]:
        """The existing parts, in order of their trials.

        Raises:
            StudyError: If a file is not a part, or does not match its name.
        """
        if self.seen is not None:
            return list(self.seen)
        parts = [checked_part(path, self.rows_per_trial) for path in self.trials.iterdir()]
        parts.sort(key=lambda part: part.trials.start)
        for before, after in itertools.pairwise(parts):
            if after.trials.start < before.trials.stop:
                raise StudyError(f"{self.trials / after.name}: its trials are also in {before.name}; move one away")
        return parts

    def as_it_is(self) -> "StudyFolder":
        """Return the folder with a fixed list of parts; raises as `parts`."""
        return replace(self, seen=tuple(self.parts()))

    def missing(self, count: int) -> list[range]:
        """Return the unfinished trials of the first `count`, including lost ones, in order."""
        gaps, start = list[range](), 0
        for part in self.parts():
            if part.ending == WHOLE:
                gaps.append(range(start, min(part.trials.start, count)))
                start = part.trials.stop
        return [gap for gap in (*gaps, range(start, count)) if gap]

    def forget_lost(self) -> None:
        """Remove the rows of lost trials before they are repeated."""
        for part in self.parts():
            if part.ending == LOST:
                (self.trials / part.name).unlink()

    def write_part(self, part: Part, rows: pa.Table) -> None:
        """Add a part atomically.

        Raises:
            StudyError: If it cannot be written; existing parts remain.
        """
        write_whole(self.trials / part.name, as_parquet(rows), self.path / UNFINISHED)

    def merge(self, block: range) -> None:
        """Merge the parts of a complete block.

        Raises:
            StudyError: If it cannot be written; if a part cannot be read.
        """
        members = members_of(block, self.trials)
        if len(members) < 2 or sum(len(part.trials) for part in members) != len(block):
            return
        rows = pa.concat_tables([read_part(self.trials / part.name) for part in members])
        waiting = self.path / f".{Part(block, WHOLE).name}"
        write_whole(waiting, as_parquet(rows), self.path / UNFINISHED)
        _end_moves(self.path)

    def rows(self, part: Part, columns: Sequence[str]) -> pa.Table:
        """Return the rows of one part, in its order.

        Raises:
            StudyError: If it cannot be read.
        """
        return read_part(self.trials / part.name, columns)

    def table(self, columns: Sequence[str] | None = None) -> pd.DataFrame:
        """Return all existing rows, sorted by trial, method (if several) and joint.

        Raises:
            StudyError: If a part cannot be read.
        """
        paths = [self.trials / part.name for part in self.parts()]
        try:
            rows = pq.read_table(paths, columns=None if columns is None else list(columns)).to_pandas()
        except (OSError, pa.ArrowException) as error:
            raise StudyError(f"{self.trials}: a part is damaged, move it away: {str(error).splitlines()[0]}") from error
        keys = [key for key in ("trial", "method", "joint") if key in rows.columns]
        return rows.sort_values(keys, ignore_index=True)


@contextmanager
def study_folder(
    path: Path, identity: Mapping[str, object], *, count: int, command: str, rows_per_trial: int
) -> Generator[StudyFolder]:
    """Open a new or existing study folder.

    Args:
        path: The folder; made if missing.
        identity: Identity of the study: kind, scenario, seeds. JSON values.
        count: Number of trials requested; the record keeps the largest number requested so far.
        command: The command, for the record.
        rows_per_trial: Rows of each trial, one per joint.

    Raises:
        StudyError: If it cannot be created or written; if it is not a study or another one (the message names the first
            difference); if it is open elsewhere; if its record cannot be read.
    """
    path = path.absolute()
    try:
        _refuse_foreign(path)
        (path / TRIALS).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StudyError(f"{path}: cannot contain a study: {error.strerror}; use another --out") from error
    lock = FileLock(path / LOCK)
    try:
        lock.acquire(timeout=0)
    except Timeout as error:
        raise StudyError(f"{path}: another process uses this folder; wait for it or use another --out") from error
    try:
        (path / UNFINISHED).unlink(missing_ok=True)
        _end_moves(path)
        wanted = json.loads(json.dumps({**identity, "files": files(), "versions": versions()}))
        known = _read_record(path / STUDY)
        if known is not None:
            _refuse_other(path, known, wanted)
            count = max(count, int(str(known["trials"])))
        record = {**wanted, "trials": count, "command": command}
        write_whole(path / STUDY, (json.dumps(record, indent=2) + "\n").encode(), path / UNFINISHED)
        yield StudyFolder(path, rows_per_trial)
    finally:
        lock.release()


def _end_moves(path: Path) -> None:
    """Replace parts by their merged blocks."""
    for waiting in path.glob(f".*{WHOLE}"):
        replace_members(waiting, path / TRIALS)


def _refuse_foreign(path: Path) -> None:
    if path.is_dir() and not (path / STUDY).is_file():
        strange = [child.name for child in path.iterdir() if child.name not in (TRIALS, LOCK, UNFINISHED)]
        if strange or any((path / TRIALS).glob("*")):
            named = strange[0] if strange else TRIALS
            raise StudyError(f"{path}: contains {named!r} but no {STUDY}, so it is not a study; use another --out")


def _read_record(path: Path) -> dict[str, object] | None:
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        if isinstance(record, dict) and isinstance(record.get("trials"), int):
            return record
    except FileNotFoundError:
        return None
    except ValueError:
        pass
    raise StudyError(f"{path}: not the record of a study; use another --out")


def _refuse_other(path: Path, known: Mapping[str, object], wanted: Mapping[str, object]) -> None:
    difference = _first_difference({key: known.get(key) for key in wanted}, wanted, "")
    if difference is not None:
        place, there, here = difference
        raise StudyError(
            f"{path}: belongs to another study: {place} is {_short(there)} there and {_short(here)} here; "
            "use another --out"
        )


def _first_difference(there: object, here: object, place: str) -> tuple[str, object, object] | None:
    """Return the first difference between two JSON values: path and both values."""
    if isinstance(there, Mapping) and isinstance(here, Mapping):
        for key in dict.fromkeys((*here, *there)):
            inner = f"{place}.{key}" if place else str(key)
            found = _first_difference(there.get(key), here.get(key), inner)
            if found is not None:
                return found
        return None
    return None if there == here else (place, there, here)


def _short(value: object) -> str:
    text = "absent" if value is None else json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
