"""A study: a numbered list of trials of one scenario, run on any executor, with results in a folder."""

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, closing
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import pyarrow as pa
import pyarrow.compute as pc
from rich.console import Console

from scenarios.experiments.build import setup_of
from scenarios.experiments.files.motions import motion_digest
from scenarios.experiments.files.schema import Scenario
from scenarios.experiments.robots import robot_digests
from scenarios.experiments.studies.folder import StudyFolder, study_folder
from scenarios.experiments.studies.parts import LOST, WHOLE, Part, block_of
from scenarios.experiments.trials import IDENTIFY, OUTSIDE, Failure, Task, Trial, Work, run_task
from scenarios.experiments.workers.execute import GivenUp, Workers, completed
from scenarios.support.errors import StudyError
from scenarios.support.progress import progress_of
from scenarios.support.versions import versions

if TYPE_CHECKING:
    import pandas as pd

CHUNK = 32
"""Largest number of trials of a task, which is also the largest loss in a crash: 64 simulations of pairs in a batch."""
CHUNKS_EACH = 4
"""Number of chunks per worker of a small study, so that all workers end at about the same time."""
MOST_TRIALS = 10**8
"""Largest number of trials of a study: names of parts have eight digits."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """Definition of a study.

    Attributes:
        kind: `monte-carlo`, `sensitivity` or `comparison`.
        scenario: The scenario to be repeated.
        count: Number of trials.
        trial: Function that returns the trial of a number.
        schema: Columns of its rows.
        identity: Identity of the study besides kind and scenario; JSON values.
        work: Functions that run the trials.
        rows_per_joint: Number of rows of a trial for each joint.
    """

    kind: str
    scenario: Scenario
    count: int
    trial: Callable[[int], Trial]
    schema: pa.Schema
    identity: Mapping[str, object]
    work: Work = IDENTIFY
    rows_per_joint: int = 1


def carry_out(study: Study, folder: Path, workers: Workers, *, command: str, console: Console) -> StudyFolder:
    """Run the missing trials of a study and write them part by part.

    Args:
        study: Definition of a study.
        folder: Its folder; existing trials of the same study are kept.
        workers: Workers for the trials; rows do not depend on them.
        command: The user's command, for the record.
        console: Console on stderr, for the progress.

    Returns:
        The folder of the finished study.

    Raises:
        StudyError: One of its kinds, if the folder holds another study or cannot be written, or workers cannot run
            trials.
        ScenarioError: One of its kinds, if the scenario or its draws are wrong.
    """
    setup_of(study.scenario)  # an error of the scenario itself is raised, instead of a thousand failed trials
    opened = study_folder(
        folder,
        study_identity(study),
        count=study.count,
        command=command,
        rows_per_trial=study.rows_per_joint * len(study.scenario.table.tolerance.gain),
    )
    with opened as place:
        missing = place.missing(study.count)
        label = f"{study.kind} {study.scenario.name}"
        if missing:
            place.forget_lost()
            before = study.count - sum(map(len, missing))
            failed = 0
            with progress_of(label, console, study.count, before) as progress:
                tasks, unfinished = _tasks(study, missing, workers.count()), Unfinished(missing)
                with closing(completed(workers, run_task, tasks, tick=lambda: None)) as results:
                    for task, outcome in results:
                        rows = _given_up(task, outcome) if isinstance(outcome, GivenUp) else outcome
                        keep(place, task, rows, unfinished)
                        failed += _failures(rows)
                        progress.advance(len(task.trials), f"{failed} failed")
        return place


@dataclass(frozen=True, slots=True, eq=False)
class StudyRows:
    """Result of a study.

    Attributes:
        rows: One row per trial and joint, in that order, with the columns of `trials.CONTRACT` and those of the varied
            values.
    """

    rows: pa.Table

    def to_frame(self) -> "pd.DataFrame":
        """Return the rows as a pandas DataFrame."""
        return self.rows.to_pandas()


def study_rows_of(study: Study, workers: AbstractContextManager[Workers] | None = None) -> StudyRows:
    """Run a study and keep its rows in memory. Without workers, trials run in this process; rows do not depend on this.

    Raises:
        StudyError: If there is no trial to run; if workers cannot run trials.
    """
    if study.count < 1:
        raise StudyError(f"{study.scenario.name}: {study.kind} has no trial; give at least one seed and one value")
    every = [range(study.count)]
    if workers is None:
        tables = [run_task(task) for task in _tasks(study, every, 1)]
    else:
        with workers as opened:
            results = completed(opened, run_task, _tasks(study, every, opened.count()), tick=lambda: None)
            tables = [_given_up(task, rows) if isinstance(rows, GivenUp) else rows for task, rows in results]
    rows = pa.concat_tables([study.schema.empty_table(), *tables])
    return StudyRows(rows.sort_by([("trial", "ascending"), ("joint", "ascending")]))


def study_identity(study: Study) -> dict[str, object]:
    """Return the identity of the study's folder."""
    table = study.scenario.table
    motions = {table.experiment.motion: motion_digest(table.experiment.motion, study.scenario.folder)}
    for draw in (table.sources if study.kind == "sensitivity" else table.random).values():
        if draw.choice is not None and "experiment.motion" in draw.targets:
            motions |= {str(name): motion_digest(str(name), study.scenario.folder) for name in draw.choice}
    numbers = table.model_dump(mode="json")
    for unused in ("description", "random" if study.kind == "sensitivity" else "sources"):
        del numbers[unused]
    return {
        "study": study.kind,
        "scenario": {
            "name": study.scenario.name,
            "table": numbers,
            "motions": motions,
            "robot": robot_digests(table.robot, study.scenario.folder),
        },
        **study.identity,
    }


def _tasks(study: Study, missing: Sequence[range], workers: int) -> Iterator[Task]:
    """Return chunks of consecutive trials of one block, small enough for all workers to have some."""
    size = max(1, min(CHUNK, -(-sum(map(len, missing)) // (CHUNKS_EACH * workers))))
    make = partial(Task, study.scenario, schema=study.schema, versions=versions(), work=study.work)
    for gap in missing:
        start = gap.start
        while start < gap.stop:
            stop = min(start + size, gap.stop, block_of(start).stop)
            yield make(trials=tuple(study.trial(number) for number in range(start, stop)))
            start = stop


def _given_up(task: Task, outcome: GivenUp) -> pa.Table:
    rows = [
        row
        for trial in task.trials
        for row in task.work.failed(task.scenario, Failure(trial=trial, kind=outcome.failure, reason=outcome.reason))
    ]
    return pa.Table.from_pylist(rows, task.schema)


def _failures(rows: pa.Table) -> int:
    """Trials without any estimate."""
    failed = rows.filter(rows["failure"].is_valid())
    return len(failed["trial"].unique())


@dataclass(frozen=True, slots=True)
class Unfinished:
    """Unfinished trials of the blocks.

    Attributes:
        missing: Trials missing at the start, in order.
        left: Number of these that are still missing, by the first trial of each block.
    """

    missing: Sequence[range]
    left: dict[int, int] = field(default_factory=dict[int, int])

    def finish(self, trials: range) -> range | None:
        """Count trials of one block as finished; return the block if it is complete."""
        block = block_of(trials.start)
        before = self.left.get(block.start)
        if before is None:
            before = sum(max(0, min(gap.stop, block.stop) - max(gap.start, block.start)) for gap in self.missing)
        self.left[block.start] = before - len(trials)
        return None if self.left[block.start] else block


def keep(place: StudyFolder, task: Task, rows: pa.Table, unfinished: Unfinished) -> None:
    """Write the results of a task: finished and lost trials separately, one part per run of consecutive trials."""
    lost = set(rows.filter(pc.is_in(rows["failure"], pa.array(OUTSIDE)))["trial"].to_pylist())
    numbers = [trial.number for trial in task.trials]
    for ending, run in itertools.groupby(numbers, key=lambda number: LOST if number in lost else WHOLE):
        members = list(run)
        part = Part(range(members[0], members[-1] + 1), ending)
        place.write_part(part, rows.filter(pc.is_in(rows["trial"], pa.array(part.trials, pa.int64()))))
        block = unfinished.finish(part.trials) if ending == WHOLE else None
        if block is not None:
            place.merge(block)
