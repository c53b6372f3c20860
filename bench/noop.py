"""Trials that cost nothing, for what a study costs besides them; a module of its own, so that workers can import it."""

import os
import time
from collections.abc import Sequence

import numpy as np
import pyarrow as pa
from scipy.special import ndtri

from scenarios.experiments.trials import Task

JOINTS = 6
REFUSED = 6
"""The joint without gains."""
FAILED_EVERY = 97
TOLERANCE = 0.01
DELAY = "RX90_BENCH_DELAY"
"""Seconds that a worker takes for each chunk, from its environment: the slow one."""


def no_op(task: Task) -> pa.Table:
    """In place of `run_task`."""
    time.sleep(float(os.environ.get(DELAY, "0")))
    return synthetic_rows([trial.number for trial in task.trials], [trial.seed for trial in task.trials], task.schema)


def synthetic_rows(numbers: Sequence[int], seeds: Sequence[int], schema: pa.Schema) -> pa.Table:
    """Rows with normal errors that follow from the number of the trial; some trials fail, one joint is refused."""
    trial, seed = np.repeat(numbers, JOINTS), np.repeat(seeds, JOINTS)
    joint = np.tile(np.arange(1, JOINTS + 1, dtype=np.int32), len(numbers))
    uniform = (0.5 + 0.6180339887498949 * trial + 0.137 * joint) % 1.0
    failed = trial % FAILED_EVERY == 5
    found = ~failed & (joint != REFUSED)
    error = 0.004 * ndtri(np.clip(uniform, 1e-9, 1.0 - 1e-9))
    true = 0.9 + 0.03 * joint + 0.1 * ((0.3 + 0.7548776662466927 * trial) % 1.0)
    std = 0.004 * true * (0.8 + 0.4 * ((0.1 + 0.5698402909980532 * trial) % 1.0))
    numbers_of_gains = {
        "estimate": true * (1.0 + error),
        "std": std,
        "rel_error": error,
        "z": error * true / std,
        "residual_std": 0.9 * std,
        "payload_std": 0.3 * std,
        "model_std": 0.1 * std,
    }
    columns = {
        "trial": trial,
        "seed": seed,
        "joint": joint,
        "true": true,
        "tolerance": np.full(len(trial), TOLERANCE),
        "identifiable": found,
        "passed": ~failed & ((joint == REFUSED) | (np.abs(error) <= TOLERANCE)),
        "reason": _texts("predicted standard deviation 33.7 % of the gain exceeds 10 %", where=~found),
        "failure": _texts("Saturated", where=failed),
        **{name: pa.array(values, mask=~found) for name, values in numbers_of_gains.items()},
    }
    return pa.table([columns[name] for name in schema.names], schema=schema)


def _texts(text: str, *, where: np.ndarray) -> pa.Array:
    return pa.DictionaryArray.from_arrays(pa.array(np.zeros(len(where), np.int8), mask=~where), [text]).cast(
        pa.string()
    )
