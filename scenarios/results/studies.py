"""Results of studies: errors, intervals and pass rates of Monte Carlo trials; sources of each joint's error, ranked."""

import shlex
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pyarrow as pa
from pydantic import Field
from scipy import stats

from ident.support.arrays import Array
from scenarios.experiments.schema import Scenario
from scenarios.experiments.statistics import (
    FALSE_ALARM,
    BudgetJoint,
    Coverage,
    Interval,
    JointRows,
    JointStatistics,
    StudyRows,
    coverage_of,
    joint_statistics,
    ranking,
    rows_in,
    study_budget,
)
from scenarios.experiments.study_folder import StudyFolder, read_study
from scenarios.rendering.content import (
    Cell,
    Heading,
    Line,
    Mood,
    Paragraph,
    Part,
    Report,
    column,
    joints_named,
    many,
    percent,
    table,
)
from scenarios.rendering.plot import COLOURS, LIMIT, Plot, draw_intervals
from scenarios.rendering.result import ResultModel
from scenarios.results.gains import budget_verdict
from scenarios.results.record import repeated

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SUMMARY, BUDGET = "summary.parquet", "budget.parquet"
NORMAL = float(2.0 * stats.norm.cdf(2.0) - 1.0)
"""Nominal coverage of an interval of two standard deviations."""
BINS, WORST = 40, 5
MOST_CLAIMS = 500
"""Least number of estimated standard deviations in the mean density, if available."""
SHOWN, DRAWN = 6, 10
"""Number of sources per joint on a screen (files have all), and in a plot."""
WIDEST = 0.5
"""Width of an index's interval above which the index is withheld: half of its range."""
INTERVALS = "Bars: 95 % intervals (Clopper and Pearson). Dashed:"
TRIALS = (
    "Bias, std: mean and standard deviation of the error. Estimated std: rms of the standard deviations that "
    "the trials estimate, all contributions included. Within: trials with an error below 1 or 2 of these; "
    "correct ones give 68.3 % and 95.4 %. A joint that is refused passes if the scenario expects it."
)
SOURCES = (
    "Alone: the source at its declared size, all others off. Share: of the sum of mean squares. First and total "
    "order: Sobol indices of the error's variance with all sources on, with 95 % bootstrap intervals; withheld where "
    "trials are too few for an interval narrower than 0.5."
)


class StudyResult(ResultModel):
    """What `rx90 monte-carlo --json` prints."""

    scenario: str = Field(description="Name of the scenario")
    seed: int = Field(description="Seed of the first trial")
    trials: int = Field(description="Number of trials in the folder, which may exceed the number requested")
    passed: bool = Field(description="Whether every joint is compatible with the pass rate that the scenario requires")
    joints: list[JointStatistics] = Field(description="One entry per joint, in order")
    failures: dict[str, int] = Field(description="Number of trials without any estimate, by kind of failure")

    @classmethod
    def of(cls, scenario: Scenario, seed: int, rows: StudyRows) -> "StudyResult":
        """Compute statistics of a study with the pass rate that its scenario requires."""
        joints = joint_statistics(rows.joints, wanted=scenario.table.tolerance.pass_rate, false_alarm=FALSE_ALARM)
        return cls(
            scenario=scenario.name,
            seed=seed,
            trials=joints[0].trials,
            passed=all(joint.held for joint in joints),
            joints=list(joints),
            failures=dict(rows.failures),
        )

    def title(self, asked: int) -> str:
        """Return the title of a report on a study of which `asked` trials were requested."""
        more = f" (the folder contains more than the {asked} requested)" if self.trials > asked else ""
        return f"Scenario {self.scenario}, {many(self.trials, 'trial')} from seed {self.seed}{more}"

    def parts(self) -> Iterable[Part]:
        """Verdict, errors and intervals of each joint, failures by kind, coverage and pass rates."""
        yield self._verdict()
        yield table(
            self.joints,
            column("Joint", lambda joint: joint.joint),
            column("Bias [%]", lambda joint: percent(joint.bias, "+.3f")),
            column("Std [%]", lambda joint: percent(joint.spread)),
            column("Estimated\nstd [%]", lambda joint: percent(joint.claimed)),
            column("95 %\nbelow [%]", lambda joint: percent(joint.p95)),
            column("Within\n1 sigma [%]", lambda joint: percent(joint.cover_1, ".1f")),
            column("Within\n2 sigma [%]", lambda joint: percent(joint.cover_2, ".1f")),
            column("Gains", lambda joint: joint.gains),
            column("Refused", lambda joint: joint.refused, file_only=True),
            column("Failed", lambda joint: joint.failed, file_only=True),
            column(
                "Passed [%]",
                lambda joint: Cell(percent(joint.pass_rate, ".1f"), Mood.PLAIN if joint.held else Mood.BAD),
            ),
            column("95 % interval [%]", lambda joint: _ends(joint.pass_low, joint.pass_high, ".1f")),
        )
        yield Paragraph(TRIALS)
        for kind, count in self.failures.items():
            yield Paragraph(f"{many(count, 'trial')} failed: {kind}.")
        wanted = 100.0 * self.joints[0].wanted
        held = {
            joint.joint: in_percent(coverage_of(round(joint.cover_2 * joint.gains), joint.gains))
            for joint in self.joints
            if joint.cover_2 is not None
        }
        joints = [joint.joint for joint in self.joints]
        yield Plot(
            title="Coverage of two estimated standard deviations",  # a gain without one is a miss
            caption=f"{INTERVALS} {100.0 * NORMAL:.1f} %, the nominal coverage.",
            x="Joint",
            y="Held [% of gains]",
            draw=partial(draw_intervals, joints=joints, series={"Within 2 sigma": held}, limit=100.0 * NORMAL),
        )
        rates = {
            each.joint: (100.0 * each.pass_rate, 100.0 * each.pass_low, 100.0 * each.pass_high) for each in self.joints
        }
        yield Plot(
            title="How often each joint passed",
            caption=f"{INTERVALS} {wanted:g} %, the required pass rate.",
            x="Joint",
            y="Passed [% of trials]",
            draw=partial(draw_intervals, joints=joints, series={"Passed": rates}, limit=wanted),
        )

    def _verdict(self) -> Paragraph:
        failed = [joint.joint for joint in self.joints if not joint.held]
        trials, allowed, wanted = self.trials, self.joints[0].allowed, f"{100.0 * self.joints[0].wanted:g} %"
        worst = min(self.joints, key=lambda joint: joint.pass_rate)
        missed = trials - worst.passed
        rule = f"a pass rate of {wanted} allows {allowed}"
        if allowed >= trials:
            are = "trial is" if trials == 1 else "trials are"
            rule = f"{trials} {are} too few to test a pass rate of {wanted}"
        if failed:
            fail = f"{joints_named(failed)} {'fail' if failed[1:] else 'fails'} the tolerance"
            of = f"worst: joint {worst.joint}, in {missed} of {trials} trials; {rule}"
            return Paragraph(f"FAILED: {fail} ({of}).", Mood.BAD, strong=True)
        said = f"no joint fails in more than {missed} of" if missed else "every joint passes in all"
        return Paragraph(f"PASSED: {said} {trials} trials ({rule}).", Mood.GOOD, strong=True)

    def write(self, folder: Path) -> Path:
        """Write `SUMMARY`, one row per joint.

        Raises:
            OSError: If it cannot be written.
        """
        pd.DataFrame([asdict(joint) for joint in self.joints]).to_parquet(folder / SUMMARY, index=False)
        return folder / SUMMARY


def monte_carlo_page(folder: Path) -> Report:
    """Return the page of a folder.

    Raises:
        ScenarioError: If it holds no study, or one of another version; if trials are missing.
        StudyError: If a part is damaged.
    """
    study = read_study(folder)
    rows = rows_in(study.rows)
    result = StudyResult.of(study.scenario, study.seed, rows)
    about = {"Trials": str(study.trials), "First seed": str(study.seed)}
    return result.report(
        result.title(study.trials),
        Heading("Errors"),
        *error_plots(rows.joints),
        *worst_trials(study.rows, study.named),
        *repeated({"Original command": study.command}, about, study.versions),
    )


def in_percent(found: Coverage) -> tuple[float, float, float]:
    """Return a coverage with the ends of its interval [%]."""
    return 100.0 * found.share, 100.0 * found.low, 100.0 * found.high


def _ends(low: float, high: float, form: str = ".3f") -> str:
    return f"{percent(low, form)}..{percent(high, form)}"


def error_plots(joints: Sequence[JointRows]) -> list[Plot]:
    """Return plots of errors, the density estimated for them, and the tolerance; of joints with different errors."""
    plots: list[Plot] = []
    for rows in joints:
        error, claimed, tolerance = 100.0 * rows.rel_error, 100.0 * rows.claimed, 100.0 * rows.tolerance
        if len(error) < 2 or np.ptp(error) <= 1e-9 * np.abs(error).max():  # of rounding alone
            continue
        end = 1.1 * max(float(np.abs(error).max()), 3.0 * float(np.median(claimed)))
        bins = int(np.clip(np.sqrt(len(error)) * 1.5, 8, BINS))
        density, edges = np.histogram(error, bins=bins, range=(-end, end), density=True)
        x, some = np.linspace(-end, end, 81), claimed[:: max(1, len(claimed) // MOST_CLAIMS)]
        estimated = stats.norm.pdf(x[:, None], scale=some).mean(axis=1)
        outside = "" if tolerance <= end else f" The tolerance, {tolerance:.3g} %, is outside the plot."
        limits = () if outside else (-tolerance, tolerance)
        plots.append(
            Plot(
                title=f"Joint {rows.joint}",
                caption=f"{len(error)} errors.{outside}",
                x="Error [%]",
                y="Density [1/%]",
                draw=partial(_draw_errors, edges=edges, density=density, x=x, estimated=estimated, limits=limits),
                heights=(130,),
            )
        )
    return plots


def worst_trials(folder: StudyFolder, scenario: str) -> list[Part]:
    """Return the trials with the largest errors over estimated std, and the command to repeat the first."""
    worst, number = pa.table({}), 0
    for part in folder.tables(("seed", "joint", "rel_error", "z")):
        finite = np.flatnonzero(np.isfinite(part["z"].to_numpy()))
        number += len(finite)
        worst = pa.concat_tables([*([worst] if len(worst) else []), part.take(finite)])
        worst = worst.take(np.argsort(-np.abs(worst["z"].to_numpy()), kind="stable")[:WORST])
    if not number:
        return []
    rows: list[dict[str, Any]] = worst.to_pylist()
    listed = table(
        rows,
        column("Seed", lambda each: each["seed"]),
        column("Joint", lambda each: each["joint"]),
        column("Error [%]", lambda each: percent(each["rel_error"], "+.3f")),
        column("z", lambda each: f"{each['z']:+.2f}"),
    )
    seed = rows[0]["seed"]
    command = shlex.join(["rx90", "run", scenario, "--seed", str(seed), "--save", f"seed-{seed}"])
    said = (
        f"Errors in units of the estimated standard deviation; the largest of {number} normal errors is expected at "
        f"about {float(stats.norm.isf(0.5 / number)):.1f}. To reproduce the worst trial:"
    )
    return [Heading("Trials with the largest errors"), listed, Paragraph(said), Line(command)]


def _draw_errors(
    axes: "Axes", edges: Array, density: Array, x: Array, estimated: Array, limits: tuple[float, ...]
) -> None:
    axes.plot(np.repeat(edges, 2), np.r_[0.0, np.repeat(density, 2), 0.0], label="Errors")
    axes.plot(x, estimated, label="Estimated")
    for at in limits:
        axes.axvline(at, **LIMIT)


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
        limits, order = list(zip(self.joints, self.tolerance, strict=True)), ranking(self.joints)[:DRAWN]
        yield budget_verdict(
            [(each.joint, each.together, limit, each.costs[0].source if each.costs else None) for each, limit in limits]
        )
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
                column("95 % interval [%]", lambda cost: _ends(cost.rms.low, cost.rms.high)),
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
                yield cost_plot(budget, order, 100.0 * limit)
        yield Paragraph(SOURCES)

    def write(self, folder: Path) -> Path:
        """Write `BUDGET`, one row per joint and source.

        Raises:
            OSError: If it cannot be written.
        """
        rows: list[dict[str, object]] = []
        for cost in (cost for budget in self.joints for cost in budget.costs):
            row: dict[str, object] = {
                name: getattr(cost, name) for name in ("joint", "source", "trials", "bias", "share")
            }
            for name in ("rms", "first", "total"):
                of: Interval | None = getattr(cost, name)
                row |= {name: of and of.value, f"{name}_low": of and of.low, f"{name}_high": of and of.high}
            rows.append(row)
        pd.DataFrame(rows).to_parquet(folder / BUDGET, index=False)
        return folder / BUDGET


def _index(index: Interval | None) -> str | None:
    if index is None or index.high - index.low >= WIDEST:
        return None
    return f"{index.value:.2f} ({index.low:.2f}..{index.high:.2f})"


def sensitivity_page(folder: Path) -> Report:
    """Return the page of a folder.

    Raises:
        ScenarioError: If it holds no study, or one of another version; if trials are missing.
        StudyError: If no trial gave the gain of a joint that should have one; if a part is damaged.
    """
    study = read_study(folder)
    result = Budget.of(study.scenario, study.trials, study.rows, study.seed)
    origin = repeated({"Original command": study.command}, {"Seed": str(study.seed)}, study.versions)
    return result.report(result.title(len(study.scenario.table.sources)), *origin)


def cost_plot(budget: BudgetJoint, order: Sequence[str], tolerance: float) -> Plot:
    """Return the plot of one joint's rms error from each of the largest sources alone, with intervals.

    `order` has the sources, and `tolerance` is in %.
    """
    costs = {cost.source: cost.rms for cost in budget.costs}
    there = [source for source in order if source in costs]
    largest = max(100.0 * cost.value for cost in costs.values())
    inside = tolerance <= 2.0 * largest
    beyond = " Dashed: the tolerance." if inside else f" The tolerance, {tolerance:.3g} %, is outside the plot."

    def draw(axes: "Axes") -> None:
        at, found = [order.index(source) for source in there], [costs[source] for source in there]
        axes.barh(at, [100.0 * each.value for each in found], 0.75, edgecolor=COLOURS["ink"], lw=0.5)
        axes.hlines(at, [100.0 * each.low for each in found], [100.0 * each.high for each in found], COLOURS["ink"])
        axes.set_yticks(range(len(order)), order)
        axes.set_ylim(len(order) - 0.4, -0.6)  # the first at the top
        axes.grid(visible=False, axis="y")
        if inside:
            axes.axvline(tolerance, **LIMIT)

    return Plot(
        title=f"Joint {budget.joint}",
        caption=f"The {len(there)} largest of {len(costs)} sources, ranked over all joints; 95 % bootstrap "
        f"intervals.{beyond}",
        x="Rms error from the source alone [%]",
        y="",
        draw=draw,
    )
