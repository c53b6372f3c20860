"""Trials: a scenario with various seeds and settings, run in batches, one row per trial and joint.

Workers import this module: no pandas, no terminal.
"""

import ctypes
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field

import pyarrow as pa
from threadpoolctl import threadpool_limits

from ident.estimation.estimate import IdentifiedGain, JointResult
from ident.support.arrays import Array
from ident.support.errors import IdentificationError
from scenarios.experiments.build import changed, setup_of
from scenarios.experiments.files.schema import Scenario
from scenarios.experiments.files.settings import Value, value_at
from scenarios.experiments.run import ReadyTrial, Run, Trial, run_batch, trial_settings
from scenarios.support.errors import ScenarioError, StudyError
from scenarios.support.versions import versions
from sim.errors import SimulationError

CONTRACT = pa.schema(
    [
        ("trial", pa.int64()),
        ("seed", pa.int64()),
        ("joint", pa.int32()),
        ("true", pa.float64()),
        ("estimate", pa.float64()),
        ("std", pa.float64()),
        ("rel_error", pa.float64()),
        ("z", pa.float64()),
        ("tolerance", pa.float64()),
        ("identifiable", pa.bool_()),
        ("passed", pa.bool_()),
        ("reason", pa.string()),
        ("residual_std", pa.float64()),
        ("payload_std", pa.float64()),
        ("model_std", pa.float64()),
        ("failure", pa.string()),
    ]
)
"""Columns of every study.

`residual_std`, `payload_std` and `model_std` [N m / drive unit] are the contributions to `std`: from the residual, from
the payload's specified uncertainty, and from the model's assumptions. `failure` is the kind of error of a trial without
any estimate, null if there was none.
"""

OUTSIDE = ("WorkerDied", "WorkerFailed", "MemoryError")
"""Failures for external reasons, which may not occur when the trial is repeated."""

TIDY_EVERY = 8
"""Trials after which free memory is given back."""
LOGS_AT_ONCE = 3.2e7
"""Largest size of the logs of a batch [bytes]: eight pairs of 20 s. More at once save 1.6 % of the time at most."""


def trial_schema(scenario: Scenario, places: Sequence[str], labels: Sequence[str]) -> pa.Schema:
    """Return the columns of a study: common ones, labels, and varied settings.

    Raises:
        ScenarioError: If a key path does not exist in the scenario.
    """
    table, settings = scenario.table, list[tuple[str, pa.DataType]]()
    for place in places:
        value = value_at(table, place)
        if isinstance(value, list):
            settings += [(f"{place}.{k}", pa.float64()) for k in range(1, len(value) + 1)]
        else:
            settings.append((place, pa.string() if isinstance(value, str) else pa.float64()))
    return pa.schema([*CONTRACT, *(pa.field(name, pa.string()) for name in labels), *map(_field, settings)])


Rows = list[dict[str, object]]
"""Rows by column."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Failure:
    """A trial without an estimate.

    Attributes:
        trial: The trial.
        kind: Kind of the error.
        reason: Message of the error.
        settings: Values drawn before the failure.
        true_gain: Injected gains [N m / drive unit], shape (n,), None if the failure came earlier.
    """

    trial: Trial
    kind: str
    reason: str
    settings: Mapping[str, Value] = field(default_factory=dict[str, Value])
    true_gain: Array | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Work:
    """Functions that run the trials of a study. Must be picklable: functions of modules, and plain values.

    Attributes:
        finished: Simulates prepared trials in one batch, with a number of threads; yields the index of each, with its
            rows or its failure.
        failed: Returns the rows of a failed trial.
    """

    finished: Callable[[Sequence[ReadyTrial], int], Iterator[tuple[int, Rows | Failure]]]
    failed: Callable[[Scenario, Failure], Rows]


def run_trials(
    scenario: Scenario, trials: Sequence[Trial], schema: pa.Schema, *, threads: int, work: Work | None = None
) -> pa.Table:
    """Simulate trials, many in one batch, identify and judge each.

    Args:
        scenario: The scenario to be repeated.
        trials: The trials.
        schema: Columns, from `trial_schema`.
        threads: Number of threads; rows depend neither on it nor on the division into batches.
        work: Functions that run them, `IDENTIFY` if None.

    Returns:
        n rows per trial. A failed trial has n rows with the reason.
    """
    with threadpool_limits(1):
        return pa.Table.from_pylist(_rows(scenario, trials, threads, work or IDENTIFY), schema)


def _rows(scenario: Scenario, trials: Sequence[Trial], threads: int, work: Work) -> Rows:
    """Return the rows of trials; an unexpected error affects only the trial in which it occurs."""
    try:
        return _batch_rows(scenario, trials, threads, work)
    except Exception as error:
        if len(trials) == 1:
            kind = (
                "MemoryError" if isinstance(error, MemoryError) else type(error).__name__
            )  # NumPy has its own MemoryError
            return work.failed(scenario, Failure(trial=trials[0], kind=kind, reason=str(error) or kind))
    return [row for trial in trials for row in _rows(scenario, [trial], threads, work)]


def _batch_rows(scenario: Scenario, trials: Sequence[Trial], threads: int, work: Work) -> Rows:
    setup = setup_of(scenario)
    ready: list[ReadyTrial] = []
    rows: dict[int, Rows] = {}
    for trial in trials:
        settings: Mapping[str, Value] = {}
        try:
            settings = trial_settings(setup, trial)
            ready.append(ReadyTrial(trial=trial, setup=changed(setup, settings), settings=settings))
        except (ScenarioError, SimulationError, IdentificationError) as error:
            failure = Failure(trial=trial, kind=type(error).__name__, reason=str(error), settings=settings)
            rows[trial.number] = work.failed(scenario, failure)
    for batch in _batches(ready):
        for i, outcome in work.finished(batch, threads):
            each = batch[i]
            found = work.failed(each.setup.scenario, outcome) if isinstance(outcome, Failure) else outcome
            rows[each.trial.number] = found
            if len(rows) % TIDY_EVERY == 0:
                give_back_memory()
    return [row for trial in trials for row in rows[trial.number]]


def _batches(ready: Sequence[ReadyTrial]) -> Iterator[list[ReadyTrial]]:
    """Yield batches of consecutive trials whose logs do not exceed `LOGS_AT_ONCE`, with at least one trial each."""
    batch, size = list[ReadyTrial](), 0.0
    for trial in ready:
        own = sum(16.0 * m.trajectory.duration * m.controller.rate_hz * m.trajectory.n for m in trial.experiments)
        if batch and size + own > LOGS_AT_ONCE:
            yield batch
            batch, size = [], 0.0
        batch.append(trial)
        size += own
    if batch:
        yield batch


def failure_of(ready: ReadyTrial, error: Exception) -> Failure:
    """Return the failure of a prepared trial."""
    return Failure(
        trial=ready.trial,
        kind=type(error).__name__,
        reason=str(error),
        settings=ready.settings,
        true_gain=ready.setup.true_gain,
    )


def _identified(trials: Sequence[ReadyTrial], threads: int) -> Iterator[tuple[int, Rows | Failure]]:
    for i, outcome in run_batch(trials, threads=threads):
        each = trials[i]
        found = _judged_rows(each, outcome) if isinstance(outcome, Run) else failure_of(each, outcome)
        del outcome  # else its observations would coexist with those of the next trial
        yield i, found


def failed_rows(scenario: Scenario, failure: Failure) -> Rows:
    """Return the rows of a trial without estimate, one per joint: not identifiable, not passed, with the reason."""
    trial, true_gain = failure.trial, failure.true_gain
    common = {"trial": trial.number, "seed": trial.seed, "failure": failure.kind, "reason": failure.reason}
    return [
        {
            **common,
            "joint": joint,
            "true": None if true_gain is None else float(true_gain[joint - 1]),
            "tolerance": tolerance,
            "identifiable": False,
            "passed": False,
            **trial.labels,
            **setting_columns(failure.settings),
        }
        for joint, tolerance in enumerate(scenario.table.tolerance.gain, 1)
    ]


IDENTIFY = Work(finished=_identified, failed=failed_rows)
"""Identify with the scenario's method, and judge."""


@dataclass(frozen=True, slots=True)
class Task:
    """A chunk of trials for a worker: the arguments of `run_trials`, and the versions of the study's process."""

    scenario: Scenario
    trials: tuple[Trial, ...]
    schema: pa.Schema
    versions: Mapping[str, str]
    work: Work = IDENTIFY


def run_task(task: Task) -> pa.Table:
    """Run one chunk, on a worker, on one thread.

    Raises:
        StudyError: If the worker has other versions, as rows would differ.
    """
    here = versions()
    for name, wanted in task.versions.items():
        if here.get(name) != wanted:
            raise StudyError(
                f"a worker has {name} {here.get(name)}, the study began with {wanted}; install that version there"
            )
    rows = run_trials(task.scenario, task.trials, task.schema, threads=1, work=task.work)
    give_back_memory()
    return rows


def _judged_rows(ready: ReadyTrial, run: Run) -> Rows:
    return [
        {
            "trial": ready.trial.number,
            "seed": ready.trial.seed,
            **asdict(verdict),
            **_shares(gain),
            **ready.trial.labels,
            **setting_columns(ready.settings),
        }
        for verdict, gain in zip(run.verdict.gains, run.estimate.joints, strict=True)
    ]


def _shares(gain: JointResult) -> dict[str, object]:
    """Return the contributions to the standard deviation of a gain."""
    if not isinstance(gain, IdentifiedGain):
        return {}
    return {"residual_std": gain.residual_std, "payload_std": gain.payload_std, "model_std": gain.model_std}


def setting_columns(settings: Mapping[str, Value]) -> dict[str, object]:
    """Return settings by column; an array has one column per number, counted from 1."""
    columns: dict[str, object] = {}
    for place, value in settings.items():
        if isinstance(value, list):
            columns |= {f"{place}.{k}": number for k, number in enumerate(value, 1)}
        else:
            columns[place] = value
    return columns


def _field(named: tuple[str, pa.DataType]) -> pa.Field:
    return pa.field(*named)


def give_back_memory() -> None:
    """Give free memory of the C library back to the system.

    Between small objects that persist, glibc keeps freed memory of large arrays, up to several hundred megabytes.
    """
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # of glibc; musl has none and needs none
        if trim is not None:
            trim(0)
