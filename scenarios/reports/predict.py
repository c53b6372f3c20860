"""What a predicted error budget says: each source's cost on each joint, all together, and the tolerances."""

from ident.diagnosis.diagnosis import Diagnosed
from scenarios.prediction.budget import PredictedBudget
from scenarios.reports.content import Cell, Column, Mood, Paragraph, Part, Report, Table, cells, percent
from scenarios.reports.diagnoses import horizon_paragraphs

MEANING = (
    "First-order rms relative error from each source alone, at its declared size. All together: sums of "
    "biases (signed) and of variances. Within: share of runs within tolerance, for normal errors."
)
CONTROL = "Assumes perfect control, independent sources and additive effects; nothing was simulated."


def prediction_report(budget: PredictedBudget, found: Diagnosed) -> Report:
    """The predicted budget of a scenario, and what is found of the logs that its motions will give."""
    sources = len(budget.joints[0].costs) if budget.joints else 0
    title = f"Predicted error budget of scenario {budget.scenario}, method {budget.method}: {sources} sources"
    parts: list[Part] = [_table(budget), Paragraph(MEANING), Paragraph(CONTROL)]
    parts += [Paragraph(f"Assumed without an error source: {'; '.join(budget.remarks)}.")] * bool(budget.remarks)
    parts += [Paragraph(f"Joint {each['joint']}: no gain: {each['reason']}.", Mood.DOUBTFUL) for each in budget.refused]
    parts += [
        Paragraph(f"Not predicted: {each['source']}: {each['reason']}.", Mood.DOUBTFUL) for each in budget.unpredicted
    ]
    parts += horizon_paragraphs(found, every=True, expected=True)
    return Report(title, tuple(parts), budget.model_dump(mode="json"))


def _table(budget: PredictedBudget) -> Table:
    joints = budget.joints
    columns = (
        Column(title="Source", words=True),
        *(Column(title=f"joint {each.joint}", unit="%") for each in joints),
    )
    costs = zip(*(each.costs for each in joints), strict=True)
    rows = [cells(of_joints[0].source, *(percent(each.rms, ".3f") for each in of_joints)) for of_joints in costs]
    rows += [
        cells("all together", *(percent(each.together.rms, ".3f") for each in joints)),
        cells("  of which bias", *(percent(each.together.bias, "+.3f") for each in joints)),
        cells("tolerance", *(percent(each.tolerance, ".3g") for each in joints)),
        cells("within", *(_within(each.within) for each in joints)),
    ]
    return Table(columns=columns, rows=tuple(rows))


def _within(share: float) -> Cell:
    return Cell(percent(share, ".0f"), Mood.GOOD if share > 0.95 else Mood.BAD if share < 0.5 else Mood.DOUBTFUL)
