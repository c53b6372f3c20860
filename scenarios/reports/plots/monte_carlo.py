"""Figures of a Monte Carlo study: one panel per joint, with common axes; joints without a gain are named."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy import stats

from ident.support.arrays import Array
from scenarios.experiments.statistics import JointRows
from scenarios.reports.error_density import promised, reach

MOST_POINTS = 5000
"""Largest number of points of a scatter plot."""
BINS = (20, 120)
"""Smallest and largest number of bins of the common axis of histograms."""
NEAR = 2.0
"""The axis includes a tolerance up to this multiple of the errors."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Subject:
    """Title of a figure: scenario, and joints without a panel."""

    title: str
    without: tuple[int, ...]


def histograms(found: Mapping[int, JointRows], subject: Subject) -> Figure:
    """Draw errors, the density implied by the estimated standard deviations, and the tolerance."""
    widest = max(reach(rows) for rows in found.values())
    tolerances = [100.0 * rows.tolerance for rows in found.values()]
    widest = max([widest, *(1.1 * t for t in tolerances if t <= NEAR * widest)])
    narrowest = min(_bin_width(rows) for rows in found.values())
    bins = int(np.clip(2.0 * widest / narrowest, *BINS))
    edges = np.linspace(-widest, widest, bins + 1)
    return _figure(found, subject, lambda axis, rows: _histogram(axis, rows, edges))


def quantiles(found: Mapping[int, JointRows], subject: Subject) -> Figure:
    """Draw sorted z-scores over normal quantiles."""
    return _figure(found, subject, _qq)


def against_true(found: Mapping[int, JointRows], subject: Subject) -> Figure:
    """Draw errors over the injected gain."""
    most = NEAR * max(reach(rows) for rows in found.values())
    return _figure(found, subject, lambda axis, rows: _against_true(axis, rows, most))


def _figure(found: Mapping[int, JointRows], subject: Subject, draw: Callable[[Axes, JointRows], None]) -> Figure:
    """Return one panel per joint, three in a row, with common axes."""
    across = min(3, len(found))
    down = -(-len(found) // across)
    figure = Figure(figsize=(4.2 * across, 3.2 * down + 0.5), layout="constrained")
    axes = np.atleast_1d(figure.subplots(down, across, sharex=True, sharey=True)).ravel()
    for axis, (joint, rows) in zip(axes, found.items(), strict=False):
        draw(axis, rows)
        axis.set_title(f"joint {joint}", fontsize=10)
        axis.tick_params(labelbottom=True, labelleft=True)
    for axis in axes[len(found) :]:
        axis.set_axis_off()
    names = ", ".join(map(str, subject.without))
    without = f"\nnot shown: joint {names}, refused or always with the same error" if names else ""
    figure.suptitle(f"{subject.title}{without}", fontsize=11)
    return figure


def _histogram(axis: Axes, rows: JointRows, edges: Array) -> None:
    error = 100.0 * rows.rel_error
    counts, _ = np.histogram(error, bins=edges)
    axis.hist(edges[:-1], bins=edges.tolist(), weights=counts, density=True, color="0.8", label="errors")
    x = np.linspace(edges[0], edges[-1], 400)
    axis.plot(x, promised(rows, x), color="C0", label="estimated")
    tolerance = 100.0 * rows.tolerance
    if tolerance <= edges[-1]:
        for side in (-tolerance, tolerance):
            label = "tolerance" if side > 0 else None
            axis.axvline(side, color="C3", linestyle="--", linewidth=1.0, label=label)
    else:
        axis.plot([], [], color="C3", linestyle="--", label=f"tolerance: beyond, ± {tolerance:.3g} %")
    axis.set_xlabel("error of the gain [%]")
    axis.set_ylabel("density [1/%]")
    axis.legend(loc="upper right", fontsize=7, framealpha=1.0, edgecolor="none")


def _qq(axis: Axes, rows: JointRows) -> None:
    z = np.sort(rows.z[~np.isnan(rows.z)])
    keep = np.unique(np.linspace(0, len(z) - 1, min(len(z), MOST_POINTS)).astype(int))
    expected = stats.norm.ppf((keep + 0.5) / len(z))
    axis.plot(expected, expected, color="0.5", linewidth=1.0)
    axis.plot(expected, z[keep], ".", markersize=3, color="C0")
    axis.set_xlabel("normal quantile")
    axis.set_ylabel("z = error / estimated sigma")


def _against_true(axis: Axes, rows: JointRows, most: float) -> None:
    axis.axhline(0.0, color="0.5", linewidth=1.0)
    true, error = rows.true / np.median(rows.true), 100.0 * rows.rel_error[:: rows.step]
    axis.plot(true, error, ".", markersize=3, color="C0")
    tolerance = 100.0 * rows.tolerance
    if tolerance <= most:
        for side in (-tolerance, tolerance):
            axis.axhline(side, color="C3", linestyle="--", linewidth=1.0, label="tolerance" if side > 0 else None)
    else:
        axis.plot([], [], color="C3", linestyle="--", label=f"tolerance: beyond, ± {tolerance:.3g} %")
    axis.legend(loc="upper right", fontsize=7, framealpha=1.0, edgecolor="none")
    axis.set_xlabel("injected gain / median")
    axis.set_ylabel("error [%]")


def _bin_width(rows: JointRows) -> float:
    edges = np.histogram_bin_edges(100.0 * rows.rel_error, bins="fd")
    return float(edges[1] - edges[0])
