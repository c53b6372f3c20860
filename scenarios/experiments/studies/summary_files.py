"""The files that sum a study up: `summary.parquet` of a Monte Carlo, `budget.parquet` of an error budget."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from scenarios.experiments.studies.budget import BudgetJoint, Interval
from scenarios.experiments.studies.statistics import JointStatistics, statistics_table

SUMMARY, BUDGET = "summary.parquet", "budget.parquet"


def write_summary(statistics: Sequence[JointStatistics], folder: Path) -> Path:
    """Write a row a joint.

    Raises:
        OSError: If it cannot be written.
    """
    statistics_table(statistics).to_parquet(folder / SUMMARY, index=False)
    return folder / SUMMARY


def write_budget(budgets: Sequence[BudgetJoint], folder: Path) -> Path:
    """Write a row a joint and source.

    Raises:
        OSError: If it cannot be written.
    """
    rows = [
        {
            "joint": cost.joint,
            "source": cost.source,
            "trials": cost.trials,
            "bias": cost.bias,
            "share": cost.share,
            **_flat("rms", cost.rms),
            **_flat("first", cost.first),
            **_flat("total", cost.total),
        }
        for budget in budgets
        for cost in budget.costs
    ]
    pd.DataFrame(rows).to_parquet(folder / BUDGET, index=False)
    return folder / BUDGET


def _flat(name: str, interval: Interval | None) -> dict[str, float | None]:
    value = None if interval is None else (interval.value, interval.low, interval.high)
    keys = (name, f"{name}_low", f"{name}_high")
    return dict(zip(keys, value or (None, None, None), strict=True))
