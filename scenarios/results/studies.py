"""Result of a Monte Carlo study: errors, intervals and pass rates of each joint."""

import shlex
from collections.abc import Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from pydantic import Field
from scipy import stats

from ident.diagnosis.diagnosis import two_digits
from ident.support.arrays import Array
from scenarios.experiments.scenario import load_scenario
from scenarios.experiments.schema import Scenario
from scenarios.experiments.statistics import (
    COLUMNS,
    FALSE_ALARM,
    Coverage,
    JointStatistics,
    by_joint,
    coverage_of,
    joint_statistics,
)
from scenarios.experiments.study import StudyRows, study_rows_of, sweep
from scenarios.experiments.study_folder import read_study
from scenarios.rendering import Page, renderer
from scenarios.rendering.content import Cell, Heading, Line, Mood, Paragraph, Part, Report, column, table, verdict
from scenarios.rendering.plot import LIMIT, Plot, intervals_plot
from scenarios.rendering.result import ResultModel
from scenarios.rendering.wording import joints_named, many, percent, percent_range
from scenarios.results.record import repeated
from scenarios.support.errors import ScenarioError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NORMAL = float(2.0 * stats.norm.cdf(2.0) - 1.0)
"""Nominal coverage of an interval of two standard deviations."""
BINS, WORST = 40, 5
MOST_CLAIMS = 500
"""Least number of estimated standard deviations in the mean density, if available."""
TRIALS = (
    "Bias, std: mean and standard deviation of the error. Estimated std: rms of the standard deviations that "
    "the trials estimate, all contributions included. Within: trials with an error below 1 or 2 of these; "
    "correct ones give 68.3 % and 95.4 %. A joint that is refused passes if the scenario expects it."
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
    def of(cls, scenario: Scenario, seed: int, rows: pd.DataFrame) -> "StudyResult":
        """Compute statistics of a study's rows with the pass rate that its scenario requires."""
        joints = joint_statistics(rows, wanted=scenario.table.tolerance.pass_rate, false_alarm=FALSE_ALARM)
        return cls(
            scenario=scenario.name,
            seed=seed,
            trials=joints[0].trials,
            passed=all(joint.held for joint in joints),
            joints=list(joints),
            failures=rows[rows["joint"] == joints[0].joint]["failure"].value_counts().to_dict(),
        )

    @classmethod
    def of_rows(cls, study: StudyRows) -> "StudyResult":
        """Compute statistics of a study in memory."""
        return cls.of(study.scenario, study.rows["seed"][0].as_py(), study.rows.to_pandas())

    def title(self, asked: int) -> str:
        """Return the title of a report on a study of which `asked` trials were requested."""
        more = f" (the folder contains more than the {asked} requested)" if self.trials > asked else ""
        return f"Scenario {self.scenario}, {many(self.trials, 'trial')} from seed {self.seed}{more}"

    def parts(self) -> Iterable[Part]:
        """Verdict, errors and intervals of each joint, failures by kind, coverage and pass rates."""
        yield self._verdict()
        moods = {True: Mood.PLAIN, False: Mood.BAD}
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
            column("Passed [%]", lambda joint: Cell(percent(joint.pass_rate, ".1f"), moods[joint.held])),
            column("95 % interval [%]", lambda joint: percent_range(joint.pass_low, joint.pass_high, ".1f")),
        )
        yield Paragraph(TRIALS)
        for kind, count in self.failures.items():
            yield Paragraph(f"{many(count, 'trial')} failed: {kind}.")
        known = [joint for joint in self.joints if joint.cover_2 is not None]
        held = {x.joint: in_percent(coverage_of(round((x.cover_2 or 0.0) * x.gains), x.gains)) for x in known}
        title, nominal = "Coverage of two estimated standard deviations", 100.0 * NORMAL  # a gain without one is a miss
        said = f"Bars: 95 % intervals (Clopper and Pearson). Dashed: {nominal:.1f} %, the nominal coverage."
        joints, series = [joint.joint for joint in self.joints], {"Within 2 sigma": held}
        yield intervals_plot(title, said, "Held [% of gains]", joints, series, limit=nominal)

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
            return verdict(f"{fail} ({of})", False)
        said = f"no joint fails in more than {missed} of" if missed else "every joint passes in all"
        said += f" {trials} trials ({rule})"
        if errors := {joint.p95: joint.joint for joint in self.joints if joint.p95 is not None}:
            size, joint = two_digits(100.0 * max(errors)), errors[max(errors)]
            said += f"; 95 % of the errors are below {size} % (worst: joint {joint})"
        return verdict(said, True)


def monte_carlo_page(folder: Path) -> Report:
    """Return the page of a folder."""
    study = read_study(folder)
    rows = study.rows.table(COLUMNS)
    result = StudyResult.of(study.scenario, study.seed, rows)
    about = {"Trials": str(study.trials), "First seed": str(study.seed)}
    parts = [Heading("Errors"), *error_plots(rows), *worst_trials(rows, study.named)]
    origin = repeated({"Original command": study.command}, about, study.versions)
    return result.report(result.title(study.trials), *parts, *origin)


def in_percent(found: Coverage) -> tuple[float, float, float]:
    """Return a coverage with the ends of its interval [%]."""
    return 100.0 * found.share, 100.0 * found.low, 100.0 * found.high


def assert_scenario(scenario: str, seeds: Iterable[int]) -> StudyResult:
    """Assert that every joint passes as often as the scenario's `tolerance.pass_rate` requires.

    The trials of `rx90 run --seed`, judged as by `rx90 monte-carlo`: a scenario with this rate on all joints fails for
    less than 1 % of all choices of seeds; if they are too few to test the rate, every trial must pass. With fixed seeds
    the outcome is always the same.

    Args:
        scenario: A built-in name or the path of a TOML file.
        seeds: Seeds, with one trial each.

    Returns:
        The result, if all joints pass.

    Raises:
        AssertionError: If a joint fails; the message is the report of the study, with its worst trials.
        ScenarioError: If the scenario is wrong; if there is no seed, or one is given twice.
    """
    loaded, chosen = load_scenario(scenario), list(seeds)
    if len(set(chosen)) < len(chosen):
        raise ScenarioError("a seed is given twice; a repeated trial adds no information")
    rows = study_rows_of(sweep(loaded, {}, chosen)).to_frame()
    result = StudyResult.of(loaded, chosen[0], rows)
    if not result.passed:
        missed = [joint.joint for joint in result.joints if not joint.held]
        title = f"Scenario {loaded.name}, {many(len(chosen), 'trial')}"
        report = result.report(title, *worst_trials(rows.query(f"joint in {missed}"), scenario))
        raise AssertionError(renderer("text")(report, Page()))
    return result


def error_plots(study: pd.DataFrame) -> list[Plot]:
    """Return plots of errors, the density estimated for them, and the tolerance; of joints with different errors."""
    plots: list[Plot] = []
    for joint, rows, found in by_joint(study):
        error, claimed = (100.0 * found[name].to_numpy() for name in ("rel_error", "claimed"))
        tolerance = 100.0 * float(rows["tolerance"].iloc[0])
        if len(error) < 2 or np.ptp(error) <= 1e-9 * np.abs(error).max():  # of rounding alone
            continue
        end = 1.1 * max(float(np.abs(error).max()), 3.0 * float(np.median(claimed)))
        bins = int(np.clip(np.sqrt(len(error)) * 1.5, 8, BINS))
        density, edges = np.histogram(error, bins=bins, range=(-end, end), density=True)
        x, some = np.linspace(-end, end, 81), claimed[:: max(1, len(claimed) // MOST_CLAIMS)]
        estimated = stats.norm.pdf(x[:, None], scale=some).mean(axis=1)
        outside = "" if tolerance <= end else f" The tolerance, {tolerance:.3g} %, is outside the plot."
        limits = () if outside else (-tolerance, tolerance)
        errors = np.repeat(edges, 2), np.r_[0.0, np.repeat(density, 2), 0.0]
        draw = partial(_draw_curves, curves={"Errors": errors, "Estimated": (x, estimated)}, limits=limits)
        title, said, y = f"Joint {joint}", f"{len(error)} errors.{outside}", "Density [1/%]"
        plots.append(Plot(title=title, caption=said, x="Error [%]", y=y, draw=draw, heights=(130,)))
    return plots


def worst_trials(study: pd.DataFrame, scenario: str) -> list[Part]:
    """Return the trials with the largest errors over estimated std, and the command to repeat the first."""
    finite = study.dropna(subset=["z"])
    if finite.empty:
        return []
    worst = np.argsort(-np.abs(finite["z"].to_numpy()), kind="stable")[:WORST]
    rows: list[Any] = list(finite.iloc[worst].itertuples())
    listed = table(
        rows,
        column("Seed", lambda each: each.seed),
        column("Joint", lambda each: each.joint),
        column("Error [%]", lambda each: percent(each.rel_error, "+.3f")),
        column("z", lambda each: f"{each.z:+.2f}"),
    )
    seed, expected = rows[0].seed, f"{float(stats.norm.isf(0.5 / len(finite))):.1f}"
    command = shlex.join(["rx90", "run", scenario, "--seed", str(seed), "--save", f"seed-{seed}"])
    said = f"Errors in units of the estimated standard deviation; the largest of {len(finite)} normal errors is "
    said += f"expected at about {expected}. To reproduce the worst trial:"
    return [Heading("Trials with the largest errors"), listed, Paragraph(said), Line(command)]


def _draw_curves(axes: "Axes", curves: Mapping[str, tuple[Array, Array]], limits: Iterable[float]) -> None:
    for label, curve in curves.items():
        axes.plot(*curve, label=label)
    for at in limits:
        axes.axvline(at, **LIMIT)
