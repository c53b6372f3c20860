"""Figure 3 of the paper, from the simulated experiment."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from scenarios.benchmark.paper.experiment import IDENTIFIED


def figure_3(torques: pd.DataFrame) -> Figure:
    """Draw measured and reconstructed torques of joints 1 to 4, both motions in sequence."""
    end = float(torques["t"].to_numpy().max())
    figure = Figure(figsize=(10, 9), layout="constrained")
    axes = figure.subplots(IDENTIFIED, 1, sharex=True)
    for j, axis in enumerate(axes):
        for loaded in (False, True):
            rows = torques.query("joint == @j + 1 and loaded == @loaded")
            t, torque, model = rows[["t", "measured", "reconstructed"]].to_numpy().T
            t = t + loaded * end
            gaps = np.flatnonzero(np.diff(t) > 1.5 * np.median(np.diff(t))) + 1  # rows removed near reversals
            t, torque, model = (np.insert(x, gaps, np.nan) for x in (t, torque, model))
            axis.plot(t, torque, color="#1f5fa8", lw=1.6, label=None if loaded else "measured, gain times current")
            axis.plot(t, model, color="#d1481f", lw=0.9, label=None if loaded else "reconstructed, W chi")
            axis.plot(t, torque - model, color="#8a8a8a", lw=0.7, label=None if loaded else "difference")
        axis.axvline(end, color="black", lw=0.6, ls=":")
        axis.set_ylabel(f"joint {j + 1} [N m]")
        axis.margins(x=0.01)
    axes[0].set_title("7.025 kg payload", loc="right", fontsize=10)
    axes[0].set_title("bare flange", loc="left", fontsize=10)
    axes[0].legend(loc="upper center", ncols=3, fontsize=8, frameon=False, bbox_to_anchor=(0.5, 1.22))
    axes[-1].set_xlabel("time [s]")
    return figure
