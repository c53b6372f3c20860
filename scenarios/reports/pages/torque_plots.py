"""Plots of measured and reconstructed torques of each joint, with residuals."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ident.support.arrays import Array
from scenarios.reports.plot import Axis, Mark, Plot, Reference, Series, Tone, one_in, values
from scenarios.results.fit_rows import FitRows

MOST = 1600
"""Largest number of points of a line, more than the pixels of a screen."""
TOLD = (
    "Gain times current, filtered and decimated as for the fit, and its reconstruction by the fitted model, motions "
    "in sequence. Below: the residual, on a separate scale. Drag to pan; zoom with Ctrl and the wheel, or with the "
    "buttons. All joints show the same time range."
)


def torque_plot(rows: FitRows, motions: Sequence[str], begins: Sequence[float]) -> Plot:
    """Return the plot of measured and reconstructed torque of a joint, and of the residual.

    `begins` has the start times of the motions and the end of the last one [s].
    """
    step = one_in(len(rows.t), MOST)
    measured, predicted = rows.scale * rows.V, rows.scale * (rows.V - rows.residual)

    def line(label: str, numbers: Array, tone: Tone) -> Series:
        t, y = rows.broken(numbers)
        keep = np.sort(np.r_[np.flatnonzero(np.isnan(y)), np.flatnonzero(~np.isnan(y))[::step]])
        return Series(label=label, mark=Mark.LINE, tone=tone, x=values(t[keep]), y=values(y[keep]))

    time = Axis(title="time", unit="s")
    title = f"Joint {rows.joint + 1}"
    strip = Plot(
        title=f"{title}, residual",
        caption="",
        x=time,
        y=Axis(title="residual", unit=rows.unit if rows.unit != "drive units" else "units"),
        series=(line("Residual", rows.scale * rows.residual, Tone.FIRST),),
        references=(Reference("", 0.0),),
        zoom=True,
        height=50,
    )
    share = float(np.linalg.norm(rows.residual) / np.linalg.norm(rows.V))
    what = "Gain times current" if rows.unit != "drive units" else "Current (the gain is refused)"
    every = "every row" if step == 1 else f"one row in {step}"
    return Plot(
        title=title,
        caption=f"{what}; residual {100.0 * share:.2g} % of its rms. Shown: {every} of {len(rows.t)}.",
        x=replace(time, title="", unit=""),
        y=Axis(title="torque" if rows.unit == "N m" else "force" if rows.unit == "N" else "current", unit=rows.unit),
        series=(line("Measured", measured, Tone.FIRST), line("Reconstructed", predicted, Tone.SECOND)),
        bands=tuple((float(a), float(b)) for a, b in np.round(rows.still, 3)),
        bands_label="Near a reversal (excluded)",
        references=tuple(
            Reference(name, round(at, 3), upright=True) for name, at in zip(motions, begins, strict=False)
        ),
        zoom=True,
        height=170,
        strip=strip,
    )
