"""Plots of results: a title, a caption, and a function of Matplotlib's axes; static SVG on pages, omitted in text.

Matplotlib is imported when a page is drawn. Colours of the SVG are names of the style sheet.
"""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {
    "ink": "#1b1f24", "grid": "#d0d7de", "band": "#e4e8ee",
    "first": "#1f5fa8", "second": "#b93f12", "third": "#1c7a57", "fourth": "#7a3ea1",
}  # fmt: skip
"""Colours by their names in the style sheet (`page.css`), where they differ in the dark and on paper."""
SERIES: tuple[tuple[str, Any, float, str, float], ...] = (
    ("first", "-", 1.6, "o", 1.0),
    ("second", (0.0, (4.0, 1.6)), 1.2, "s", 0.65),
    ("third", (0.0, (2.5, 1.0)), 1.4, "^", 0.35),
    ("fourth", (0.0, (6.0, 2.0, 1.0, 2.0)), 1.2, "D", 0.15),
)
"""Colour, dashes and width of lines [points], shape of points and opacity of bars: distinct without the colour."""
LIMIT: Any = {"color": COLOURS["ink"], "lw": 0.9, "ls": (0.0, (2.5, 2.5))}
"""Look of a reference line."""
WIDTH, WIDE = 430, 520
"""Width of a plot, and of one along time [pixel]."""
STYLE = Path(__file__).with_name("page.mplstyle")


@dataclass(frozen=True, slots=True, kw_only=True)
class Plot:
    """A plot."""

    title: str
    caption: str  # one or two sentences, including omitted data
    x: str  # label of the axis: quantity and unit
    y: str
    draw: Callable[..., None]  # draws on axes of Matplotlib, as many as `heights`
    wide: bool = False  # along time
    heights: tuple[int, ...] = (180,)  # of axes with one x axis, from the top [pixel]

    @property
    def alternative(self) -> str:
        """Text instead of the plot."""
        return f"{self.title}: {self.y or self.x}. {self.caption}"

    def figure(self) -> "Figure":
        """Draw it without its title."""
        from matplotlib.figure import Figure

        size = (WIDE if self.wide else WIDTH) / 72.0, (sum(self.heights) + 60) / 72.0
        whole = Figure(figsize=size, layout="constrained")
        axes = whole.subplots(len(self.heights), sharex=True, squeeze=False, height_ratios=self.heights)[:, 0]
        for each in axes if self.wide else ():
            each.margins(x=0.01)
        axes[-1].set_xlabel(self.x)
        axes[0].set_ylabel(self.y)
        self.draw(*axes)
        if labels := axes[0].get_legend_handles_labels()[1]:
            columns = 4 if sum(map(len, labels)) < 60 else 2  # 60 characters fit on a line
            whole.legend(*axes[0].get_legend_handles_labels(), loc="outside upper left", ncols=columns)
        return whole

    def svg(self, number: int) -> str:
        """Return an SVG element in colours of the style sheet; `number` keeps its identifiers apart on a page."""
        from cycler import cycler
        from matplotlib import style

        colour, dashes, widths, _, _ = zip(*SERIES, strict=True)
        lines = cycler(color=[COLOURS[name] for name in colour], linestyle=dashes, linewidth=widths)
        own: Any = {"axes.prop_cycle": lines, "svg.hashsalt": f"plot{number}"}  # keys that stubs enumerate
        with style.context([STYLE, own]):
            drawn = StringIO()
            self.figure().savefig(drawn, format="svg", transparent=True, metadata={"Date": None})
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
        for name, value in COLOURS.items():
            text = text.replace(value, f"var(--{name})")
        return text[text.index("<svg") :]


def draw_bars(axes: "Axes", joints: Sequence[int], series: Mapping[str, Mapping[int, float]]) -> None:
    """Draw numbers of joints, by the labels of up to four series; a joint without a number stays empty."""
    for k, (label, found) in enumerate(series.items()):
        at, width = _beside(axes, joints, found, k, len(series))
        colour, _, _, _, fill = SERIES[k]
        edge = COLOURS[colour]  # opaque, so that a pale bar is seen
        axes.bar(at, list(found.values()), width, label=label, color=(edge, fill), edgecolor=edge, lw=0.9)


def intervals_plot(
    title: str,
    caption: str,
    y: str,
    joints: Sequence[int],
    series: Mapping[str, Mapping[int, tuple[float, float, float]]],
    *,
    limit: float | None = None,
) -> Plot:
    """Return a plot of value, lower and upper end for joints, by the labels of series, and a `limit`, dashed."""

    def draw(axes: "Axes") -> None:
        for k, (label, found) in enumerate(series.items()):
            at, _ = _beside(axes, joints, found, k, len(series))
            colour, _, _, shape, _ = SERIES[k % len(SERIES)]
            value, low, high = ([ends[i] for ends in found.values()] for i in range(3))
            axes.vlines(at, low, high, color=COLOURS[colour], lw=1.8)
            axes.plot(at, value, shape, ms=5.0, color=COLOURS[colour], label=label)
        if limit is not None:
            axes.axhline(limit, **LIMIT)

    return Plot(title=title, caption=caption, x="Joint", y=y, draw=draw)


def _beside(axes: "Axes", joints: Sequence[int], found: Iterable[int], k: int, count: int) -> tuple[list[float], float]:
    """Name joints on the x axis; return where the k-th of `count` series stands, and its width."""
    axes.set_xticks(range(len(joints)), list(map(str, joints)))
    axes.set_xlim(-0.6, len(joints) - 0.4)
    axes.grid(visible=False, axis="x")
    width = 0.75 / count
    return [joints.index(joint) + (k - 0.5 * (count - 1)) * width for joint in found], width
