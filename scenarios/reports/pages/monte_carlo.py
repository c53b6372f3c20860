"""The page of a Monte Carlo study: verdict, errors and intervals joint by joint, refusals, the worst trials."""

import shlex
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from scipy import stats

from scenarios.experiments.statistics import Coverage, JointRows, JointStatistics, coverage, rows_in, study_result
from scenarios.experiments.study_folder import StoredStudy, read_study
from scenarios.rendering.content import Figure, Heading, Line, Paragraph, Part, Report, column, percent, table
from scenarios.rendering.plot import Axis, Mark, Plot, Reference, Series, Tone, intervals, values
from scenarios.reports.error_density import panels, promised, reach
from scenarios.reports.monte_carlo import monte_carlo_report
from scenarios.results import provenance

BINS, WORST = 40, 5
NEEDED = ("seed", "joint", "rel_error", "z")
"""Columns of a study that determine its worst trials."""
NORMAL = float(2.0 * stats.norm.cdf(2.0) - 1.0)
"""Nominal coverage of an interval of two standard deviations."""


def page(folder: Path) -> Report:
    """Return the page of a folder.

    Raises:
        ScenarioError: If it holds no study, or one of another version; if trials are missing.
        StudyError: If a part is damaged.
    """
    study = read_study(folder)
    rows = rows_in(study.rows)
    result = study_result(study.scenario, study.seed, rows)
    told = monte_carlo_report(result, rows, asked=study.trials)
    parts: list[Part] = [part for part in told.parts if not isinstance(part, Figure)]
    parts += [
        coverage_plot(rows.joints),
        pass_plot(result.joints),
        Heading("Errors"),
        *(error_plot(joint, of) for joint, of in panels(rows.joints).items()),
        *_refused(result.joints),
        *_worst(study),
    ]
    about = {"Trials": str(study.trials), "First seed": str(study.seed)}
    about["Versions"] = provenance.versions_in_words(study.versions)
    parts += provenance.repeated({"Original command": study.command}, about, {})
    return Report(told.title, tuple(parts), told.document)


def coverage_plot(joints: Sequence[JointRows]) -> Plot:
    """Return the plot of coverage of two estimated standard deviations; a gain without one is a miss."""
    names = tuple(str(rows.joint) for rows in joints)
    found = {str(rows.joint): held for rows in joints if (held := coverage(np.abs(rows.z) < 2.0)) is not None}
    return Plot(
        title="Coverage of two estimated standard deviations",
        caption=(f"Bars: 95 % intervals (Clopper and Pearson). Dashed: {100.0 * NORMAL:.1f} %, the nominal coverage."),
        x=Axis(title="joint", categories=names),
        y=Axis(title="held", unit="% of gains"),
        series=(intervals("Within 2 sigma", tuple(found), [in_percent(each) for each in found.values()], Tone.FIRST),),
        references=(Reference("", 100.0 * NORMAL),),
    )


def in_percent(found: Coverage) -> tuple[float, float, float]:
    """Return a coverage with the ends of its interval [%]."""
    return 100.0 * found.share, 100.0 * found.low, 100.0 * found.high


def pass_plot(statistics: Sequence[JointStatistics]) -> Plot:
    """Return the plot of pass rates with their intervals."""
    names = tuple(str(joint.joint) for joint in statistics)
    wanted = 100.0 * statistics[0].wanted
    return Plot(
        title="How often each joint passed",
        caption=f"Bars: 95 % intervals (Clopper and Pearson). Dashed: {wanted:g} %, the required pass rate.",
        x=Axis(title="joint", categories=names),
        y=Axis(title="passed", unit="% of trials"),
        series=(
            intervals(
                "Passed",
                names,
                [(100.0 * each.pass_rate, 100.0 * each.pass_low, 100.0 * each.pass_high) for each in statistics],
                Tone.THIRD,
            ),
        ),
        references=(Reference("", wanted),),
    )


def error_plot(joint: int, rows: JointRows) -> Plot:
    """Return the plot of a joint's errors, the density estimated for them, and the tolerance."""
    error, end = 100.0 * rows.rel_error, reach(rows)
    bins = int(np.clip(np.sqrt(len(error)) * 1.5, 8, BINS))
    density, edges = np.histogram(error, bins=bins, range=(-end, end), density=True)
    x = np.linspace(-end, end, 81)
    tolerance = 100.0 * rows.tolerance
    limits = (-tolerance, tolerance) if tolerance <= end else ()
    beyond = "" if limits else f" The tolerance, {tolerance:.3g} %, is outside the plot."
    return Plot(
        title=f"Joint {joint}",
        caption=f"{len(error)} errors.{beyond}",
        x=Axis(title="error", unit="%"),
        y=Axis(title="density", unit="1/%", zero=True),
        series=(
            Series(
                label="Errors",
                mark=Mark.LINE,
                x=values(np.repeat(edges, 2)),
                y=values(np.r_[0.0, np.repeat(density, 2), 0.0]),
            ),
            Series(label="Estimated", mark=Mark.LINE, tone=Tone.SECOND, x=values(x), y=values(promised(rows, x))),
        ),
        references=tuple(Reference("", limit, upright=True) for limit in limits),
        height=130,
    )


def _refused(statistics: Sequence[JointStatistics]) -> list[Part]:
    counts = table(
        statistics,
        column("Joint", lambda joint: joint.joint),
        column("Gains", lambda joint: joint.trials - joint.failed - joint.refused),
        column("Refused", lambda joint: joint.refused),
        column("Trials without any estimate", lambda joint: joint.failed),
    )
    return [Heading("Refused and failed"), counts]


def _worst(study: StoredStudy) -> list[Part]:
    """Return the trials with the largest errors over estimated std, and the command to repeat the first."""
    worst, many = worst_rows(study.rows.rows(part, NEEDED) for part in study.rows.parts())
    if not many:
        return []
    rows = table(
        worst,
        column("Seed", lambda each: each["seed"]),
        column("Joint", lambda each: each["joint"]),
        column("Error [%]", lambda each: percent(each["rel_error"], "+.3f")),
        column("z", lambda each: f"{each['z']:+.2f}"),
    )
    seed = worst[0]["seed"]
    command = shlex.join(["rx90", "run", study.named, "--seed", str(seed), "--save", f"seed-{seed}"])
    said = (
        f"Errors in units of the estimated standard deviation; the largest of {many} normal errors is expected at "
        f"about {float(stats.norm.isf(0.5 / many)):.1f}. To reproduce the worst trial:"
    )
    return [Heading("Trials with the largest errors"), rows, Paragraph(said), Line(command)]


def worst_rows(tables: Iterable[pa.Table]) -> tuple[list[dict[str, Any]], int]:
    """Return the `WORST` rows with the largest errors in estimated standard deviations, and the number of all rows."""
    worst, many = pa.table({}), 0
    for part in tables:
        z = np.abs(part["z"].to_numpy())
        there = np.flatnonzero(np.isfinite(z))
        many += len(there)
        some = part.take(there[np.argsort(-z[there], kind="stable")[:WORST]])
        worst = pa.concat_tables([worst, some]) if len(worst) else some
        worst = worst.take(np.argsort(-np.abs(worst["z"].to_numpy()), kind="stable")[:WORST])
    return worst.to_pylist(), many
