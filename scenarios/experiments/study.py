"""Studies: a numbered list of trials of one scenario, run on any executor, with rows in a folder or in memory.

Trial k of a Monte Carlo study has the seed `first + k`, so `rx90 run SCENARIO --seed` with the seed of a row repeats
that trial. A sweep runs every combination of some values, with the same seeds each time.
"""

import itertools
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import pyarrow as pa
from rich.console import Console

from scenarios.experiments.draws import check_draws, drawn_settings, places_of
from scenarios.experiments.motions import motion_digest
from scenarios.experiments.robots import robot_digests
from scenarios.experiments.run import Failure, Trial
from scenarios.experiments.scenario import Value, place_of, with_settings
from scenarios.experiments.scenario_files import MOTION
from scenarios.experiments.schema import Scenario
from scenarios.experiments.setup import setup_of
from scenarios.experiments.study_folder import StudyFolder, study_folder
from scenarios.experiments.trials import IDENTIFY, Task, Work, run_task, trial_schema
from scenarios.experiments.workers.execute import GivenUp, Workers, completed
from scenarios.support.errors import StudyError
from scenarios.support.progress import progress_of
from scenarios.support.seeds import SEEDS
from scenarios.support.versions import versions

if TYPE_CHECKING:
    import pandas as pd

CHUNK = 64
"""Largest number of trials of a task, which is also the largest loss in a crash: a minute of one worker."""
CHUNKS_EACH = 4
"""Number of chunks per worker of a small study, so that all workers end at about the same time."""
MOST_TRIALS = 10**8
"""Largest number of trials of a study: names of parts have eight digits."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """Definition of a study.

    Attributes:
        kind: `monte-carlo`, `sensitivity`, `sweep` or `comparison`.
        scenario: The scenario to be repeated.
        count: Number of trials.
        trial: Function that returns the trial of a number.
        schema: Columns of its rows.
        identity: Identity of the study besides kind and scenario; JSON values.
        work: Functions that make the rows of trials.
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


def monte_carlo(scenario: Scenario, count: int, seed: int) -> Study:
    """Return the study of `count` trials.

    Raises:
        StudyError: If there are not enough seeds or part names.
        ScenarioError: If the target or distribution of a draw does not exist.
    """
    if count > MOST_TRIALS:
        raise StudyError(f"a study has {MOST_TRIALS} trials at most; request fewer")
    if seed + count > SEEDS:
        raise StudyError(f"{count} trials from seed {seed} need seeds beyond 2^31 - 1; begin at a smaller one")
    check_draws(scenario, setup_of)
    return Study(
        kind="monte-carlo",
        scenario=scenario,
        count=count,
        trial=lambda number: Trial(number=number, seed=seed + number),
        schema=trial_schema(scenario, places_of(scenario.table.random), ()),
        identity={"seed": seed},
    )


def sweep(scenario: Scenario, values: Mapping[str, Sequence[Value]], seeds: int | Iterable[int]) -> Study:
    """Return the study of all combinations; the first key varies slowest, seeds fastest.

    Args:
        scenario: The scenario to be repeated; its random values are drawn, except swept ones.
        values: Values by key path or its end.
        seeds: Seeds of the trials of each combination; a number n means 0 to n - 1.

    Raises:
        ScenarioError: If a key path does not exist or is ambiguous, a value is not valid, or the scenario's draws are
            wrong.
    """
    check_draws(scenario, setup_of)
    places = [place_of(scenario.table, name) for name in values]
    points = [dict(zip(places, point, strict=True)) for point in itertools.product(*values.values())]
    for point in points:
        setup_of(with_settings(scenario, point))  # a wrong value is an error, not a failure of every trial
    chosen = tuple(range(seeds) if isinstance(seeds, int) else seeds)

    def trial(number: int) -> Trial:
        point, seed = points[number // len(chosen)], chosen[number % len(chosen)]
        return Trial(number=number, seed=seed, settings={**drawn_settings(scenario, seed), **point})

    return Study(
        kind="sweep",
        scenario=scenario,
        count=len(points) * len(chosen),
        trial=trial,
        schema=trial_schema(scenario, list(dict.fromkeys([*places, *places_of(scenario.table.random)])), ()),
        identity={"values": {place: list(of) for place, of in zip(places, values.values(), strict=True)}},
    )


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
    joints = len(study.scenario.table.tolerance.gain)
    with study_folder(
        folder,
        study_identity(study),
        count=study.count,
        command=command,
        rows_per_trial=study.rows_per_joint * joints,
    ) as place:
        missing = place.missing(study.count)
        if missing:
            place.forget_lost()
            before, failed = study.count - sum(map(len, missing)), 0
            label = f"{study.kind} {study.scenario.name}"
            with (
                progress_of(label, console, study.count, before) as progress,
                closing(_results(study, missing, workers)) as results,
            ):
                for trials, rows in results:
                    place.keep(rows)
                    failed += len(rows.filter(rows["failure"].is_valid())["trial"].unique())
                    progress.advance(trials, f"{failed} failed")
        return place


def study_rows_of(study: Study, workers: AbstractContextManager[Workers] | None = None) -> "StudyRows":
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
            tables = [rows for _, rows in _results(study, every, opened)]
    rows = pa.concat_tables([study.schema.empty_table(), *tables])
    return StudyRows(rows.sort_by([("trial", "ascending"), ("joint", "ascending")]))


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


def study_identity(study: Study) -> dict[str, object]:
    """Return the identity of the study's folder."""
    table, folder = study.scenario.table, study.scenario.folder
    used, unused = ("sources", "random") if study.kind == "sensitivity" else ("random", "sources")
    motions = [table.experiment.motion]
    for draw in getattr(table, used).values():
        if draw.choice is not None and MOTION in draw.targets:
            motions += map(str, draw.choice)
    return {
        "study": study.kind,
        "scenario": {
            "name": study.scenario.name,
            "table": table.model_dump(mode="json", exclude={"description", unused}),
            "motions": {motion: motion_digest(motion, folder) for motion in motions},
            "robot": robot_digests(table.robot, folder),
        },
        **study.identity,
    }


def _tasks(study: Study, missing: Sequence[range], workers: int) -> Iterator[Task]:
    """Return chunks of consecutive trials, small enough for all workers to have some."""
    size = max(1, min(CHUNK, -(-sum(map(len, missing)) // (CHUNKS_EACH * workers))))
    here = versions()
    for gap in missing:
        for start in range(gap.start, gap.stop, size):
            trials = tuple(study.trial(number) for number in range(start, min(start + size, gap.stop)))
            yield Task(study.scenario, trials, study.schema, here, study.work)


def _results(study: Study, missing: Sequence[range], workers: Workers) -> Generator[tuple[int, pa.Table]]:
    """Yield the number of trials and the rows of each task; a task whose worker failed has rows with its reason."""
    with closing(completed(workers, run_task, _tasks(study, missing, workers.count()))) as results:
        for task, outcome in results:
            if isinstance(outcome, GivenUp):
                lost = [Failure(trial=trial, kind=outcome.failure, reason=outcome.reason) for trial in task.trials]
                rows = [row for failure in lost for row in study.work.failed(study.scenario, failure)]
                yield len(task.trials), pa.Table.from_pylist(rows, study.schema)
            else:
                yield len(task.trials), outcome
