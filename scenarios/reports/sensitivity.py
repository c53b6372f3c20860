"""The error budget for people: ranked tables, `budget.parquet`, `budget.md`, a bar chart."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from rich.console import Console
from rich.text import Text

from scenarios.files.schema import Scenario
from scenarios.reports.run import number, table
from scenarios.studies.budget import Interval, JointBudget

SHOWN = 6
"""Sources a joint that the terminal shows; the files have all."""
CHART, TABLE, TEXT = "budget.png", "budget.parquet", "budget.md"
COLUMNS = ("Source", "Alone, rms", "95 % interval", "Bias", "Share", "First order", "Total order")


def print_budgets(budgets: Sequence[JointBudget], console: Console) -> None:
    """The largest sources of each joint, and what to buy down first."""
    for budget in budgets:
        console.print(Text(f"Joint {budget.joint}: {_headline(budget)}", style="bold"))
        grid = table(*COLUMNS)
        for cells in _rows(budget)[:SHOWN]:
            grid.add_row(*cells)
        console.print(grid)
        hidden = budget.costs[SHOWN:]
        if hidden:
            rest = 100.0 * sum(cost.share for cost in hidden)
            console.print(f"and {len(hidden)} more with {rest:.2g} % together\n")
    console.print(Text(first_to_buy_down(budgets), style="bold"))


def first_to_buy_down(budgets: Sequence[JointBudget]) -> str:
    """One sentence: which source dominates which joints."""
    by_source: dict[str, list[str]] = {}
    for budget in budgets:
        if budget.costs:
            by_source.setdefault(budget.costs[0].source, []).append(str(budget.joint))
    parts = [f"{source} (joint {', '.join(joints)})" for source, joints in by_source.items()]
    return f"Buy down first: {'; '.join(parts)}." if parts else "No source gave a gain."


def write_budgets(budgets: Sequence[JointBudget], scenario: Scenario, folder: Path) -> list[Path]:
    """Write `budget.parquet`, `budget.md` and `budget.png`.

    Raises:
        OSError: If they cannot be written.
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
    pd.DataFrame(rows).to_parquet(folder / TABLE, index=False)
    (folder / TEXT).write_text(_markdown(budgets, scenario), encoding="utf-8")
    _chart(budgets, scenario).savefig(folder / CHART, dpi=110)
    return [folder / name for name in (TABLE, TEXT, CHART)]


def _headline(budget: JointBudget) -> str:
    floor = number(None if budget.floor is None else 100.0 * budget.floor, "+.3f", " %")
    lost = f"; {budget.lost} trials gave no gain" if budget.lost else ""
    return (
        f"all together {100.0 * budget.together:.3f} % rms "
        f"(added up one by one: {100.0 * budget.summed:.3f} %, none: {floor}; "
        f"Sobol indices from {budget.samples} rows){lost}"
    )


def _rows(budget: JointBudget) -> list[tuple[str, ...]]:
    return [
        (
            cost.source,
            f"{100.0 * cost.rms.value:.3f} %",
            f"{100.0 * cost.rms.low:.3f}..{100.0 * cost.rms.high:.3f}",
            f"{100.0 * cost.bias:+.3f} %",
            f"{100.0 * cost.share:.1f} %",
            _index(cost.first),
            _index(cost.total),
        )
        for cost in budget.costs
    ]


def _index(index: Interval | None) -> str:
    return "-" if index is None else f"{index.value:.2f} ({index.low:.2f}..{index.high:.2f})"


def _flat(name: str, interval: Interval | None) -> dict[str, float | None]:
    value = None if interval is None else (interval.value, interval.low, interval.high)
    keys = (name, f"{name}_low", f"{name}_high")
    return dict(zip(keys, value or (None, None, None), strict=True))


def _markdown(budgets: Sequence[JointBudget], scenario: Scenario) -> str:
    parts = [f"# Error budget of {scenario.name}", first_to_buy_down(budgets), f"![Error budget]({CHART})"]
    for budget in budgets:
        lines = [f"## Joint {budget.joint}", "", f"{_headline(budget)}.", ""]
        lines += [f"| {' | '.join(cells)} |" for cells in (COLUMNS, ["---"] * len(COLUMNS), *_rows(budget))]
        parts.append("\n".join(lines))
    parts.append(
        "Alone: the source at its declared size with all others off. Share: of the sum of mean squares. First and "
        "total order: Sobol indices of the error's variance with all sources on, with 95 % bootstrap intervals."
    )
    return "\n\n".join(parts) + "\n"


def _chart(budgets: Sequence[JointBudget], scenario: Scenario) -> Figure:
    """One panel a joint, sources in one order for all: that of their mean share."""
    mean: dict[str, float] = {}
    for budget in budgets:
        for cost in budget.costs:
            mean[cost.source] = mean.get(cost.source, 0.0) + cost.share
    order = sorted(mean, key=lambda source: mean[source])
    figure = Figure(figsize=(2.2 + 2.3 * len(budgets), 0.8 + 0.27 * len(order)), layout="constrained")
    figure.suptitle(f"{scenario.name}: error of the gain from each source alone")
    axes = np.atleast_1d(figure.subplots(1, len(budgets), sharey=True))
    at = np.arange(len(order))
    for axis, budget in zip(axes, budgets, strict=True):
        rms = {cost.source: 100.0 * cost.rms.value for cost in budget.costs}
        axis.barh(at, [rms.get(source, 0.0) for source in order], color="C0", height=0.7)
        axis.axvline(100.0 * budget.together, color="C3", linestyle="--", linewidth=1.0, label="all together")
        axis.set_title(f"joint {budget.joint}", fontsize=10)
        axis.set_xlabel("rms error [%]")
    axes[0].set_yticks(at, order)
    axes[-1].legend(loc="lower center", fontsize=8, frameon=False)
    return figure
