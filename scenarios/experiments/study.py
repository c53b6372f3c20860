"""Studies: a numbered list of trials of one scenario, run on any executor, with rows in a folder or in memory.

Monte Carlo: trial k has the seed `first + k`, so `rx90 run SCENARIO --seed` with the seed of a row repeats that trial.
Sweep: every combination of some values, with the same seeds each time.
Sensitivity: uniform numbers determine the value of a drawn source, or the seed of a noise, whose size stays the same.
There are two designs. One at a time: no source, each source alone at its declared size, and all together. Sobol
(Saltelli et al. 2010): all sources at once on matrices A and B of uniform numbers, and, for each source, on A with that
source's columns taken from B.
"""

import itertools
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, closing, nullcontext
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import pyarrow as pa
from rich.console import Console

from ident.support.arrays import Array
from ident.support.naming import shown
from scenarios.experiments.draws import check_draws, drawn_settings, places_of, settings_with, sources_of
from scenarios.experiments.motions import motion_digest
from scenarios.experiments.robots import robot_digests
from scenarios.experiments.run import Failure, Trial
from scenarios.experiments.scenario import Value, place_of, setup_of, with_settings
from scenarios.experiments.scenario_files import MOTION, SEEDS
from scenarios.experiments.schema import Scenario
from scenarios.experiments.study_folder import StudyFolder, study_folder
from scenarios.experiments.trials import SHARES, MakeRows, Task, judged_rows, run_task, trial_schema
from scenarios.experiments.workers import Workers, completed
from scenarios.rendering.result import WithResult
from scenarios.support.errors import ScenarioError
from scenarios.support.progress import progress_of
from scenarios.support.versions import versions

if TYPE_CHECKING:
    import pandas as pd

CHUNK = 64
"""Largest number of trials of a task, which is also the largest loss in a crash: a minute of one worker."""
CHUNKS_EACH = 4
"""Number of chunks per worker of a small study, so that all workers end at about the same time."""
MOST_TRIALS = 10**8
"""Largest number of trials of a study: names of parts have eight digits."""
NONE, ALL = "(none)", "(all)"
"""Labels of trials that are not of one source alone."""
ALONE, SOBOL = "one-at-a-time", "sobol"
TOGETHER = 4
"""Ratio of the number of trials with all sources to that of one source alone."""
LABELS: tuple[str, ...] = ("design", "source", "sample")
LARGEST = 2**16
"""Largest number of repeats or samples: such a Sobol design takes two hundred core hours."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """Definition of a study: `count` trials of a scenario, each defined by its number."""

    kind: str  # `monte-carlo`, `sensitivity`, `sweep` or `comparison`
    scenario: Scenario
    count: int
    trial: Callable[[int], Trial]
    schema: pa.Schema
    identity: Mapping[str, object]  # of the study besides kind and scenario; JSON values
    rows: MakeRows = judged_rows  # makes the rows of a trial, `rows_per_joint` for each joint
    rows_per_joint: int = 1


def monte_carlo(scenario: Scenario, count: int, seed: int) -> Study:
    """Return the study of `count` trials; raises `ScenarioError` if seeds are too few, or a draw is not possible."""
    if count > MOST_TRIALS:
        raise ScenarioError(f"a study has {MOST_TRIALS} trials at most; request fewer")
    if seed + count > SEEDS:
        raise ScenarioError(f"{count} trials from seed {seed} need seeds beyond 2^31 - 1; begin at a smaller one")
    check_draws(scenario)
    return Study(
        kind="monte-carlo",
        scenario=scenario,
        count=count,
        trial=lambda number: Trial(number=number, seed=seed + number),
        schema=trial_schema(scenario, places_of(scenario.table.random), ()),
        identity={"seed": seed},
    )


def sweep(scenario: Scenario, values: Mapping[str, Sequence[Value]], seeds: int | Iterable[int]) -> Study:
    """Return the study of all combinations of values, by key path or its end, the first slowest, with each seed."""
    check_draws(scenario)
    places = [place_of(scenario.table, name) for name in values]
    points = [dict(zip(places, point, strict=True)) for point in itertools.product(*values.values())]
    for point in points:
        setup_of(with_settings(scenario, point))  # a wrong value is an error, not a failure of every trial
    chosen = tuple(Trial(seed=each).seed for each in (range(seeds) if isinstance(seeds, int) else seeds))

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


def sensitivity(scenario: Scenario, *, repeats: int, samples: int, seed: int) -> Study:
    """Return the study of both designs: `repeats` trials of each source alone, `samples` rows of the matrices."""
    for name, number in (("repeats", repeats), ("samples", samples)):
        if not 2 <= number <= LARGEST or number & (number - 1):
            raise ScenarioError(f"{name} = {shown(number)}: expected a power of 2 up to {LARGEST}, such as 16 or 64")
    check_draws(scenario)
    sources = sources_of(scenario)
    names = list(sources.columns)
    plan = [(ALONE, NONE, 0), *((ALONE, name, k) for name in names for k in range(repeats))]
    plan += [(ALONE, ALL, k) for k in range(TOGETHER * repeats)]
    plan += [(SOBOL, source, k) for k in range(samples) for source in ("A", "B", *names)]

    def every(row: Array) -> dict[str, Array]:
        return {name: row[sources.columns[name]] for name in names}

    def trial(number: int) -> Trial:
        design, source, sample = plan[number]
        own = sources.columns.get(source, slice(0, 0))
        if source == NONE:
            on = {}
        elif source == ALL:
            on = every(_uniform(sources.width, TOGETHER * repeats, seed, 1)[sample])
        elif design == ALONE:
            on = {source: _uniform(own.stop - own.start, repeats, seed, 2 + names.index(source))[sample]}
        else:
            A, B = np.split(_uniform(2 * sources.width, samples, seed, 0)[sample], 2)
            row = B if source == "B" else A.copy()
            row[own] = B[own]
            on = every(row)
        settings, streams = settings_with(sources, on)
        labels = dict(zip(LABELS, (design, source, str(sample)), strict=True))
        return Trial(number=number, seed=seed, settings=settings, streams=streams, labels=labels)

    return Study(
        kind="sensitivity",
        scenario=scenario,
        count=len(plan),
        trial=trial,
        schema=trial_schema(scenario, places_of(scenario.table.sources), LABELS),
        identity={"seed": seed, "repeats": repeats, "samples": samples},
    )


@lru_cache(maxsize=64)
def _uniform(width: int, count: int, seed: int, stream: int) -> Array:
    """Return a scrambled Sobol sequence, shape (count, width), strictly inside (0, 1)."""
    from scipy.stats import qmc  # half a second, which the other studies need not wait

    rng = np.random.default_rng(np.random.SeedSequence(entropy=seed, spawn_key=(stream,)))
    points = qmc.Sobol(width, scramble=True, rng=rng).random(count)
    return np.clip(points, 2.0**-30, 1.0 - 2.0**-30)


def carry_out(study: Study, folder: Path, workers: Workers, *, command: str, console: Console) -> StudyFolder:
    """Run the missing trials of a study and write them part by part; existing trials of the same study are kept."""
    setup_of(study.scenario)  # an error of the scenario itself is raised, instead of a thousand failed trials
    rows_per_trial = study.rows_per_joint * len(study.scenario.table.tolerance.gain)
    identity = study_identity(study)
    with study_folder(folder, identity, count=study.count, command=command, rows_per_trial=rows_per_trial) as place:
        if missing := place.missing(study.count):
            place.forget_lost()
            before, failed = study.count - sum(map(len, missing)), 0
            with (
                progress_of(f"{study.kind} {study.scenario.name}", console, study.count, before) as progress,
                closing(_results(study, missing, workers)) as results,
            ):
                for trials, rows in results:
                    place.keep(rows)
                    failed += len(rows.filter(rows["failure"].is_valid())["trial"].unique())
                    progress.advance(trials, f"{failed} failed")
        return place


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


def _results(study: Study, missing: Sequence[range], workers: Workers | None) -> Generator[tuple[int, pa.Table]]:
    """Yield number of trials and rows of each chunk; one whose worker failed has rows with its reason."""
    count, here = 1 if workers is None else workers.count(), versions()
    size = max(1, min(CHUNK, -(-sum(map(len, missing)) // (CHUNKS_EACH * count))))
    chunks = (
        range(start, min(start + size, gap.stop)) for gap in missing for start in range(gap.start, gap.stop, size)
    )
    tasks = (Task(study.scenario, tuple(map(study.trial, chunk)), study.schema, here, study.rows) for chunk in chunks)
    if workers is None:
        yield from ((len(task.trials), run_task(task)) for task in tasks)
        return
    with closing(completed(workers, run_task, tasks)) as results:
        for task, outcome in results:
            if isinstance(outcome, ScenarioError):
                lost = [Failure(trial=trial, error=outcome) for trial in task.trials]
                rows = [row for failure in lost for row in study.rows(study.scenario, failure)]
                outcome = pa.Table.from_pylist(rows, study.schema)
            yield len(task.trials), outcome


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class StudyRows(WithResult):
    """Result of a study in memory: a row per trial and joint, with `trials.CONTRACT` and the varied values."""

    RESULT: ClassVar[str] = "scenarios.results.studies:StudyResult.of_rows"
    rows: pa.Table
    scenario: Scenario

    def to_frame(self) -> "pd.DataFrame":
        """Return the rows as a pandas DataFrame; columns are those of a saved study, with `attrs["units"]`."""
        frame = self.rows.to_pandas()
        frame.attrs["units"] = dict.fromkeys(("true", "estimate", "std", *SHARES), "N (m)/unit")
        return frame


def study_rows_of(study: Study, workers: AbstractContextManager[Workers] | None = None) -> StudyRows:
    """Run a study and keep its rows in memory; they do not depend on the workers, this process if None."""
    if study.count < 1:
        raise ScenarioError(f"{study.scenario.name}: {study.kind} has no trial; give at least one seed and one value")
    with nullcontext() if workers is None else workers as opened:
        tables = [rows for _, rows in _results(study, [range(study.count)], opened)]
    return StudyRows(pa.concat_tables(tables).sort_by([("trial", "ascending"), ("joint", "ascending")]), study.scenario)
