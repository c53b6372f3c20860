"""Trials as rows: chunks of a study on a worker, one row per trial and joint.

Workers import this module: no pandas, no terminal.
"""

import ctypes
import gc
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import pyarrow as pa
from threadpoolctl import threadpool_limits

from ident.estimation.estimate import IdentifiedGain
from ident.support.errors import IdentificationError
from scenarios.experiments.run import Failure, Simulated, Trial, identified, simulate_trials
from scenarios.experiments.scenario import Value, setup_of, value_at
from scenarios.experiments.schema import Scenario
from scenarios.support.errors import ScenarioError
from scenarios.support.versions import versions

SHARES = ("residual_std", "payload_std", "model_std")
CONTRACT = pa.schema(
    [
        ("trial", "int64"),
        ("seed", "int64"),
        ("joint", "int32"),
        *((name, "double") for name in ("true", "estimate", "std", "rel_error", "z", "tolerance")),
        ("identifiable", "bool"),
        ("passed", "bool"),
        ("reason", "string"),
        *((name, "double") for name in SHARES),
        ("failure", "string"),
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
Rows = list[dict[str, object]]
"""Rows by column."""
MakeRows = Callable[[Scenario, Simulated | Failure], Rows]
"""A picklable function that returns the rows of a trial; an `IdentificationError` is a failure of the trial."""


def trial_schema(scenario: Scenario, places: Sequence[str], labels: Sequence[str]) -> pa.Schema:
    """Return the columns of a study: common ones, labels, and varied settings, whose key paths must exist."""
    columns = setting_columns({place: value_at(scenario.table, place) for place in places})
    settings = {name: "string" if isinstance(value, str) else "double" for name, value in columns.items()}
    return pa.schema([*CONTRACT, *((name, "string") for name in labels), *settings.items()])


def setting_columns(settings: Mapping[str, Value]) -> dict[str, object]:
    """Return settings by column; an array has one column per number, counted from 1."""
    columns: dict[str, object] = {}
    for place, value in settings.items():
        if isinstance(value, list):
            columns |= {f"{place}.{k}": number for k, number in enumerate(value, 1)}
        else:
            columns[place] = value
    return columns


def common_columns(outcome: Simulated | Failure) -> dict[str, object]:
    """Return the columns that all rows of a trial have in common."""
    trial = outcome.trial
    return {"trial": trial.number, "seed": trial.seed, **trial.labels, **setting_columns(outcome.settings)}


def judged_rows(scenario: Scenario, outcome: Simulated | Failure) -> Rows:
    """Identify a simulated trial and return the verdict on each joint; all are refused if there is no estimate."""
    common = common_columns(outcome)
    if isinstance(outcome, Failure):
        setup, reason = outcome.setup, str(outcome.error) or outcome.kind
        tolerance = (scenario if setup is None else setup.scenario).table.tolerance
        true = [None] * len(tolerance.gain) if setup is None else setup.true_gain.tolist()
        common |= {"failure": outcome.kind, "reason": reason, "identifiable": False, "passed": False}
        return [
            {**common, "joint": joint, "true": gain, "tolerance": allowed}
            for joint, (gain, allowed) in enumerate(zip(true, tolerance.gain, strict=True), 1)
        ]
    run = identified(outcome)
    shares = [
        {name: getattr(gain, name) for name in SHARES if isinstance(gain, IdentifiedGain)}
        for gain in run.estimate.joints
    ]
    return [{**common, **dict(verdict), **own} for verdict, own in zip(run.verdict.gains, shares, strict=True)]


@dataclass(frozen=True, slots=True)
class Task:
    """A chunk of trials for a worker, with the columns of `trial_schema`, and the versions of the study's process."""

    scenario: Scenario
    trials: tuple[Trial, ...]
    schema: pa.Schema
    versions: Mapping[str, str] = field(default_factory=dict[str, str])
    rows: MakeRows = judged_rows


def run_task(task: Task) -> pa.Table:
    """Simulate trials, many in one batch, identify and judge each, on one thread; return their rows in order."""
    here = versions() if task.versions else {}
    for name, wanted in task.versions.items():
        if here.get(name) != wanted:
            raise ScenarioError(
                f"a worker has {name} {here.get(name)}, the study began with {wanted}; install that version there"
            )
    with threadpool_limits(1):
        table = pa.Table.from_pylist(_rows(task.scenario, task.trials, task.rows), task.schema)
    give_back_memory()
    return table


def _rows(scenario: Scenario, trials: Sequence[Trial], make: MakeRows) -> Rows:
    """Return the rows of trials; an unexpected error affects only the trial in which it occurs."""
    rows: dict[int, Rows] = {}
    try:
        for outcome in simulate_trials(setup_of(scenario), trials):
            number = outcome.trial.number
            try:
                rows[number] = make(scenario, outcome)
            except IdentificationError as error:
                assert isinstance(outcome, Simulated), "a failure is not identified"
                rows[number] = make(scenario, outcome.failed(error))
            del outcome  # else its recordings would coexist with those of the next trial
            if gc.get_freeze_count():  # in a worker, where a collection is quick: cycles of a trial hold 40 MB
                gc.collect()
            if len(rows) % TIDY_EVERY == 0:
                give_back_memory()
    except Exception as error:
        if len(trials) == 1:
            return make(scenario, Failure(trial=trials[0], error=error))
        return [row for trial in trials for row in _rows(scenario, [trial], make)]
    return [row for trial in trials for row in rows[trial.number]]


def give_back_memory() -> None:
    """Give back memory of large arrays, of which glibc keeps several hundred megabytes between smaller objects."""
    if sys.platform == "linux" and hasattr(libc := ctypes.CDLL(None), "malloc_trim"):  # musl has none and needs none
        libc.malloc_trim(0)
