"""The page of an error budget: which source to reduce first, errors from each source by joint, ranking."""

import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from scenarios.experiments.budget import BudgetJoint, ranking, study_budget
from scenarios.experiments.study_folder import read_study
from scenarios.rendering.content import Figure, Heading, Report
from scenarios.rendering.plot import MANY, TONES, Axis, Mark, Plot, Reference, Series, Tone, values
from scenarios.reports.sensitivity import sensitivity_report
from scenarios.results import provenance

OTHERS = "All others"
LARGEST = 10
"""Number of sources in a plot."""


def page(folder: Path) -> Report:
    """Return the page of a folder.

    Raises:
        ScenarioError: If it holds no study, or one of another version; if trials are missing.
        StudyError: If no trial gave the gain of a joint that should have one; if a part is damaged.
    """
    study = read_study(folder)
    tolerance = study.scenario.table.tolerance.gain
    budget = study_budget(study.scenario, study.trials, study.rows, study.seed)
    told = sensitivity_report(budget, study.scenario)
    verdict, *rest = (part for part in told.parts if not isinstance(part, Figure))
    found, order = budget.joints, ranking(budget.joints)
    about = {"Seed": str(study.seed), "Versions": provenance.versions_in_words(study.versions)}
    origin = provenance.repeated({"Original command": study.command}, about, {})
    costs = [cost_plot(each, order[:LARGEST], 100.0 * tolerance[each.joint - 1]) for each in found]
    parts = (verdict, share_plot(found, order), Heading("Source by source"), *costs, *rest, *origin)
    return Report(told.title, parts, told.document)


def share_plot(found: Sequence[BudgetJoint], order: Sequence[str]) -> Plot:
    """Return the plot of shares of each joint's sum of mean squares: its largest source, other large ones, the rest."""
    names = tuple(str(budget.joint) for budget in found)
    named = [source for source in order if any(each.costs and each.costs[0].source == source for each in found)]
    largest = [*named, *(source for source in order if source not in named)][: max(len(TONES), len(named))]
    shares = [{cost.source: 100.0 * cost.share for cost in budget.costs} for budget in found]
    series, low = list[Series](), np.zeros(len(found))
    for source, tone in zip(
        [*largest, OTHERS], [*itertools.islice(itertools.cycle(MANY), len(largest)), Tone.QUIET], strict=True
    ):
        rest = 100.0 - low
        own = rest if source == OTHERS else np.array([each.get(source, 0.0) for each in shares])
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
