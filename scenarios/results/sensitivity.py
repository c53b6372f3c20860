"""The result of a sensitivity study: ranked sources of each joint's error, and which to reduce first."""

import itertools
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from pydantic import Field

from scenarios.experiments.schema import Scenario
from scenarios.experiments.statistics import BudgetJoint, Interval, ranking, study_budget
from scenarios.experiments.study_folder import StudyFolder, read_study
from scenarios.rendering import Page, renderer
from scenarios.rendering.content import Heading, Paragraph, Part, Report, column, percent, table
from scenarios.rendering.plot import MANY, TONES, Axis, Mark, Plot, Reference, Series, Tone, values
from scenarios.rendering.result import ResultModel
from scenarios.results import provenance
from scenarios.results.gains import budget_verdict

BUDGET, TEXT, CHART = "budget.parquet", "budget.md", "budget.png"
SHOWN = 6
"""Number of sources per joint on a screen; files have all."""
DRAWN = 10
"""Number of sources in a plot."""
OTHERS = "All others"
WIDEST = 0.5
"""Width of an index's interval above which the index is withheld: half of its range."""
DPI = 110
MEANING = (
    "Alone: the source at its declared size, all others off. Share: of the sum of mean squares. First and total "
    "order: Sobol indices of the error's variance with all sources on, with 95 % bootstrap intervals; withheld where "
    "trials are too few for an interval narrower than 0.5."
)


class Budget(ResultModel):
    """What `rx90 sensitivity --json` prints."""

    scenario: str = Field(description="Name of the scenario")
    trials: int = Field(description="Number of trials")
    joints: list[BudgetJoint] = Field(description="Joints that should have a gain")
    tolerance: list[float] = Field(description="Largest relative error that passes, of each of these joints")

    @classmethod
    def of(cls, scenario: Scenario, trials: int, folder: StudyFolder, seed: int) -> "Budget":
        """Compute the budget of a sensitivity study.

        Raises:
            StudyError: If no trial gave the gain of a joint that should have one; if a part is damaged.
        """
        joints = list(study_budget(scenario, folder, seed))
        tolerance = [scenario.table.tolerance.gain[each.joint - 1] for each in joints]
        return cls(scenario=scenario.name, trials=trials, joints=joints, tolerance=tolerance)

    def title(self, sources: int) -> str:
        """Return the title of a report."""
        return f"Error budget of scenario {self.scenario}: {self.trials} trials, {sources} error sources"

    def parts(self) -> Iterable[Part]:
        """Errors with all sources on and the source to reduce first, then each joint's sources, the largest first."""
        limits = list(zip(self.joints, self.tolerance, strict=True))
        yield budget_verdict(
            [(each.joint, each.together, limit, each.costs[0].source if each.costs else None) for each, limit in limits]
        )
        order = ranking(self.joints)
        yield share_plot(self.joints, order)
        for budget, limit in limits:
            floor = "refused" if budget.floor is None else f"{100.0 * budget.floor:+.3f} %"
            lost = f"; {budget.lost} trials gave no gain" if budget.lost else ""
            yield Heading(f"Joint {budget.joint}")
            yield Paragraph(
                f"All together {percent(budget.together)} % rms "
                f"(sum of the single sources: {100.0 * budget.summed:.3f} %, none: {floor}; "
                f"Sobol indices from {budget.samples} rows){lost}."
            )
            hidden = budget.costs[SHOWN:]
            yield table(
                budget.costs,
                column("Source", lambda cost: cost.source, words=True),
                column("Alone [% rms]", lambda cost: percent(cost.rms.value)),
                column("95 % interval [%]", lambda cost: f"{percent(cost.rms.low)}..{percent(cost.rms.high)}"),
                column("Bias [%]", lambda cost: percent(cost.bias, "+.3f")),
                column("Share [%]", lambda cost: percent(cost.share, ".1f")),
                column("First order", lambda cost: _index(cost.first)),
                column("Total order", lambda cost: _index(cost.total)),
                shown=SHOWN,
                rest=f"and {len(hidden)} more with {100.0 * sum(cost.share for cost in hidden):.2g} % together",
            )
            if budget.silent:
                silent = ", ".join(budget.silent)
                text = f"Effect unknown, as no trial with one of these sources alone gave a gain: {silent}."
                yield Paragraph(text, strong=True)
            if budget.costs:
                yield cost_plot(budget, order[:DRAWN], 100.0 * limit)
        yield Paragraph(MEANING)


def _index(index: Interval | None) -> str | None:
    if index is None or index.high - index.low >= WIDEST:
        return None
    return f"{index.value:.2f} ({index.low:.2f}..{index.high:.2f})"


def page(folder: Path) -> Report:
    """Return the page of a folder.

    Raises:
        ScenarioError: If it holds no study, or one of another version; if trials are missing.
        StudyError: If no trial gave the gain of a joint that should have one; if a part is damaged.
    """
    study = read_study(folder)
    result = Budget.of(study.scenario, study.trials, study.rows, study.seed)
    about = {"Seed": str(study.seed), "Versions": provenance.versions_in_words(study.versions)}
    origin = provenance.repeated({"Original command": study.command}, about, {})
    return result.report(result.title(len(study.scenario.table.sources)), *origin)


def write_files(result: Budget, report: Report, folder: Path) -> list[Path]:
    """Write `budget.parquet`, one row per joint and source, and the report as text and chart.

    Raises:
        OSError: If a file cannot be written.
    """
    from scenarios.rendering.drawing import figure  # Matplotlib, which no other use of the result needs

    rows: list[dict[str, object]] = []
    for cost in (cost for budget in result.joints for cost in budget.costs):
        row: dict[str, object] = {name: getattr(cost, name) for name in ("joint", "source", "trials", "bias", "share")}
        for name in ("rms", "first", "total"):
            of: Interval | None = getattr(cost, name)
            row |= {name: of and of.value, f"{name}_low": of and of.low, f"{name}_high": of and of.high}
        rows.append(row)
    pd.DataFrame(rows).to_parquet(folder / BUDGET, index=False)
    text = renderer("markdown")(report, Page())
    (folder / TEXT).write_text(text, encoding="utf-8", errors="backslashreplace")
    order, limits = ranking(result.joints), zip(result.joints, result.tolerance, strict=True)
    plots = [cost_plot(budget, order, 100.0 * limit) for budget, limit in limits if budget.costs]
    title = f"{result.scenario}: error of the gain from each source alone"
    figure(plots, across=3, title=title).savefig(folder / CHART, dpi=DPI)
    return [folder / BUDGET, folder / TEXT, folder / CHART]


def share_plot(found: Sequence[BudgetJoint], order: Sequence[str]) -> Plot:
    """Return the plot of shares of each joint's sum of mean squares: its largest source, other large ones, the rest."""
    names = tuple(str(budget.joint) for budget in found)
    named = [source for source in order if any(each.costs and each.costs[0].source == source for each in found)]
    largest = [*named, *(source for source in order if source not in named)][: max(len(TONES), len(named))]
    shares = [{cost.source: 100.0 * cost.share for cost in budget.costs} for budget in found]
    tones = [*itertools.islice(itertools.cycle(MANY), len(largest)), Tone.QUIET]
    series, low = list[Series](), np.zeros(len(found))
    for source, tone in zip([*largest, OTHERS], tones, strict=True):
        own = 100.0 - low if source == OTHERS else np.array([each.get(source, 0.0) for each in shares])
        ends = {"y": values(own), "low": values(low), "high": values(low + own)}
        series.append(Series(label=source, mark=Mark.STACK, tone=tone, x=names, **ends))
        low = low + own
    return Plot(
        title="Contribution of each source to each joint's error",
        caption=(
            "Mean square error from each source alone at its declared size, as a share of the sum over all sources."
        ),
        x=Axis(title="joint", categories=names),
        y=Axis(title="share", unit="%", zero=True),
        series=tuple(series),
    )


def cost_plot(budget: BudgetJoint, order: Sequence[str], tolerance: float) -> Plot:
    """Return the plot of one joint's rms error from each of the largest sources alone, with intervals."""
    costs = {cost.source: cost.rms for cost in budget.costs}
    there = [source for source in order if source in costs]
    largest = max(100.0 * cost.value for cost in costs.values())
    limit = (Reference("", tolerance, upright=True),) if tolerance <= 2.0 * largest else ()
    beyond = " Dashed: the tolerance." if limit else f" The tolerance, {tolerance:.3g} %, is outside the plot."
    return Plot(
        title=f"Joint {budget.joint}",
        caption=f"The {len(there)} largest of {len(costs)} sources, ranked over all joints; 95 % bootstrap "
        f"intervals.{beyond}",
        x=Axis(title="rms error from the source alone", unit="%", zero=True),
        y=Axis(title="", categories=tuple(order)),
        series=(
            Series(
                label="",
                mark=Mark.BARS,
                x=values([100.0 * costs[source].value for source in there]),
                y=tuple(there),
                low=values([100.0 * costs[source].low for source in there]),
                high=values([100.0 * costs[source].high for source in there]),
            ),
        ),
        references=limit,
    )
