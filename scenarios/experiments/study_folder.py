"""A study's folder: `study.json`, and in `trials/` one Parquet file per finished chunk, written atomically.

The name of a file states its trials, `00000064-00000095.parquet`, so the missing trials after a crash follow from the
names. Readers include parts with trials that failed for external reasons, and the next run repeats these parts.
"""

import itertools
import json
import os
import shlex
from collections.abc import Generator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from filelock import FileLock, Timeout

from ident.support.naming import one_line
from scenarios.experiments.schema import Scenario, ScenarioTable
from scenarios.experiments.trials import OUTSIDE
from scenarios.support.digests import with_digest, without_digest
from scenarios.support.errors import ScenarioError
from scenarios.support.versions import files, versions

if TYPE_CHECKING:
    import pandas as pd

STUDY, TRIALS, LOCK, UNFINISHED = "study.json", "trials", ".lock", ".unfinished"


@dataclass(frozen=True, slots=True)
class StudyFolder:
    """A study's folder; its parts are refused if damaged, or if they do not match their names."""

    path: Path
    rows_per_trial: int

    @property
    def trials(self) -> Path:
        """Folder of the parts."""
        return self.path / TRIALS

    def file(self, part: range) -> Path:
        """Path of the part of some trials."""
        return self.trials / f"{part.start:08d}-{part.stop - 1:08d}.parquet"

    def parts(self) -> list[range]:
        """The trials of the existing parts, in order."""
        parts = [self._part(path) for path in self.trials.iterdir()] if self.trials.is_dir() else []
        parts.sort(key=lambda part: part.start)
        for before, after in itertools.pairwise(parts):
            if after.start < before.stop:
                name = self.file(before).name
                raise ScenarioError(f"{self.file(after)}: its trials are also in {name}; move one away")
        return parts

    def _part(self, path: Path) -> range:
        """Return the trials in a file, whose name and number of rows must fit them."""
        try:
            found = pq.read_metadata(path)
            at = found.schema.names.index("trial")
            groups = [found.row_group(k).column(at).statistics for k in range(found.num_row_groups)]
            part = range(min(group.min for group in groups), max(group.max for group in groups) + 1)
        except (ValueError, TypeError, OSError, AttributeError, pa.ArrowException) as error:
            raise ScenarioError(f"{path}: not part of a study; move it away") from error
        if path != self.file(part) or found.num_rows != len(part) * self.rows_per_trial:
            rows = f"{found.num_rows} rows of trials {part.start} to {part.stop - 1}"
            raise ScenarioError(f"{path}: contains {rows}, which is not what its name says; move it away")
        return part

    def _lost(self, part: range) -> bool:
        return bool(pc.any(pc.is_in(self._read(part, ["failure"])["failure"], pa.array(OUTSIDE))).as_py())

    def missing(self, count: int) -> list[range]:
        """Return the unfinished trials of the first `count`, including those of lost parts, in order."""
        gaps, start = list[range](), 0
        for part in self.parts():
            if not self._lost(part):
                gaps.append(range(start, min(part.start, count)))
                start = part.stop
        return [gap for gap in (*gaps, range(start, count)) if gap]

    def forget_lost(self) -> None:
        """Remove the parts of lost trials before they are repeated."""
        for part in filter(self._lost, self.parts()):
            self.file(part).unlink()

    def keep(self, rows: pa.Table) -> None:
        """Write the rows of consecutive trials as a part, atomically."""
        first, last = pc.min_max(rows["trial"]).as_py().values()
        content = pa.BufferOutputStream()
        pq.write_table(rows, content, write_page_checksum=True)
        _write(self.file(range(first, last + 1)), content.getvalue().to_pybytes(), self.path / UNFINISHED)

    def _read(self, part: range, columns: Sequence[str] | None) -> pa.Table:
        path = self.file(part)
        try:
            with pq.ParquetFile(path, page_checksum_verification=True) as file:
                rows = file.read(columns=columns and list(columns), use_threads=False)
                return rows.select(columns or rows.column_names)  # refuses missing columns
        except (OSError, KeyError, pa.ArrowException) as error:
            raise ScenarioError(f"{path}: is damaged, move it away: {str(error).splitlines()[0]}") from error

    def table(self, columns: Sequence[str] | None = None) -> "pd.DataFrame":
        """Return all existing rows, sorted by trial, method (if several) and joint."""
        try:
            rows = pa.concat_tables([self._read(part, columns) for part in self.parts()]).to_pandas()
        except pa.ArrowException as error:
            raise ScenarioError(f"{self.trials}: its parts differ in their columns, as if one is damaged") from error
        keys = [key for key in ("trial", "method", "joint") if key in rows.columns]
        return rows.sort_values(keys, ignore_index=True)


def _write(path: Path, content: bytes, unfinished: Path) -> None:
    """Write a file atomically, even if the machine loses power."""
    try:
        with unfinished.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        unfinished.replace(path)
    except OSError as error:
        unfinished.unlink(missing_ok=True)
        raise ScenarioError(
            f"{path}: cannot be written: {error.strerror}; finished trials are kept; free disk space and "
            "repeat the command"
        ) from error


@contextmanager
def study_folder(
    path: Path, identity: Mapping[str, object], *, count: int, command: str, rows_per_trial: int
) -> Generator[StudyFolder]:
    """Open a new or existing study folder, locked for other processes; refuse that of another study."""
    path = path.absolute()
    try:
        if path.is_dir() and not (path / STUDY).is_file():
            strange = [child.name for child in path.iterdir() if child.name not in (TRIALS, LOCK, UNFINISHED)]
            strange += [TRIALS] * any((path / TRIALS).glob("*"))
            if strange:
                said = f"contains {strange[0]!r} but no {STUDY}, so it is not a study; use another --out"
                raise ScenarioError(f"{path}: {said}")
        (path / TRIALS).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ScenarioError(f"{path}: cannot contain a study: {error.strerror}; use another --out") from error
    with ExitStack() as held:
        try:
            held.enter_context(FileLock(path / LOCK, timeout=0))
        except Timeout as error:
            raise ScenarioError(f"{path}: another process uses it; wait for it or use another --out") from error
        (path / UNFINISHED).unlink(missing_ok=True)
        wanted = json.loads(json.dumps({**identity, "files": files(), "versions": versions()}))
        if (path / STUDY).exists():
            known = _record(path / STUDY)
            difference = _first_difference({key: known.get(key) for key in wanted}, wanted, "")
            if difference is not None:
                raise ScenarioError(f"{path}: belongs to another study: {difference}; use another --out")
            count = max(count, known["trials"])  # the most that were requested so far
        record = with_digest({**wanted, "trials": count, "command": command})
        _write(path / STUDY, (json.dumps(record, indent=2) + "\n").encode(), path / UNFINISHED)
        yield StudyFolder(path, rows_per_trial)


def _record(path: Path) -> dict[str, Any]:
    try:
        stated = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        stated = None
    record: Any = without_digest(stated, path)
    if not isinstance(record, dict) or not isinstance(record.get("trials"), int):
        raise ScenarioError(f"{path}: not the record of a study; use another --out")
    return record


def _first_difference(there: object, here: object, place: str) -> str | None:
    """Return the first difference between two JSON values: path and both values."""
    if isinstance(there, Mapping) and isinstance(here, Mapping):
        inner = (
            _first_difference(there.get(key), here.get(key), f"{place}.{key}" if place else str(key))
            for key in dict.fromkeys((*here, *there))
        )
        return next(filter(None, inner), None)
    if there == here:
        return None
    texts = ["absent" if value is None else json.dumps(value) for value in (there, here)]
    old, new = (text if len(text) <= 60 else f"{text[:57]}..." for text in texts)
    return f"{place} is {old} there and {new} here"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StoredStudy:
    """A finished study; `named` is the name of its scenario, `seed` that of the first trial."""

    scenario: Scenario
    named: str
    seed: int
    trials: int
    command: str
    versions: Mapping[str, object]
    rows: StudyFolder


def read_study(folder: Path) -> StoredStudy:
    """Read a finished study from its folder; nothing is opened for writing."""
    path = folder / STUDY
    try:
        record = _record(path)
        stated = record["scenario"]
        table = ScenarioTable.model_validate_json(json.dumps({"description": "", **stated["table"]}))
        words = shlex.split(record["command"])
        found = StoredStudy(
            scenario=Scenario(str(stated["name"]), folder, table),
            named=words[2] if len(words) > 2 else str(stated["name"]),
            seed=int(record["seed"]),
            trials=record["trials"],
            command=record["command"],
            versions=dict(record["versions"]),
            rows=StudyFolder(folder, len(table.tolerance.gain)),
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        first = one_line(" ".join(str(error).splitlines()[:3]))
        raise ScenarioError(f"{one_line(path)}: damaged, or written by another version of rx90: {first}") from error
    if missing := sum(map(len, found.rows.missing(found.trials))):
        said = f"{missing} of {found.trials} trials are missing; continue with: {found.command}"
        raise ScenarioError(f"{one_line(folder)}: {said}")
    return found
