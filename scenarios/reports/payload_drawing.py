"""Manufacturing drawing of a payload: side view and top view with dimensions in millimetres."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ident.support.arrays import Array
from scenarios.design.weights import BRACKET, FACE, MM, Weight

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, STEEL, FLANGE, AXIS = "#222222", "#c9ced6", "#8a9099", "#b03030"


def draw_weight(weight: Weight, *, flange: str) -> "Figure":
    """Return side view and top view at one scale, with the flange's axes and the centre of mass."""
    import matplotlib.pyplot as plt

    figure, (side, top) = plt.subplots(1, 2, figsize=(12.0, 6.6), width_ratios=(1.0, 1.0))
    found, (low, high) = weight.properties, _reach(weight)
    com, largest = found.com / MM, float((high - low).max())
    gap, pad = 0.08 * largest + 6.0, 0.34 * largest + 14.0
    _side_view(side, weight, gap)
    _top_view(top, weight, gap)
    for axes, up, name in ((side, 2, "Side view"), (top, 1, "View onto the flange")):
        axes.plot(
            [com[0]], [com[up]], marker="o", markersize=11, markerfacecolor="white", markeredgecolor=INK, zorder=5
        )
        axes.plot([com[0]], [com[up]], marker="+", markersize=11, color=INK, zorder=6)
        axes.set_xlim(low[0] - pad, high[0] + pad)
        axes.set_ylim(low[up] - pad, high[up] + pad)
        axes.set_aspect("equal")
        axes.axis("off")
        axes.set_title(name, fontsize=11, color=INK)
    where = ", ".join(f"{axis} {value:.1f}" for axis, value in zip("xyz", weight.turned @ com, strict=True))
    bracket = f"; bracket {BRACKET:g} thick" if weight.shape == "bar" else ""
    frame = f"the flange, {flange!r} of the model" if flange else "the flange, at the last joint, z along its axis"
    figure.suptitle(
        f"{weight.shape.capitalize()}: {weight.stated} mm{bracket}\n"
        f"{found.mass:.3f} kg at {weight.density:g} kg/m$^3$; centre of mass [mm] in the axes of {frame}: {where}",
        fontsize=12,
        color=INK,
    )
    note = "All dimensions in mm, ISO 2768-m. Screws and their holes are left out: weigh the finished payload."
    figure.text(0.5, 0.02, note, ha="center", fontsize=9, color=INK)
    plt.close(figure)  # the caller owns the figure; pyplot must not keep it
    return figure


def _reach(weight: Weight) -> tuple[Array, Array]:
    """Return lowest and highest coordinates of payload and flange [mm], each (3,)."""
    corners = [np.array([[-FACE, -FACE, -0.5 * FACE], [FACE, FACE, 0.0]])]
    corners += [np.array(each.center) + np.outer([-0.5, 0.5], each.edges) for each in weight.parts]
    every = np.concatenate(corners)
    return every.min(axis=0), every.max(axis=0)


def _side_view(axes: "Axes", weight: Weight, gap: float) -> None:
    """Draw the side view: the payload's x to the right, z upwards."""
    from matplotlib.patches import Rectangle

    box = partial(Rectangle, facecolor=STEEL, edgecolor=INK, linewidth=1.2)
    axis = partial(axes.plot, color=INK, linewidth=0.6, linestyle="-.")
    axes.add_patch(Rectangle((-FACE, -0.5 * FACE), 2.0 * FACE, 0.5 * FACE, facecolor=FLANGE, edgecolor=INK))
    axes.text(0.0, -0.25 * FACE, "flange", ha="center", va="center", fontsize=8, color="white")
    for part in weight.parts:
        width, _, height = part.edges
        axes.add_patch(box((part.center[0] - width / 2.0, part.center[2] - height / 2.0), width, height))
    (low, high), main = _reach(weight), weight.parts[-1]
    (width, _, height), (x, _, z) = main.edges, main.center
    _dimension(axes, x - width / 2.0, x + width / 2.0, high[2] + gap, z + height / 2.0)
    _dimension(axes, z - height / 2.0, z + height / 2.0, high[0] + gap, x + width / 2.0, upright=True)
    if x:
        axis([x, x], [-0.9 * FACE, high[2] + 0.4 * gap])
        _dimension(axes, 0.0, x, low[2] - 0.8 * gap, low[2])
    if len(weight.parts) > 1:
        _dimension(axes, 0.0, BRACKET, low[0] - 1.6 * gap, low[0], upright=True)
    axis([0.0, 0.0], [low[2] - gap, high[2] + 0.4 * gap])
    _frame(axes, weight, [0, 2])


def _top_view(axes: "Axes", weight: Weight, gap: float) -> None:
    """Draw the view onto the flange: x to the right, y upwards."""
    from matplotlib.patches import Circle, Rectangle

    disc, box = (partial(kind, facecolor=STEEL, edgecolor=INK, linewidth=1.2) for kind in (Circle, Rectangle))
    for part in weight.parts:
        (width, depth, _), (x, y, _) = part.edges, part.center
        flat = disc((x, y), width / 2.0) if part.cylinder else box((x - width / 2.0, y - depth / 2.0), width, depth)
        axes.add_patch(flat)
    axes.add_patch(Circle((0.0, 0.0), FACE, fill=False, edgecolor=INK, linestyle="--", linewidth=0.9))
    low, high = _reach(weight)
    for k, part in enumerate(weight.parts, 1):
        (width, depth, _), (x, y, _) = part.edges, part.center
        if part.cylinder:
            axes.text(x, high[1] + 0.5 * gap, f"\u2300 {width:g}", ha="center", fontsize=9, color=INK)
            continue
        outer = k < len(weight.parts)  # the bracket's dimensions are farther out, on the other side
        level, at = low[1] - (2.2 if outer else 1.0) * gap, low[0] - gap if outer else high[0] + gap
        _dimension(axes, x - width / 2.0, x + width / 2.0, level, y - depth / 2.0)
        edge = x + (-1.0 if outer else 1.0) * width / 2.0
        _dimension(axes, y - depth / 2.0, y + depth / 2.0, at, edge, upright=True)
    _frame(axes, weight, [0, 1])


def _frame(axes: "Axes", weight: Weight, plane: list[int]) -> None:
    """Draw those of the flange's axes that lie in the plane of two of the payload's axes, from the flange's centre."""
    arrow = {"arrowstyle": "-|>", "color": AXIS, "lw": 1.4}
    for name, direction in zip("xyz", weight.turned[:, plane], strict=True):
        if not direction.any():
            continue
        axes.annotate("", xy=tuple(1.5 * FACE * direction), xytext=(0.0, 0.0), arrowprops=arrow)
        x, y = (1.7 * FACE * direction).tolist()
        axes.text(x, y, name, color=AXIS, fontsize=10, ha="center", va="center")


def _dimension(axes: "Axes", a: float, b: float, level: float, edge: float, *, upright: bool = False) -> None:
    """Draw a dimension between two coordinates: extension lines, arrow and number."""

    def at(along: float, across: float) -> tuple[float, float]:
        return (across, along) if upright else (along, across)

    for end in (a, b):
        (x0, y0), (x1, y1) = at(end, edge), at(end, level)
        axes.plot([x0, x1], [y0, y1], color=INK, linewidth=0.5)
    arrow = {"arrowstyle": "<->", "color": INK, "lw": 0.8}
    axes.annotate("", xy=at(a, level), xytext=at(b, level), arrowprops=arrow)
    outside = level > edge
    x, y = at((a + b) / 2.0, level + (3.0 if outside else -3.0) if upright else level)
    sides = ("left" if outside else "right", "center") if upright else ("center", "bottom")
    axes.text(x, y, f"{b - a:g}", ha=sides[0], va=sides[1], fontsize=9, color=INK)
