"""Trials: a scenario repeated with other seeds and settings, many to a batch, one row a trial and joint."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field

import numpy as np
import pyarrow as pa
from threadpoolctl import threadpool_limits

from ident.errors import IdentificationError
from ident.estimate import IdentifiedGain, JointResult
from scenarios.build import Bench, bench
from scenarios.errors import ScenarioError
from scenarios.files.draws import drawn_settings
from scenarios.files.resolved import resolved
from scenarios.files.schema import Scenario
from scenarios.files.settings import Value, value_at, with_settings
from scenarios.run import Run, motion_streams, run_batch
from scenarios.workers.memory import give_back_memory
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

`residual_std`, `payload_std` and `model_std` [N m / drive unit] are the shares of `std`: from the residual, from the
payload's stated uncertainty, and from what the model takes for granted;
`failure` the kind of error that left the trial without any estimate, null if there was none.
"""

OUTSIDE = ("WorkerDied", "WorkerFailed", "MemoryError")
"""Failures for a reason outside the trial, which may not fail so when it is tried again."""

TIDY_EVERY = 8
"""Trials after which free memory is given back."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One run of a study.

    Attributes:
        number: From 0.
        seed: Of its noise, and of its random settings unless they are given.
        settings: Values by place; None to draw what the scenario declares random.
        streams: Seeds of single noise streams, by name, in place of those that follow from `seed`.
        labels: What the study wants written into every row.
    """

    number: int
    seed: int
    settings: Mapping[str, Value] | None = None
    streams: Mapping[str, int] = field(default_factory=dict[str, int])
    labels: Mapping[str, str] = field(default_factory=dict[str, str])


def trial_schema(scenario: Scenario, places: Sequence[str], labels: Sequence[str]) -> pa.Schema:
    """Columns of a study: those of every study, its labels, and the settings that vary.

    Raises:
        UnknownPlace: If a place is none of the scenario's.
    """
    table, settings = resolved(scenario).table, list[tuple[str, pa.DataType]]()
    for place in places:
        value = value_at(table, place)
        if isinstance(value, list):
            settings += [(f"{place}.{k}", pa.float64()) for k in range(1, len(value) + 1)]
        else:
            settings.append((place, pa.string() if isinstance(value, str) else pa.float64()))
    return pa.schema([*CONTRACT, *(pa.field(name, pa.string()) for name in labels), *map(_field, settings)])


def run_trials(scenario: Scenario, trials: Sequence[Trial], schema: pa.Schema, *, threads: int) -> pa.Table:
    """Simulate trials in one batch, identify and judge each.

    Args:
        scenario: What is repeated.
        trials: Which.
        schema: Columns to fill, of `trial_schema`.
        threads: Threads to step with; rows do not depend on it, nor on which trials share a batch.

    Returns:
        n rows a trial. A trial that fails is n rows with the reason.
    """
    with threadpool_limits(1):
        return pa.Table.from_pylist(_rows(scenario, trials, threads), schema)


def _rows(scenario: Scenario, trials: Sequence[Trial], threads: int) -> list[dict[str, object]]:
    """Rows of trials; what nobody foresaw costs the trial that it happens to, and no other of its batch."""
    try:
        return _batch_rows(scenario, trials, threads)
    except Exception as error:
        if len(trials) == 1:
            kind = "MemoryError" if isinstance(error, MemoryError) else type(error).__name__  # NumPy has one of its own
            return failed_rows(scenario, trials[0], kind, str(error) or kind, {})
    return [row for trial in trials for row in _rows(scenario, [trial], threads)]


def _batch_rows(scenario: Scenario, trials: Sequence[Trial], threads: int) -> list[dict[str, object]]:
    scenario = resolved(scenario)
    prepared: list[tuple[Trial, Bench, Mapping[str, Value]]] = []
    rows: dict[int, list[dict[str, object]]] = {}
    for trial in trials:
        settings: Mapping[str, Value] = {}
        try:
            settings = drawn_settings(scenario, trial.seed) if trial.settings is None else trial.settings
            ready = bench(with_settings(scenario, settings) if settings else scenario)
            prepared.append((trial, ready, settings))
        except (ScenarioError, SimulationError, IdentificationError) as error:
            rows[trial.number] = failed_rows(scenario, trial, type(error).__name__, str(error), settings)
    outcomes = run_batch(
        [(ready, trial.seed) for trial, ready, _ in prepared],
        [motion_streams(trial.seed, trial.streams, len(ready.experiments)) for trial, ready, _ in prepared],
        threads=threads,
    )
    for i, outcome in outcomes:
        trial, ready, settings = prepared[i]
        if isinstance(outcome, Run):
            rows[trial.number] = _judged_rows(trial, outcome, settings)
        else:
            reason = (type(outcome).__name__, str(outcome))
            rows[trial.number] = failed_rows(ready.scenario, trial, *reason, settings, ready.true_gain)
        if len(rows) % TIDY_EVERY == 0:
            give_back_memory()
    return [row for trial in trials for row in rows[trial.number]]


def failed_rows(
    scenario: Scenario,
    trial: Trial,
    failure: str,
    reason: str,
    settings: Mapping[str, Value],
    true_gain: np.ndarray | None = None,
) -> list[dict[str, object]]:
    """Rows of a trial that has no estimate, one a joint: not identifiable, not passed, with the reason."""
    common = {"trial": trial.number, "seed": trial.seed, "failure": failure, "reason": reason}
    return [
        {
            **common,
            "joint": joint,
            "true": None if true_gain is None else float(true_gain[joint - 1]),
            "tolerance": tolerance,
            "identifiable": False,
            "passed": False,
            **trial.labels,
            **_columns(settings),
        }
        for joint, tolerance in enumerate(scenario.table.tolerance.gain, 1)
    ]


def _judged_rows(trial: Trial, run: Run, settings: Mapping[str, Value]) -> list[dict[str, object]]:
    return [
        {
            "trial": trial.number,
            "seed": trial.seed,
            **asdict(verdict),
            **_shares(gain),
            **trial.labels,
            **_columns(settings),
        }
        for verdict, gain in zip(run.verdict.gains, run.estimate.joints, strict=True)
    ]


def _shares(gain: JointResult) -> dict[str, object]:
    """What the deviation of a gain consists of."""
    if not isinstance(gain, IdentifiedGain):
        return {}
    return {"residual_std": gain.std, "payload_std": gain.payload_std, "model_std": gain.model_std}


def _columns(settings: Mapping[str, Value]) -> dict[str, object]:
    """Settings by column: arrays take one a number, counted from 1."""
    columns: dict[str, object] = {}
    for place, value in settings.items():
        if isinstance(value, list):
            columns |= {f"{place}.{k}": number for k, number in enumerate(value, 1)}
        else:
            columns[place] = value
    return columns


def _field(named: tuple[str, pa.DataType]) -> pa.Field:
    return pa.field(*named)
