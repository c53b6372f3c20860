"""Error budget of a sensitivity study: each joint's error from each source alone, and its share of the variance."""

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from pydantic import Field
from scipy import stats

from ident.diagnosis.diagnosis import two_digits
from ident.support.arrays import Array, Indices
from scenarios.experiments.schema import Scenario
from scenarios.experiments.study import ALL, ALONE, NONE, SOBOL
from scenarios.experiments.study_folder import StudyFolder, read_study
from scenarios.rendering.content import Heading, Paragraph, Part, Report, column, table
from scenarios.rendering.plot import COLOURS, LIMIT, Plot
from scenarios.rendering.result import ResultModel
from scenarios.rendering.wording import many, percent, percent_range
from scenarios.results.gains import budget_verdict
from scenarios.results.record import repeated
from scenarios.support.errors import ScenarioError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHOWN, DRAWN = 6, 10
"""Number of sources per joint on a screen (files have all), and in a plot."""
WIDEST = 0.5
"""Width of an index's interval above which the index is withheld: half of its range."""
SOURCES = (
    "Alone: the source at its declared size, all others off. Share: of the sum of mean squares. First and total "
    "order: Sobol indices of the error's variance with all sources on, with 95 % bootstrap intervals; withheld where "
    "trials are too few for an interval narrower than 0.5."
)
NEEDED = ("trial", "joint", "design", "source", "sample", "rel_error")
"""Columns of a sensitivity study that the budget uses."""
TAILS = (2.5, 97.5)
"""Percentiles of the bootstrap at the ends of an interval."""
RESAMPLES = 1000


class Interval(ResultModel):
    """A value and its 95 % bootstrap interval."""

    value: float  # A share of the gain, or of the variance of its error
    low: float  # lower end of the interval, relative as the value
    high: float  # upper end of the interval, relative as the value

    @classmethod
    def of(cls, value: Array, ends: Array) -> list["Interval"]:
        """Return intervals of values, shape (d,), with their ends, shape (2, d)."""
        return [cls(value=v, low=x, high=y) for v, x, y in np.column_stack((value, *ends)).tolist()]


class SourceCost(ResultModel):
    """Error of one joint's gain from one source."""

    source: str  # name of the source
    trials: int  # trials of the source alone that gave a gain
    bias: float  # mean relative error from the source alone, including that of the method without sources
    rms: Interval  # root mean square of the relative error from the source alone
    share: float  # the source's share of the sum of all sources' mean squares
    first: Interval | None = Field(
        description="First-order Sobol index: share of the error's variance that vanishes if the source is known; null "
        "if the design has too few complete samples"
    )
    total: Interval | None  # total-order index: share of it that remains if all others are known


class BudgetJoint(ResultModel):
    """Relative errors of one joint's gain."""

    joint: int  # number of the joint, from 1
    tolerance: float  # largest relative error that passes
    costs: list[SourceCost]  # one entry per source with which, alone, the joint has a gain, the largest error first
    floor: float | None  # relative error with every source off, null where the joint was refused
    together: float | None  # root mean square of the relative error with all sources on, null without such a gain
    samples: int  # number of rows of the Sobol design from which the indices are computed
    lost: int  # number of trials without a gain for the joint
    summed: float  # relative error expected for `together` if the sources are independent and their effects add up
    silent: list[str]  # sources with which, alone, the joint never has a gain


def joint_budget(rows: pd.DataFrame, joint: int, tolerance: float, sources: Sequence[str], seed: int) -> BudgetJoint:
    """Return the budget of a joint. `rows` has one row per trial and joint, with the columns `NEEDED`."""
    rows = rows.query("joint == @joint")
    by_source = rows.query(f"design == {ALONE!r}").groupby("source")
    alone = {name: group["rel_error"].dropna().to_numpy() for name, group in by_source}
    squares = {name: float(np.mean(alone[name] ** 2)) for name in sources if len(alone.get(name, ())) > 0}
    # The estimator of Sobol indices needs a power of 2 of complete rows: the largest one available.
    design = rows.query(f"design == {SOBOL!r}")
    design = design.assign(sample=design["sample"].astype(int)).pivot_table(
        index="sample", columns="source", values="rel_error", dropna=False
    )
    whole = design.reindex(columns=["A", "B", *sources]).dropna().to_numpy()
    n = 2 ** int(np.log2(len(whole))) if len(whole) else 0
    indices = sobol_indices(whole[:n, 0], whole[:n, 1], whole[:n, 2:].T, seed) if n >= 4 else ([], [])
    first, total = (dict(zip(sources, order, strict=False)) for order in indices)
    costs = [
        SourceCost(
            source=name,
            trials=len(alone[name]),
            bias=float(np.mean(alone[name])),
            rms=_rms(alone[name], seed),
            share=square / max(sum(squares.values()), 1e-300),
            first=first.get(name),
            total=total.get(name),
        )
        for name, square in squares.items()
    ]
    none, together = alone.get(NONE, np.empty(0)), alone.get(ALL, np.empty(0))
    floor = float(none[0]) if len(none) else None
    # Signed biases beyond that of the method, and variances, of independent sources add up.
    bias = (floor or 0.0) + sum(cost.bias - (floor or 0.0) for cost in costs)
    variance = sum(cost.rms.value**2 - cost.bias**2 for cost in costs)
    return BudgetJoint(
        joint=joint,
        tolerance=tolerance,
        costs=sorted(costs, key=lambda cost: -cost.rms.value),
        floor=floor,
        together=float(np.sqrt(np.mean(together**2))) if len(together) else None,
        samples=n,
        lost=int(np.count_nonzero(rows["rel_error"].isna())),
        summed=float(np.sqrt(variance + bias**2)),
        silent=[name for name in sources if name not in squares],
    )


def ranking(found: Sequence[BudgetJoint]) -> list[str]:
    """Return sources sorted by their share, summed over the joints, the largest first."""
    total = Counter[str]()
    for cost in (cost for budget in found for cost in budget.costs):
        total[cost.source] += cost.share  # pyright: ignore[reportArgumentType]  (a counter adds any numbers)
    return [source for source, _ in total.most_common()]


def sobol_indices(A: Array, B: Array, AB: Array, seed: int) -> tuple[list[Interval], list[Interval]]:
    """Return first- and total-order indices of one output; the seed is that of the bootstrap.

    The output is known on matrices A and B, both (n,), n a power of 2, and on A with the columns of source k from B,
    (d, n).
    """

    def indices(k: Indices) -> Array:  # (2, d)
        of = stats.sobol_indices(func={"f_A": A[k][None], "f_B": B[k][None], "f_AB": AB[:, k][:, None]}, n=len(A))
        return np.array([of.first_order.ravel(), of.total_order.ravel()])

    resampled = np.array([indices(k) for k in _resampled(len(A), seed)])
    found, ends = indices(np.arange(len(A))), np.percentile(resampled, TAILS, axis=0)
    first, total = (Interval.of(found[order], ends[:, order]) for order in (0, 1))
    return first, total


def _rms(error: Array, seed: int) -> Interval:
    samples = error[_resampled(len(error), seed)] if len(error) > 1 and np.ptp(error) > 0.0 else error[None]
    low, high = np.percentile(np.sqrt(np.mean(samples**2, axis=1)), TAILS).tolist()
    return Interval(value=float(np.sqrt(np.mean(error**2))), low=low, high=high)


def _resampled(n: int, seed: int) -> Indices:
    """Return the indices of each bootstrap resample, shape (RESAMPLES, n)."""
    return np.random.default_rng(seed).integers(n, size=(RESAMPLES, n))


class Budget(ResultModel):
    """What `rx90 sensitivity --json` prints."""

    scenario: str  # name of the scenario
    trials: int  # number of trials
    joints: list[BudgetJoint]  # joints that should have a gain

    @classmethod
    def of(cls, scenario: Scenario, trials: int, folder: StudyFolder, seed: int) -> "Budget":
        """Compute the budget of a sensitivity study."""
        limits, rows = scenario.table.tolerance, folder.table(NEEDED)
        sources = list(scenario.table.sources)
        joints = [
            joint_budget(rows, joint, tolerance, sources, seed)
            for joint, (tolerance, wanted) in enumerate(zip(limits.gain, limits.identifiable, strict=True), 1)
            if wanted
        ]
        if silent := ", ".join(str(each.joint) for each in joints if not each.costs):
            raise ScenarioError(
                f"{folder.path}: no trial gave a gain of joint {silent}; see column `reason` of the rows"
            )
        return cls(scenario=scenario.name, trials=trials, joints=joints)

    def title(self, sources: int) -> str:
        """Return the title of a report."""
        return f"Error budget of scenario {self.scenario}: {self.trials} trials, {sources} error sources"

    def parts(self) -> Iterable[Part]:
        """Errors with all sources on and the source to reduce first, then each joint's sources, the largest first."""
        order = ranking(self.joints)[:DRAWN]
        yield budget_verdict(
            [(x.joint, x.together, x.tolerance, x.costs[0].source if x.costs else None) for x in self.joints]
        )
        for budget in self.joints:
            floor = "refused" if budget.floor is None else f"{100.0 * budget.floor:+.3f} %"
            lost = f"; {many(budget.lost, 'trial')} gave no gain" if budget.lost else ""
            parts = f"sum of the single sources: {100.0 * budget.summed:.3f} %, none: {floor}; Sobol indices from "
            yield Heading(f"Joint {budget.joint}")
            yield Paragraph(f"All together {percent(budget.together)} % rms ({parts}{budget.samples} rows){lost}.")
            hidden = budget.costs[SHOWN:]
            yield table(
                budget.costs,
                column("Source", lambda cost: cost.source, words=True),
                column("Alone [% rms]", lambda cost: percent(cost.rms.value)),
                column("95 % interval [%]", lambda cost: percent_range(cost.rms.low, cost.rms.high)),
                column("Bias [%]", lambda cost: percent(cost.bias, "+.3f")),
                column("Share [%]", lambda cost: percent(cost.share, ".1f")),
                column("First order", lambda cost: _index(cost.first)),
                column("Total order", lambda cost: _index(cost.total)),
                shown=SHOWN,
                rest=f"and {len(hidden)} more with {two_digits(100.0 * sum(cost.share for cost in hidden))} % together",
            )
            if silent := ", ".join(budget.silent):
                text = f"Effect unknown, as no trial with one of these sources alone gave a gain: {silent}."
                yield Paragraph(text, strong=True)
            if budget.costs:
                yield cost_plot(budget, order)
        yield Paragraph(SOURCES)


def _index(index: Interval | None) -> str | None:
    if index is None or index.high - index.low >= WIDEST:
        return None
    return f"{index.value:.2f} ({index.low:.2f}..{index.high:.2f})"


def sensitivity_page(folder: Path) -> Report:
    """Return the page of a folder."""
    study = read_study(folder)
    result = Budget.of(study.scenario, study.trials, study.rows, study.seed)
    origin = repeated({"Original command": study.command}, {"Seed": str(study.seed)}, study.versions)
    return result.report(result.title(len(study.scenario.table.sources)), *origin)


def cost_plot(budget: BudgetJoint, order: Sequence[str]) -> Plot:
    """Return the plot of one joint's rms error from each of the largest sources alone (`order`), with intervals."""
    tolerance, costs = 100.0 * budget.tolerance, {cost.source: cost.rms for cost in budget.costs}
    there = [source for source in order if source in costs]
    inside = tolerance <= 200.0 * max(cost.value for cost in costs.values())
    beyond = "Dashed: the tolerance." if inside else f"The tolerance, {tolerance:.3g} %, is outside the plot."

    def draw(axes: "Axes") -> None:
        at, ends = [order.index(source) for source in there], [costs[source] for source in there]
        value, low, high = 100.0 * np.array([(each.value, each.low, each.high) for each in ends]).T
        axes.barh(at, value, 0.75, edgecolor=COLOURS["ink"], lw=0.5)
        axes.hlines(at, low, high, COLOURS["ink"])
        axes.set_yticks(range(len(order)), order)
        axes.set_ylim(len(order) - 0.4, -0.6)  # the first at the top
        axes.grid(visible=False, axis="y")
        if inside:
            axes.axvline(tolerance, **LIMIT)

    ranked = f"The {len(there)} largest of {len(costs)} sources, ranked over all joints; 95 % bootstrap intervals."
    title, x = f"Joint {budget.joint}", "Rms error from the source alone [%]"
    return Plot(title=title, caption=f"{ranked} {beyond}", x=x, y="", draw=draw)
