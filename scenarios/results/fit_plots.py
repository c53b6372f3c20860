"""Plots of a fit, from its rows: torques measured and reconstructed, spectrum and trends of residuals, outliers."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import signal, stats

from ident.support.arrays import Array
from scenarios.rendering.content import Heading, Paragraph, Part, column, table
from scenarios.rendering.plot import Axis, Mark, Plot, Reference, Series, Tone, one_in, values
from scenarios.results.fit_rows import Fit, FitRows

POINTS, BINS, BANDS = 150, 10, 24
"""Number of points of a scatter plot, of bins of its means, and of frequencies of a spectrum."""
MOST = 1600
"""Largest number of points of a line, more than the pixels of a screen."""
TORQUES = (
    "Gain times current, filtered and decimated as for the fit, and its reconstruction by the fitted model, motions "
    "in sequence. Below: the residual, on a separate scale."
)
SPECTRUM = (
    "White residuals have a spectrum of 1, with 95 % of points between the dashed lines. Larger values at low "
    "frequency indicate slow errors; the filter attenuates high frequencies. Below each plot: autocorrelation at "
    "lag 1."
)
AGAINST = (
    "Points: rows. Bars: means of a tenth of the rows each, plus and minus two standard errors of "
    "uncorrelated rows. A trend indicates an effect missing in the model."
)
FAR = 4.0
"""Standard deviations above which a row is an outlier."""
LISTED = 12


def fit_parts(fit: Fit, names: tuple[str, ...]) -> list[Part]:
    """Return the plots of a fit and the table of its outliers; `names` are those of the motions."""
    spectra = zip(fit.rows, fit.correlation, strict=True)
    parts: list[Part] = [Heading("Torques, measured and reconstructed"), Paragraph(TORQUES)]
    parts += [torque_plot(each, names, fit.begins) for each in fit.rows]
    parts += [Heading("Residual: spectrum", folded=True), Paragraph(SPECTRUM)]
    parts += [spectrum_plot(each, fit.row_period, lag) for each, lag in spectra]
    for what in ("position", "speed"):
        parts += [Heading(f"Residual against {what}", folded=True), Paragraph(AGAINST)]
        parts += [against(each, what) for each in fit.rows]
    return [*parts, Heading("Outliers"), *outliers(fit.rows, names)]


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


def spectrum_plot(rows: FitRows, row_period: float, correlation: float) -> Plot:
    """Return the plot of a residual's spectrum relative to that of white residuals of the same size (Lomb and Scargle).

    `row_period` is in s; `correlation` is that of a row's residual with the next.
    """
    found: list[Array] = []
    lengths = [float(np.ptp(rows.t[rows.motion == k])) for k in np.unique(rows.motion)]
    step = 1.0 / max(lengths)
    frequency = np.arange(step, 0.5 / row_period, step)
    for k in np.unique(rows.motion):
        at = rows.motion == k
        power = signal.lombscargle(rows.t[at], rows.residual[at], 2.0 * np.pi * frequency)
        found.append(power / max(float(np.mean(rows.residual[at] ** 2)), 1e-300))
    wide = max(1, len(frequency) // BANDS)
    whole = len(frequency) // wide * wide
    power = np.mean(found, axis=0)[:whole].reshape(-1, wide).mean(axis=1)
    freedom = 2 * wide * len(found)
    low, high = (float(stats.chi2.ppf(q, freedom) / freedom) for q in (0.025, 0.975))
    return Plot(
        title=f"Joint {rows.joint + 1}",
        caption=f"Autocorrelation at lag 1: {correlation:+.2f}.",
        x=Axis(title="frequency", unit="Hz"),
        y=Axis(title="over white", log=True),
        series=(
            Series(
                label="",
                mark=Mark.LINE,
                x=values(frequency[:whole].reshape(-1, wide).mean(axis=1)),
                y=values(np.maximum(power, 1e-4)),
            ),
        ),
        references=(Reference("", low), Reference("", high)),
        height=110,
    )


def against(rows: FitRows, what: str) -> Plot:
    """Return the plot of a residual over the joint's position or speed, with means of bins."""
    x = rows.q if what == "position" else rows.dq
    y = 100.0 * rows.residual / float(np.sqrt(np.mean(rows.V**2)))
    step = one_in(len(x), POINTS)
    edges = np.quantile(x, np.linspace(0.0, 1.0, BINS + 1))
    where = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, BINS - 1)
    groups = [(x[where == k], y[where == k]) for k in range(BINS) if np.count_nonzero(where == k) > 1]
    mean = np.array([float(np.mean(each)) for _, each in groups])
    error = np.array([2.0 * float(np.std(each, ddof=1)) / np.sqrt(len(each)) for _, each in groups])
    unit = "rad" if rows.turning else "m"
    return Plot(
        title=f"Joint {rows.joint + 1}",
        caption=f"{'Every row' if step == 1 else f'One row in {step}'} of {len(x)}.",
        x=Axis(title=what, unit=unit if what == "position" else f"{unit}/s"),
        y=Axis(title="residual", unit="% of rms"),
        series=(
            Series(label="", mark=Mark.POINTS, tone=Tone.QUIET, x=values(x[::step]), y=values(y[::step])),
            Series(
                label="",
                mark=Mark.INTERVALS,
                tone=Tone.FIRST,
                x=values([float(np.mean(each)) for each, _ in groups]),
                y=values(mean),
                low=values(mean - error),
                high=values(mean + error),
            ),
        ),
        references=(Reference("", 0.0),),
        height=110,
    )


def outliers(rows: Sequence[FitRows], motions: Sequence[str]) -> list[Part]:
    """Return the table of outliers, the largest first, with log times, and the number expected by chance."""
    found = [
        (abs(float(z[k])), each, k)
        for each in rows
        for z in [each.residual / each.sigma if each.sigma > 0.0 else np.zeros(len(each.residual))]
        for k in np.flatnonzero(np.abs(z) > FAR).tolist()
    ]
    many = sum(len(each.t) for each in rows)
    accident = many * 2.0 * float(stats.norm.sf(FAR))
    have = "has a residual" if len(found) == 1 else "have residuals"
    said = (
        f"{len(found)} of {many} rows {have} above {FAR:g} standard deviations of their joint's residual; if "
        f"residuals are normal, {accident:.1f} are expected."
    )
    found.sort(key=lambda each: -each[0])
    listed = table(
        found[:LISTED],
        column("Joint", lambda row: row[1].joint + 1),
        column("Motion", lambda row: motions[int(row[1].motion[row[2]])], words=True),
        column("Time in motion [s]", lambda row: f"{row[1].stamp[row[2]]:.2f}"),
        column("Deviations", lambda row: f"{row[1].residual[row[2]] / row[1].sigma:+.1f}"),
        column("Off by", lambda row: f"{row[1].scale * row[1].residual[row[2]]:+.3g} {row[1].unit}", words=True),
        title="Outliers" if len(found) <= LISTED else f"The {LISTED} largest outliers",
    )
    return [Paragraph(said), *([listed] if found else [])]
