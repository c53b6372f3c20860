"""The result of a Monte Carlo study: verdict, errors and intervals by joint, failures, the worst trials."""

import shlex
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
from pydantic import Field
from scipy import stats

from ident.support.arrays import Array
from scenarios.experiments.schema import Scenario
from scenarios.experiments.statistics import (
    FALSE_ALARM,
    Coverage,
    JointRows,
    JointStatistics,
    StudyRows,
    coverage_of,
    joint_statistics,
    rows_in,
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
from scenarios.rendering.plot import Axis, Mark, Plot, Reference, Series, Tone, intervals, values
from scenarios.rendering.result import ResultModel
from scenarios.results import provenance

SUMMARY = "summary.parquet"
MEANING = (
    "Bias, std: mean and standard deviation of the error. Estimated std: rms of the standard deviations that "
    "the trials estimate, all contributions included. Within: trials with an error below 1 or 2 of these; "
    "correct ones give 68.3 % and 95.4 %. A joint that is refused passes if the scenario expects it."
)
NORMAL = float(2.0 * stats.norm.cdf(2.0) - 1.0)
"""Nominal coverage of an interval of two standard deviations."""
BINS, WORST = 40, 5
MOST_CLAIMS = 500
"""Least number of estimated standard deviations in the mean density, if available."""
MOST_POINTS = 5000
"""Largest number of points of a scatter plot."""
DPI = 110
NEEDED = ("seed", "joint", "rel_error", "z")
"""Columns of a study that determine its worst trials."""


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
            column(
                "95 % interval [%]",
                lambda joint: f"{percent(joint.pass_low, '.1f')}..{percent(joint.pass_high, '.1f')}",
            ),
        )
        yield Paragraph(MEANING)
        for kind, count in self.failures.items():
            yield Paragraph(f"{many(count, 'trial')} failed: {kind}.")
        yield coverage_plot(self.joints)
        yield pass_plot(self.joints)

    def _verdict(self) -> Paragraph:
        failed = [joint.joint for joint in self.joints if not joint.held]
        trials, allowed, wanted = self.trials, self.joints[0].allowed, f"{100.0 * self.joints[0].wanted:g} %"
        worst = min(self.joints, key=lambda joint: joint.pass_rate)
        missed = trials - worst.passed
        rule = (
            f"{trials} {'trial is' if trials == 1 else 'trials are'} too few to test a pass rate of {wanted}"
            if allowed >= trials
            else f"a pass rate of {wanted} allows {allowed}"
        )
        if failed:
            fail = f"{joints_named(failed)} {'fail' if failed[1:] else 'fails'} the tolerance"
            of = f"worst: joint {worst.joint}, in {missed} of {trials} trials; {rule}"
            return Paragraph(f"FAILED: {fail} ({of}).", Mood.BAD, strong=True)
        said = f"no joint fails in more than {missed} of" if missed else "every joint passes in all"
        return Paragraph(f"PASSED: {said} {trials} trials ({rule}).", Mood.GOOD, strong=True)


def page(folder: Path) -> Report:
    """Return the page of a folder.

    Raises:
        ScenarioError: If it holds no study, or one of another version; if trials are missing.
        StudyError: If a part is damaged.
    """
    study = read_study(folder)
    rows = rows_in(study.rows)
    result = StudyResult.of(study.scenario, study.seed, rows)
    about = {"Trials": str(study.trials), "First seed": str(study.seed)}
    about["Versions"] = provenance.versions_in_words(study.versions)
    return result.report(
        result.title(study.trials),
        Heading("Errors"),
        *error_plots(rows.joints),
        *worst_trials(study.rows, study.named),
        *provenance.repeated({"Original command": study.command}, about, {}),
    )


def write_files(result: StudyResult, rows: StudyRows, folder: Path) -> list[Path]:
    """Write `summary.parquet`, one row per joint, and plots of errors, with one panel per joint.

    Raises:
        OSError: If a file cannot be written.
    """
    written = [folder / SUMMARY]
    pd.DataFrame([asdict(joint) for joint in result.joints]).to_parquet(written[0], index=False)
    for name, plots_of in FIGURES.items():
        plots = plots_of(rows.joints)
        if plots:
            from scenarios.rendering.drawing import figure  # Matplotlib, which no other use of the result needs

            drawing = figure(plots, across=3, title=f"{result.scenario}, {many(result.trials, 'trial')}")
            written.append(folder / f"{name}.png")
            drawing.savefig(written[-1], dpi=DPI)
    return written


def in_percent(found: Coverage) -> tuple[float, float, float]:
    """Return a coverage with the ends of its interval [%]."""
    return 100.0 * found.share, 100.0 * found.low, 100.0 * found.high


def coverage_plot(joints: Sequence[JointStatistics]) -> Plot:
    """Return the plot of coverage of two estimated standard deviations; a gain without one is a miss."""
    found = {
        str(joint.joint): coverage_of(round(joint.cover_2 * joint.gains), joint.gains)
        for joint in joints
        if joint.cover_2 is not None
    }
    return Plot(
        title="Coverage of two estimated standard deviations",
        caption=(f"Bars: 95 % intervals (Clopper and Pearson). Dashed: {100.0 * NORMAL:.1f} %, the nominal coverage."),
        x=Axis(title="joint", categories=tuple(str(joint.joint) for joint in joints)),
        y=Axis(title="held", unit="% of gains"),
        series=(intervals("Within 2 sigma", tuple(found), [in_percent(each) for each in found.values()], Tone.FIRST),),
        references=(Reference("", 100.0 * NORMAL),),
    )


def pass_plot(joints: Sequence[JointStatistics]) -> Plot:
    """Return the plot of pass rates with their intervals."""
    names, wanted = tuple(str(joint.joint) for joint in joints), 100.0 * joints[0].wanted
    ends = [(100.0 * each.pass_rate, 100.0 * each.pass_low, 100.0 * each.pass_high) for each in joints]
    return Plot(
        title="How often each joint passed",
        caption=f"Bars: 95 % intervals (Clopper and Pearson). Dashed: {wanted:g} %, the required pass rate.",
        x=Axis(title="joint", categories=names),
        y=Axis(title="passed", unit="% of trials"),
        series=(intervals("Passed", names, ends, Tone.THIRD),),
        references=(Reference("", wanted),),
    )


def varies(values: Array) -> bool:
    """Return whether the variation of values exceeds their rounding."""
    return len(values) > 1 and bool(np.ptp(values) > 1e-9 * np.abs(values).max())


def reach(rows: JointRows) -> float:
    """Return the range of errors and of the implied density [%]."""
    return 110.0 * max(float(np.abs(rows.rel_error).max()), 3.0 * float(np.median(rows.claimed)))


def promised(rows: JointRows, x: Array) -> Array:
    """Return the mean normal density by the estimated standard deviations [1/%], at errors `x` [%], shape (k,)."""
    some = 100.0 * rows.claimed[:: max(1, len(rows.claimed) // MOST_CLAIMS)]
    return stats.norm.pdf(x[:, None], scale=some).mean(axis=1)


def error_plots(joints: Sequence[JointRows]) -> list[Plot]:
    """Return plots of errors, the density estimated for them, and the tolerance; of joints with different errors."""
    plots: list[Plot] = []
    for rows in joints:
        if not varies(rows.rel_error):
            continue
        error, end = 100.0 * rows.rel_error, reach(rows)
        bins = int(np.clip(np.sqrt(len(error)) * 1.5, 8, BINS))
        density, edges = np.histogram(error, bins=bins, range=(-end, end), density=True)
        x = np.linspace(-end, end, 81)
        limits, beyond = _limits(rows, end)
        counted = Series(
            label="Errors",
            mark=Mark.LINE,
            x=values(np.repeat(edges, 2)),
            y=values(np.r_[0.0, np.repeat(density, 2), 0.0]),
        )
        plots.append(
            Plot(
                title=f"Joint {rows.joint}",
                caption=f"{len(error)} errors.{beyond}",
                x=Axis(title="error", unit="%"),
                y=Axis(title="density", unit="1/%", zero=True),
                series=(
                    counted,
                    Series(
                        label="Estimated", mark=Mark.LINE, tone=Tone.SECOND, x=values(x), y=values(promised(rows, x))
                    ),
                ),
                references=tuple(Reference("", limit, upright=True) for limit in limits),
                height=130,
            )
        )
    return plots


def _limits(rows: JointRows, end: float) -> tuple[tuple[float, ...], str]:
    """Return the tolerance on both sides [%] if it is within the range, else a remark."""
    tolerance = 100.0 * rows.tolerance
    if tolerance <= end:
        return (-tolerance, tolerance), ""
    return (), f" The tolerance, {tolerance:.3g} %, is outside the plot."


def quantile_plots(joints: Sequence[JointRows]) -> list[Plot]:
    """Return plots of sorted z over normal quantiles, with the line of correct standard deviations."""
    plots: list[Plot] = []
    for rows in joints:
        z = np.sort(rows.z[np.isfinite(rows.z)])
        if varies(rows.rel_error) and len(z):
            keep = np.unique(np.linspace(0, len(z) - 1, min(len(z), MOST_POINTS)).astype(int))
            normal = stats.norm.ppf((keep + 0.5) / len(z))
            points = Series(label="", mark=Mark.POINTS, x=values(normal), y=values(z[keep]))
            line = Series(label="", mark=Mark.LINE, tone=Tone.QUIET, x=values(normal), y=values(normal))
            x, y = Axis(title="normal quantile"), Axis(title="z = error / estimated sigma")
            plots.append(Plot(title=f"Joint {rows.joint}", caption="", x=x, y=y, series=(line, points)))
    return plots


def gain_plots(joints: Sequence[JointRows]) -> list[Plot]:
    """Return plots of errors over the injected gain, where both vary."""
    plots: list[Plot] = []
    for rows in joints:
        if varies(rows.rel_error) and varies(rows.true):
            limits, _ = _limits(rows, 2.0 * reach(rows))
            true, error = rows.true / np.median(rows.true), 100.0 * rows.rel_error[:: rows.step]
            points = Series(label="", mark=Mark.POINTS, x=values(true), y=values(error))
            plots.append(
                Plot(
                    title=f"Joint {rows.joint}",
                    caption="",
                    x=Axis(title="injected gain / median"),
                    y=Axis(title="error", unit="%", zero=True),
                    series=(points,),
                    references=tuple(Reference("", limit) for limit in limits),
                )
            )
    return plots


FIGURES: dict[str, Callable[[Sequence[JointRows]], list[Plot]]] = {
    "errors": error_plots,
    "z-scores": quantile_plots,
    "error-against-gain": gain_plots,
}
"""Plots by names of their files."""


def worst_trials(folder: StudyFolder, scenario: str) -> list[Part]:
    """Return the trials with the largest errors over estimated std, and the command to repeat the first."""
    worst, number = worst_rows(folder.tables(NEEDED))
    if not number:
        return []
    rows = table(
        worst,
        column("Seed", lambda each: each["seed"]),
        column("Joint", lambda each: each["joint"]),
        column("Error [%]", lambda each: percent(each["rel_error"], "+.3f")),
        column("z", lambda each: f"{each['z']:+.2f}"),
    )
    seed = worst[0]["seed"]
    command = shlex.join(["rx90", "run", scenario, "--seed", str(seed), "--save", f"seed-{seed}"])
    said = (
        f"Errors in units of the estimated standard deviation; the largest of {number} normal errors is expected at "
        f"about {float(stats.norm.isf(0.5 / number)):.1f}. To reproduce the worst trial:"
    )
    return [Heading("Trials with the largest errors"), rows, Paragraph(said), Line(command)]


def worst_rows(tables: Iterable[pa.Table]) -> tuple[list[dict[str, Any]], int]:
    """Return the `WORST` rows with the largest errors in estimated standard deviations, and the number of all rows."""
    worst, number = pa.table({}), 0
    for part in tables:
        finite = np.flatnonzero(np.isfinite(part["z"].to_numpy()))
        number += len(finite)
        worst = pa.concat_tables([*([worst] if len(worst) else []), part.take(finite)])
        worst = worst.take(np.argsort(-np.abs(worst["z"].to_numpy()), kind="stable")[:WORST])
    return worst.to_pylist(), number
