"""What a Monte Carlo study found: a table for the terminal, `summary.parquet`, and plots."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rich.console import Console
from rich.text import Text
from scipy import stats

from scenarios.files.schema import Scenario
from scenarios.reports.run import number, table
from scenarios.studies.statistics import JointStatistics, statistics_table

MOST_POINTS = 5000
"""Points of a scatter plot; more only cover each other."""
HISTOGRAM, QQ, AGAINST_TRUE = "errors.png", "z-scores.png", "error-against-gain.png"


def print_monte_carlo(statistics: tuple[JointStatistics, ...], rows: pd.DataFrame, console: Console) -> None:
    """One row a joint, failures by kind, and the verdict."""
    grid = table(
        "Joint", "Bias", "Spread", "Claimed", "95 % below", "in 1 sigma", "in 2", "+payload", "Gains", "Passed"
    )
    for joint in statistics:
        low, high = 100.0 * joint.pass_low, 100.0 * joint.pass_high
        grid.add_row(
            str(joint.joint),
            _percent(joint.bias, "+.3f"),
            _percent(joint.spread),
            _percent(joint.claimed),
            _percent(joint.p95),
            _percent(joint.cover_1, ".1f"),
            _percent(joint.cover_2, ".1f"),
            _percent(joint.cover_2_payload, ".1f"),
            f"{joint.trials - joint.failed - joint.refused} of {joint.trials}",
            Text(f"{100.0 * joint.pass_rate:.1f} % ({low:.1f}..{high:.1f})", style="" if joint.held else "red"),
        )
    console.print(grid)
    console.print(
        "Of honest deviations: 68.3 % within 1 sigma, 95.4 % within 2. A joint that is rightly refused passes."
    )
    for kind, count in failures(rows).items():
        console.print(f"{count} {'trial' if count == 1 else 'trials'} failed: {kind}.")
    console.print(_verdict(statistics))


def _verdict(statistics: tuple[JointStatistics, ...]) -> Text:
    """Whether the pass rate holds, and what it means."""
    missed = [str(joint.joint) for joint in statistics if not joint.held]
    trials, allowed, wanted = statistics[0].trials, statistics[0].allowed, f"{100.0 * statistics[0].wanted:g} %"
    few = allowed >= trials
    if missed and few:
        return Text(f"MISSED on joint {', '.join(missed)} (too few trials to judge a pass rate).", style="bold red")
    if missed:
        rule = f"more than {allowed} of {trials}, which a pass rate of {wanted} does not explain"
        return Text(f"MISSED on joint {', '.join(missed)}: {rule}.", style="bold red")
    if few:
        return Text("PASSED: every trial, though too few to judge a pass rate.", style="bold green")
    rule = f"{allowed} of {trials}, as many as a pass rate of {wanted} explains"
    return Text(f"PASSED: no joint missed more than {rule}.", style="bold green")


def failures(rows: pd.DataFrame) -> dict[str, int]:
    """Trials without any estimate, by kind."""
    first = rows[rows["joint"] == rows["joint"].min()]
    return {str(kind): int(count) for kind, count in first["failure"].value_counts().items()}


def write_monte_carlo(
    statistics: tuple[JointStatistics, ...], rows: pd.DataFrame, scenario: Scenario, folder: Path
) -> list[Path]:
    """Write `summary.parquet` and the plots.

    Args:
        statistics: One a joint.
        rows: All rows of the study.
        scenario: That was repeated.
        folder: Of the study.

    Returns:
        What was written.

    Raises:
        OSError: If it cannot be.
    """
    written = [folder / "summary.parquet"]
    statistics_table(statistics).to_parquet(written[0], index=False)
    found = {joint.joint: rows.query("identifiable and joint == @joint.joint") for joint in statistics}
    found = {joint: group for joint, group in found.items() if len(group) > 1}
    if found:
        for name, draw in ((HISTOGRAM, _histogram), (QQ, _qq), (AGAINST_TRUE, _against_true)):
            figure = _panels(found, draw)
            figure.suptitle(f"{scenario.name}, {statistics[0].trials} trials")
            figure.savefig(folder / name, dpi=110)
            written.append(folder / name)
    return written


def _panels(found: Mapping[int, pd.DataFrame], draw: Callable[[Axes, pd.DataFrame], None]) -> Figure:
    """One panel a joint, three in a row."""
    across = min(3, len(found))
    down = -(-len(found) // across)
    figure = Figure(figsize=(4.2 * across, 3.2 * down + 0.3), layout="constrained")
    axes = np.atleast_1d(figure.subplots(down, across)).ravel()
    for axis, (joint, rows) in zip(axes, found.items(), strict=False):
        draw(axis, rows)
        axis.set_title(f"joint {joint}", fontsize=10)
    for axis in axes[len(found) :]:
        axis.set_axis_off()
    return figure


def _histogram(axis: Axes, rows: pd.DataFrame) -> None:
    """Errors against the normal density that the claimed deviations promise."""
    error = 100.0 * rows["rel_error"].to_numpy()
    claimed = 100.0 * (rows["std"] / rows["true"].abs()).to_numpy()
    axis.hist(error, bins="auto", density=True, color="0.8", label="errors")
    reach = 1.1 * max(np.abs(error).max(), 3.0 * np.median(claimed))
    x = np.linspace(-reach, reach, 400)
    some = claimed[:: max(1, len(claimed) // 500)]
    density = stats.norm.pdf(x[:, None], scale=some).mean(axis=1)
    axis.plot(x, density, color="C0", label="claimed")
    tolerance = 100.0 * float(rows["tolerance"].iloc[0])
    for side in (-tolerance, tolerance):
        if abs(side) <= reach:
            axis.axvline(side, color="C3", linestyle="--", linewidth=1.0, label="tolerance" if side > 0 else None)
    axis.set_xlabel("error of the gain [%]")
    axis.set_ylabel("density [1/%]")
    axis.legend(fontsize=7, frameon=False)


def _qq(axis: Axes, rows: pd.DataFrame) -> None:
    """Sorted z-scores against the normal quantiles they should have."""
    z = np.sort(rows["z"].dropna().to_numpy())
    expected = stats.norm.ppf((np.arange(1, len(z) + 1) - 0.5) / len(z))
    keep = np.unique(np.linspace(0, len(z) - 1, min(len(z), MOST_POINTS)).astype(int))
    axis.plot(expected, expected, color="0.5", linewidth=1.0)
    axis.plot(expected[keep], z[keep], ".", markersize=3, color="C0")
    axis.set_xlabel("normal quantile")
    axis.set_ylabel("z = error / claimed sigma")


def _against_true(axis: Axes, rows: pd.DataFrame) -> None:
    """Errors over the gain that was injected."""
    some = rows.iloc[:: max(1, len(rows) // MOST_POINTS)]
    axis.axhline(0.0, color="0.5", linewidth=1.0)
    axis.plot(some["true"], 100.0 * some["rel_error"], ".", markersize=3, color="C0")
    axis.set_xlabel("injected gain [N m / drive unit]")
    axis.set_ylabel("error [%]")


def _percent(share: float | None, form: str = ".3f") -> str:
    return number(None if share is None else 100.0 * share, form, " %")
