"""The picture of calibrations: a panel a joint and one for all together, on the same axes."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from scenarios.experiments.studies.calibration import GRID, Calibration


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
    axis.set_xlabel("rank of z = error / claimed sigma")
    axis.set_ylabel("share less rank")
