"""What a predicted error budget says: each source's cost on each joint, all together, and the tolerances."""

from ident.support.arrays import Array
from scenarios.prediction.budget import PredictedBudget
from scenarios.prediction.result import predicted_budget_result
from scenarios.reports.content import Cell, Column, Mood, Paragraph, Part, Report, Table, cells, percent
from scenarios.reports.diagnoses import horizon_paragraphs

MEANING = (
    "First-order rms relative error from each source alone, at its declared size. All together: sums of "
    "biases (signed) and of variances. Within: share of runs within tolerance, for normal errors."
)
CONTROL = "Assumes perfect control, independent sources and additive effects; nothing was simulated."


def prediction_report(budget: PredictedBudget) -> Report:
    """The predicted budget of a scenario."""
    numbers = [f"joint {joint + 1}" for joint in budget.joints.tolist()]
    title = f"Predicted error budget of scenario {budget.scenario}, method {budget.method}: {len(budget.costs)} sources"
    parts: list[Part] = [_table(budget, numbers), Paragraph(MEANING), Paragraph(CONTROL)]
    parts += [Paragraph(f"Assumed without an error source: {'; '.join(budget.remarks)}.")] * bool(budget.remarks)
    parts += [Paragraph(f"Joint {j + 1}: no gain: {why}.", Mood.DOUBTFUL) for j, why in budget.refused.items()]
    parts += [Paragraph(f"Not predicted: {each.source}: {each.reason}.", Mood.DOUBTFUL) for each in budget.unpredicted]
    parts += horizon_paragraphs(budget.horizon, every=True, expected=True)
    return Report(title, tuple(parts), predicted_budget_result(budget).model_dump(mode="json"))


def _table(budget: PredictedBudget, numbers: list[str]) -> Table:
    columns = (Column(title="Source", words=True), *(Column(title=number, unit="%") for number in numbers))
    both = budget.together
    rows = [cells(cost.source, *_percents(cost.rms)) for cost in budget.costs]
    rows += [
        cells("all together", *_percents(both.rms)),
        cells("  of which bias", *_percents(both.bias, "+.3f")),
        cells("tolerance", *_percents(budget.tolerance, ".3g")),
        cells("within", *(_within(share) for share in budget.within.tolist())),
    ]
    return Table(columns=columns, rows=tuple(rows))


def _percents(shares: Array, form: str = ".3f") -> list[str]:
    return [percent(share, form) for share in shares.tolist()]


def _within(share: float) -> Cell:
    return Cell(percent(share, ".0f"), Mood.GOOD if share > 0.95 else Mood.BAD if share < 0.5 else Mood.DOUBTFUL)
