"""Plots by Matplotlib as static SVG, whose colours are names of the style sheet."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from io import StringIO
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, NullFormatter, StrMethodFormatter

from ident.support.arrays import Array
from scenarios.rendering.plot import Axis, Plot, Series, Value

COLOURS = {
    "paper": "#ffffff", "ink": "#1b1f24", "soft": "#57606a", "grid": "#d0d7de", "band": "#e4e8ee", "quiet": "#6e7781",
    "first": "#1f5fa8", "second": "#b93f12", "third": "#1c7a57", "fourth": "#7a3ea1",
}  # fmt: skip
"""Colours by their names in the style sheet (`page.css`), where they differ in the dark and on paper."""
WIDTH, WIDE = 430, 620
"""Width of a plot, and of one along time [pixel]."""
LEFT, RIGHT, BELOW, GAP = 62, 10, 36, 8
"""Margins of axes, and the gap above a strip [pixel]."""
STRIP = 80
"""Height below which a plot has few ticks [pixel]."""
ROW = 19
"""Least height of a category [pixel]."""
SETTINGS: Any = {  # keys that the stubs of Matplotlib enumerate
    "svg.fonttype": "none",
    "text.parse_math": False,
    "font.size": 10.5,
    "text.color": COLOURS["ink"],
    "axes.labelcolor": COLOURS["ink"],
    "axes.edgecolor": COLOURS["grid"],
    "axes.facecolor": "none",
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.limits": (-4, 5),
    "axes.linewidth": 1.0,
    "grid.color": COLOURS["grid"],
    "grid.linewidth": 0.7,
    "xtick.color": COLOURS["grid"],
    "ytick.color": COLOURS["grid"],
    "xtick.labelcolor": COLOURS["ink"],
    "ytick.labelcolor": COLOURS["ink"],
    "legend.frameon": False,
    "legend.fontsize": 9.5,
}


@dataclass(frozen=True, slots=True)
class Style:
    """Appearance of a tone: colour, dash pattern [points], shape of points, width of lines, opacity of bars."""

    colour: str
    dash: tuple[float, ...]
    shape: str
    width: float
    fill: float


STYLES = {
    "first": Style(COLOURS["first"], (), "o", 1.6, 1.0),
    "second": Style(COLOURS["second"], (4.0, 1.6), "s", 1.2, 0.65),
    "third": Style(COLOURS["third"], (2.5, 1.0), "^", 1.4, 0.35),
    "fourth": Style(COLOURS["fourth"], (6.0, 2.0, 1.0, 2.0), "D", 1.2, 0.15),
    "quiet": Style(COLOURS["quiet"], (), "o", 1.0, 0.25),
}
"""Every tone differs from the others in shape, dash or opacity as well, without its colour."""


def svg(plot: Plot, number: int) -> str:
    """Return a plot as an SVG element without size, and with colours of the style sheet.

    `number` distinguishes its identifiers from those of other plots on a page.
    """
    with rc_context({**SETTINGS, "svg.hashsalt": f"plot{number}"}):
        drawn = StringIO()
        figure(plot).savefig(drawn, format="svg", transparent=True, metadata={"Date": None})
    text = drawn.getvalue()
    for pattern, short in (
        (r"<metadata>.*?</metadata>|<!--.*?-->", ""),
        (r'<g id="[^"]*"', "<g"),  # of no use, and the same in every figure
        (r"font: ([\d.]+px) [^;\"]*", r"font-size: \1"),  # the family is that of the page
        (r"(\d\.\d\d)\d+(?=[^<>]*/?>)", r"\1"),  # hundredths of a pixel
        (r'(<svg[^>]*?) width="[\d.]+pt"', r"\1"),
        (r'(<svg[^>]*?) height="[\d.]+pt"', r"\1"),
        (r"\s*\n\s*", "\n"),
    ):
        text = re.sub(pattern, short, text, flags=re.DOTALL)
    for name, colour in COLOURS.items():
        text = text.replace(colour, f"var(--{name})")
    return text[text.index("<svg") :]


def figure(plot: Plot) -> Figure:
    """Draw a plot without its title, with the strip below it, if it has one."""
    labelled = bool(plot.bands) or any(each.label for each in plot.series)
    inner = max(plot.height, ROW * len(plot.y.categories) * max(1, len(_beside(plot))))
    strip = 0 if plot.strip is None else plot.strip.height + GAP
    width, height = WIDE if plot.zoom else WIDTH, 8 + 16 * labelled + inner + BELOW + strip
    longest = max((len(name) for name in plot.y.categories), default=0)
    left = min(max(LEFT, 6.0 * longest + 30.0), 0.5 * width)
    with rc_context(SETTINGS):
        whole = Figure(figsize=(width / 72.0, height / 72.0))

        def axes_at(bottom: float, high: float, above: Axes | None = None) -> Axes:
            place = (left / width, bottom / height, (width - left - RIGHT) / width, high / height)
            return whole.add_axes(place, sharex=above)

        axes = axes_at(BELOW + strip, inner)
        if plot.strip is not None:
            axes.tick_params(labelbottom=False)
            _draw(axes_at(BELOW, plot.strip.height, axes), plot.strip)
        _draw(axes, plot)
        if labelled:
            axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, borderpad=0.2, columnspacing=1.2)
        return whole


def _draw(axes: Axes, plot: Plot) -> None:
    for k, (start, stop) in enumerate(plot.bands):
        axes.axvspan(start, stop, color=COLOURS["band"], lw=0.0, zorder=0.5, label=plot.bands_label if not k else None)
    for axis, name in ((plot.x, "x"), (plot.y, "y")):
        own = axes.xaxis if name == "x" else axes.yaxis
        low = name == "y" and plot.height < STRIP  # its label would overlap that of the plot above
        axes.set(**{f"{name}label": axis.words.replace(" [", "\n[") if low else axis.words})
        if axis.categories:
            at = np.arange(len(axis.categories))
            own.set_ticks(at, labels=list(axis.categories))
            axes.set(**{f"{name}lim": (-0.6, len(at) - 0.4) if name == "x" else (len(at) - 0.4, -0.6)})
            own.grid(visible=False)
        elif axis.log:
            axes.set(**{f"{name}scale": "log"})
            own.set_major_formatter(StrMethodFormatter("{x:g}"))
            own.set_minor_formatter(NullFormatter())
        else:
            own.set_major_locator(MaxNLocator(6 if name == "x" else 3 if plot.height < STRIP else 5))
    for each in plot.series:
        _series(axes, each, plot)
    look: dict[str, Any] = {"color": COLOURS["ink"], "lw": 0.9, "ls": (0.0, (2.5, 2.5))}
    words: dict[str, Any] = {"fontsize": 9.0, "clip_on": False, "textcoords": "offset points"}
    for each in plot.references:
        if each.upright:
            axes.axvline(each.at, **look)
            place: dict[str, Any] = {"xycoords": ("data", "axes fraction"), "xytext": (3, -3), "va": "top"}
            axes.annotate(each.label, (each.at, 1.0), **place, **words)
        else:
            axes.axhline(each.at, **look)
            place = {"xycoords": ("axes fraction", "data"), "xytext": (-3, 3), "ha": "right"}
            axes.annotate(each.label, (1.0, each.at), **place, **words)
    if plot.y.zero:
        axes.set_ylim(min(axes.get_ylim()[0], 0.0), max(axes.get_ylim()[1], 0.0))
    if plot.x.zero:
        axes.set_xlim(min(axes.get_xlim()[0], 0.0), max(axes.get_xlim()[1], 0.0))
    if plot.zoom:
        axes.margins(x=0.01)


def _numbers(values: Sequence[Value], axis: Axis) -> Array:
    """Return coordinates; of a category its place."""
    places = {name: float(k) for k, name in enumerate(axis.categories)}
    return np.array([math.nan if v is None else places[v] if isinstance(v, str) else v for v in values])


def _beside(plot: Plot) -> list[str]:
    """Return the labels of series that share categories and are drawn beside each other."""
    if not plot.x.categories and not plot.y.categories:
        return []
    among = [each for each in plot.series if each.mark in ("bars", "intervals")]
    return [each.label for each in among if each.mark == "bars" or each.tone != "quiet"]


def _series(axes: Axes, series: Series, plot: Plot) -> None:
    style, upright, beside = STYLES[series.tone], not plot.y.categories, _beside(plot)
    x, y = _numbers(series.x, plot.x), _numbers(series.y, plot.y)
    low, high = (_numbers(ends, plot.y if upright else plot.x) for ends in (series.low, series.high))
    at, value = (x, y) if upright else (y, x)
    width, label = 0.75, series.label or None
    if len(beside) > 1 and series.label in beside:
        width /= len(beside)
        at = at + (beside.index(series.label) - 0.5 * (len(beside) - 1)) * width
    bar, rule = (axes.bar, axes.vlines) if upright else (axes.barh, axes.hlines)
    look: dict[str, Any] = {"color": style.colour, "label": label}
    match series.mark:
        case "line":
            dash = (0.0, style.dash) if style.dash else "solid"
            axes.plot(x, y, lw=style.width, ls=dash, **look)
        case "points":
            axes.plot(x, y, style.shape, ms=2.2, mew=0.0, alpha=0.75, **look)
        case "bars":
            face: dict[str, Any] = {"alpha": style.fill, "edgecolor": COLOURS["ink"], "linewidth": 0.5}
            bar(at, value, width, **face, **look)
            if len(low):
                rule(at, low, high, color=COLOURS["ink"], lw=1.0)
        case "intervals" if series.tone == "quiet":
            span: dict[str, Any] = {"color": COLOURS["band"], "zorder": 0.6, "label": label}
            bar(at, high - low, 0.2, low, **span)  # `barh` names the third argument height, and the fourth left
        case "intervals":
            rule(at, low, high, color=style.colour, lw=1.8)
            axes.plot(*((at, value) if upright else (value, at)), style.shape, ms=5.0, **look)
