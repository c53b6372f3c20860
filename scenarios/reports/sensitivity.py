"""Report of an error budget: ranked sources of each joint's error, and which to reduce first."""

from collections.abc import Sequence

from scenarios.experiments.budget import Budget, BudgetJoint, Interval
from scenarios.experiments.schema import Scenario
from scenarios.rendering.content import Figure, Heading, Paragraph, Part, Report, Table, column, percent, table
from scenarios.reports.plots.sensitivity import chart
from scenarios.results.gains import budget_verdict

SHOWN = 6
"""Number of sources per joint on a screen; files have all."""
CHART = "budget"
WIDEST = 0.5
"""Width of an index's interval above which the index is withheld: half of its range."""
MEANING = (
    "Alone: the source at its declared size, all others off. Share: of the sum of mean squares. First and total "
    "order: Sobol indices of the error's variance with all sources on, with 95 % bootstrap intervals; withheld where "
    "trials are too few for an interval narrower than 0.5."
)


def sensitivity_report(found: Budget, scenario: Scenario) -> Report:
    """Return the report: dominant source, and each joint's sources, the largest first."""
    parts: list[Part] = [verdict(found.joints, scenario.table.tolerance.gain)]
    for budget in found.joints:
        parts += [Heading(f"Joint {budget.joint}"), Paragraph(f"{_headline(budget)}."), _table(budget)]
        parts += [Paragraph(_silent(budget.silent), strong=True)] * bool(budget.silent)
    parts += [Paragraph(MEANING)]
    parts.append(Figure(CHART, "Error of the gain from each source alone", lambda: chart(found, scenario)))
    title = (
        f"Error budget of scenario {scenario.name}: {found.trials} trials, {len(scenario.table.sources)} error sources"
    )
    return Report(title, tuple(parts), found.model_dump(mode="json"))


def verdict(budgets: Sequence[BudgetJoint], tolerances: Sequence[float]) -> Paragraph:
    """Return a sentence on errors with all sources on, and on the source to reduce first."""
    return budget_verdict(
        [
            (each.joint, each.together, tolerances[each.joint - 1], each.costs[0].source if each.costs else None)
            for each in budgets
        ]
    )


def _silent(names: Sequence[str]) -> str:
    return f"Effect unknown, as no trial with one of these sources alone gave a gain: {', '.join(names)}."


def _headline(budget: BudgetJoint) -> str:
    floor = "refused" if budget.floor is None else f"{100.0 * budget.floor:+.3f} %"
    lost = f"; {budget.lost} trials gave no gain" if budget.lost else ""
    return (
        f"All together {percent(budget.together)} % rms "
        f"(sum of the single sources: {100.0 * budget.summed:.3f} %, none: {floor}; "
        f"Sobol indices from {budget.samples} rows){lost}"
    )


def _table(budget: BudgetJoint) -> Table:
    hidden = budget.costs[SHOWN:]
    rest = f"and {len(hidden)} more with {100.0 * sum(cost.share for cost in hidden):.2g} % together"
    return table(
        budget.costs,
        column("Source", lambda cost: cost.source, words=True),
        column("Alone [% rms]", lambda cost: percent(cost.rms.value)),
        column("95 % interval [%]", lambda cost: f"{percent(cost.rms.low)}..{percent(cost.rms.high)}"),
        column("Bias [%]", lambda cost: percent(cost.bias, "+.3f")),
        column("Share [%]", lambda cost: percent(cost.share, ".1f")),
        column("First order", lambda cost: _index(cost.first)),
        column("Total order", lambda cost: _index(cost.total)),
        shown=SHOWN,
        rest=rest,
    )


def _index(index: Interval | None) -> str | None:
    if index is None or index.high - index.low >= WIDEST:
        return None
    return f"{index.value:.2f} ({index.low:.2f}..{index.high:.2f})"
