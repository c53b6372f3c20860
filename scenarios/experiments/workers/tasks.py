"""A chunk of trials as it travels to a worker, which imports this module: no pandas, no terminal."""

from collections.abc import Mapping
from dataclasses import dataclass

import pyarrow as pa

from scenarios.experiments.files.schema import Scenario
from scenarios.experiments.trials import IDENTIFY, Trial, Work, run_trials
from scenarios.support.errors import StudyError
from scenarios.support.memory import give_back_memory
from scenarios.support.versions import versions


@dataclass(frozen=True, slots=True)
class Task:
    """A chunk of trials.

    Attributes:
        scenario: What is repeated.
        trials: Which.
        schema: Columns of the rows.
        versions: Of the one who asks.
        work: What is done with the trials.
    """

    scenario: Scenario
    trials: tuple[Trial, ...]
    schema: pa.Schema
    versions: Mapping[str, str]
    work: Work = IDENTIFY


def run_task(task: Task) -> pa.Table:
    """Run one chunk, on a worker, on one thread.

    Raises:
        StudyError: If the worker has other versions than the one who asks: rows would not be the same.
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
