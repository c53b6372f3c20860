"""How the page of coverage draws calibrations, and what it says of a joint's intervals."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from scenarios.experiments.studies.calibration import GRID, Calibration
from scenarios.experiments.studies.joint_rows import JointRows
from scenarios.experiments.studies.statistics import Coverage, JointStatistics, coverage


def curves(found: Mapping[str, Calibration], title: str) -> Figure:
    """One panel a calibration, by its name, three in a row."""
    across = min(3, len(found))
    down = -(-len(found) // across)
    figure = Figure(figsize=(4.2 * across, 3.0 * down + 0.5), layout="constrained")
    axes = np.atleast_1d(figure.subplots(down, across, sharex=True, sharey=True)).ravel()
    for axis, (name, each) in zip(axes, found.items(), strict=False):
        _curve(axis, each)
        axis.set_title(f"{name}, {each.trials} trials", fontsize=10)
        axis.tick_params(labelbottom=True, labelleft=True)
    for axis in axes[len(found) :]:
        axis.set_axis_off()
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize=9, frameon=False)
    figure.suptitle(title, fontsize=11)
    return figure


def _curve(axis: Axes, of: Calibration) -> None:
    axis.fill_between(
        GRID,
        of.band.low,
        of.band.high,
        color="0.85",
        linewidth=0.0,
        label="band of the whole curve for correct intervals",
    )
    axis.axhline(0.0, color="0.5", linewidth=1.0)
    axis.plot(GRID, of.difference, color="C0", linewidth=1.2, label="empirical minus uniform distribution of ranks")
    axis.plot(GRID[of.outside], of.difference[of.outside], ".", color="C3", markersize=4, label="outside of it")
    axis.set_xlim(0.0, 1.0)
    axis.set_xlabel("rank of z = error / estimated sigma")
    axis.set_ylabel("share less rank")


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """Where a coverage is wanted, both ends included."""

    low: float
    high: float

    def side(self, found: Coverage) -> Literal["inside", "below", "above"]:
        """Where the share lies."""
        if found.share < self.low:
            return "below"
        return "above" if found.share > self.high else "inside"

    def reached_by(self, found: Coverage) -> bool:
        """Whether the interval of the share has a value that is wanted."""
        return found.low <= self.high and found.high >= self.low


@dataclass(frozen=True, slots=True, kw_only=True)
class JointClaims:
    """What the trials of a study say of one joint's intervals; None where no trial gave a gain.

    Attributes:
        statistics: Errors, refusals, failures.
        gains: Trials that gave one.
        largest: Largest magnitude of the relative error.
        cover_1, cover_2: Share of errors below 1 and 2 estimated standard deviations (normal: 0.683 and 0.954).
        width: Median estimated relative standard deviation, divided by that of the relative errors.
    """

    statistics: JointStatistics
    gains: int
    largest: float | None
    cover_1: Coverage | None
    cover_2: Coverage | None
    width: float | None


def joint_claims(rows: JointRows, statistics: JointStatistics) -> JointClaims:
    """Sum up the intervals of one joint."""
    spread = statistics.spread
    return JointClaims(
        statistics=statistics,
        gains=rows.gains,
        largest=float(np.abs(rows.rel_error).max()) if rows.gains else None,
        cover_1=coverage(np.abs(rows.z) < 1.0),
        cover_2=coverage(np.abs(rows.z) < 2.0),
        width=float(np.median(rows.claimed)) / spread if spread else None,
    )
