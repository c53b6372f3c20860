"""Report of a predicted error budget: verdict, all sources together with tolerances, error from each source."""

from collections.abc import Iterator, Sequence

from ident.diagnosis.diagnosis import Diagnosed
from scenarios.prediction.budget import Cost, PredictedBudget
from scenarios.rendering.content import Cell, Column, Mood, Paragraph, Part, Report, Table, cells, percent
from scenarios.results.diagnoses import horizon_paragraphs
from scenarios.results.gains import budget_verdict

MEANING = (
    "First-order rms relative error from each source alone, at its declared size. All together: sums of "
    "biases (signed) and of variances. Within: share of runs within tolerance, for normal errors."
)
LEAST = 5e-6
"""Relative error of a source below which it is reported as 0."""
CONTROL = "Assumes perfect control, independent sources and additive effects; nothing was simulated."


def prediction_report(budget: PredictedBudget, found: Diagnosed) -> Report:
    """Return the predicted budget of a scenario, and the faults that logs of its motions will exclude."""
    sources = len(budget.joints[0].costs) if budget.joints else 0
    title = f"Predicted error budget of scenario {budget.scenario}, method {budget.method}: {sources} sources"
    parts: list[Part] = [_verdict(budget), _table(budget), *_nothing(budget), Paragraph(MEANING), Paragraph(CONTROL)]
    parts += [Paragraph(f"Assumed without an error source: {'; '.join(budget.remarks)}.")] * bool(budget.remarks)
    parts += [Paragraph(f"Joint {each['joint']}: no gain: {each['reason']}.", Mood.DOUBTFUL) for each in budget.refused]
    parts += [
        Paragraph(f"Not predicted: {each['source']}: {each['reason']}.", Mood.DOUBTFUL) for each in budget.unpredicted
    ]
    parts += horizon_paragraphs(found, every=True, expected=True)
    return Report(title, tuple(parts), budget.model_dump(mode="json"))


def _verdict(budget: PredictedBudget) -> Paragraph:
    joints = [
        (each.joint, each.together.rms, each.tolerance, max(each.costs, key=lambda cost: cost.rms).source)
        for each in budget.joints
    ]
    return budget_verdict(joints)


def _nothing(budget: PredictedBudget) -> list[Paragraph]:
    """Return a line of sources without effect, if there are any."""
    none = [of_joints[0].source for of_joints in _costs(budget) if not _costs_something(of_joints)]
    return [Paragraph(f"Below {100.0 * LEAST:g} % on every joint: {', '.join(none)}.")] if none else []


def _costs(budget: PredictedBudget) -> Iterator[tuple[Cost, ...]]:
    """Return the errors from each source by joint."""
    return zip(*(each.costs for each in budget.joints), strict=True)


def _costs_something(of_joints: Sequence[Cost]) -> bool:
    return any(each.rms >= LEAST for each in of_joints)


def _table(budget: PredictedBudget) -> Table:
    joints = budget.joints
    columns = (Column(title="Source", words=True), *(Column(title=f"Joint {each.joint}", unit="%") for each in joints))
    rows = [
        cells("all together", *(percent(each.together.rms, ".3f") for each in joints)),
        cells("  of which bias", *(percent(each.together.bias, "+.3f") for each in joints)),
        cells("tolerance", *(percent(each.tolerance, ".3g") for each in joints)),
        cells("within", *(_within(each.within) for each in joints)),
    ]
    rows += [
        cells(of_joints[0].source, *(percent(each.rms, ".3f") for each in of_joints))
        for of_joints in _costs(budget)
        if _costs_something(of_joints)
    ]
    return Table(columns=columns, rows=tuple(rows))


def _within(share: float) -> Cell:
    return Cell(percent(share, ".0f"), Mood.GOOD if share > 0.95 else Mood.BAD if share < 0.5 else Mood.DOUBTFUL)
