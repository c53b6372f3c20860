"""What an error budget says: the sources of each joint's error ranked, and what to buy down first."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass

from scenarios.experiments.files.schema import Scenario
from scenarios.experiments.studies.budget import Interval, JointBudget
from scenarios.reports.content import Cell, Column, Figure, Heading, Paragraph, Part, Report, Table, cells, percent
from scenarios.reports.plots.sensitivity import chart

SHOWN = 6
"""Sources a joint that a screen shows; files have all."""
CHART = "budget"
COLUMNS = (
    Column(title="Source", words=True),
    Column(title="Alone", unit="% rms"),
    Column(title="95 % interval", unit="%"),
    Column(title="Bias", unit="%"),
    Column(title="Share", unit="%"),
    Column(title="First order"),
    Column(title="Total order"),
)
MEANING = (
    "Alone: the source at its declared size with all others off. Share: of the sum of mean squares. First and total "
    "order: Sobol indices of the error's variance with all sources on, with 95 % bootstrap intervals."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class BudgetResult:
    """What is reported of a sensitivity study.

    Attributes:
        scenario: That was varied.
        trials: Carried out.
        budgets: One a joint that should have a gain.
    """

    scenario: Scenario
    trials: int
    budgets: tuple[JointBudget, ...]


def sensitivity_report(result: BudgetResult) -> Report:
    """Each joint's sources, the largest first, and the source that dominates."""
    scenario, budgets = result.scenario, result.budgets
    parts: list[Part] = []
    for budget in budgets:
        parts += [Heading(f"Joint {budget.joint}"), Paragraph(f"{_headline(budget)}."), _table(budget)]
        parts += [Paragraph(_silent(names), strong=True) for names in [silent_sources(budget, scenario)] if names]
    parts += [Paragraph(MEANING), Paragraph(first_to_buy_down(budgets), strong=True)]
    parts.append(Figure(CHART, "Error of the gain from each source alone", lambda: chart(budgets, scenario)))
    title = (
        f"Error budget of scenario {scenario.name}: {result.trials} trials, {len(scenario.table.sources)} error sources"
    )
    document: dict[str, object] = {
        "scenario": scenario.name,
        "trials": result.trials,
        "joints": [
            {
                **asdict(budget),
                "together": _together(budget),
                "summed": budget.summed,
                "silent": silent_sources(budget, scenario),
            }
            for budget in budgets
        ],
    }
    return Report(title, tuple(parts), document)


def first_to_buy_down(budgets: Sequence[JointBudget]) -> str:
    """One sentence: which source dominates which joints."""
    by_source: dict[str, list[str]] = {}
    for budget in budgets:
        if budget.costs:
            by_source.setdefault(budget.costs[0].source, []).append(str(budget.joint))
    parts = [f"{source} (joint {', '.join(joints)})" for source, joints in by_source.items()]
    return f"Reduce first: {'; '.join(parts)}." if parts else "No source gave a gain."


def silent_sources(budget: JointBudget, scenario: Scenario) -> list[str]:
    """Sources none of whose own trials gave the joint a gain, so that no table has them."""
    told = {cost.source for cost in budget.costs}
    return [name for name in scenario.table.sources if name not in told]


def _silent(names: Sequence[str]) -> str:
    return f"No trial gave a gain with one of these alone, so their effect is unknown: {', '.join(names)}."


def _together(budget: JointBudget) -> float | None:
    """Rms error with all sources on, None where no such trial gave a gain."""
    return None if math.isnan(budget.together) else budget.together


def _headline(budget: JointBudget) -> str:
    floor = "refused" if budget.floor is None else f"{100.0 * budget.floor:+.3f} %"
    lost = f"; {budget.lost} trials gave no gain" if budget.lost else ""
    return (
        f"All together {percent(_together(budget))} % rms "
        f"(added up one by one: {100.0 * budget.summed:.3f} %, none: {floor}; "
        f"Sobol indices from {budget.samples} rows){lost}"
    )


def _table(budget: JointBudget) -> Table:
    hidden = budget.costs[SHOWN:]
    rest = f"and {len(hidden)} more with {100.0 * sum(cost.share for cost in hidden):.2g} % together"
    rows = tuple(
        cells(
            cost.source,
            percent(cost.rms.value),
            f"{percent(cost.rms.low)}..{percent(cost.rms.high)}",
            percent(cost.bias, "+.3f"),
            percent(cost.share, ".1f"),
            _index(cost.first),
            _index(cost.total),
        )
        for cost in budget.costs
    )
    return Table(columns=COLUMNS, rows=rows, shown=SHOWN, rest=rest)


def _index(index: Interval | None) -> Cell:
    return Cell("-" if index is None else f"{index.value:.2f} ({index.low:.2f}..{index.high:.2f})")
