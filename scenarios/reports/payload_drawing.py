"""A drawing of a weight: from the side and from above, with its dimensions in millimetres, to make it from."""

from typing import TYPE_CHECKING

import numpy as np

from ident.support.arrays import Array
from scenarios.design.weights import BRACKET, FACE, MM, SHAPES, Part, Weight, mass_properties

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, STEEL, FLANGE, AXIS = "#222222", "#c9ced6", "#8a9099", "#b03030"


def draw_weight(weight: Weight, *, flange: str) -> "Figure":
    """Side view and top view in one scale, the flange's axes and the centre of mass in both.

    Args:
        weight: The weight.
        flange: Name of the site or body of the model that is the flange; empty where none is.
    """
    import matplotlib.pyplot as plt

    figure, (side, top) = plt.subplots(1, 2, figsize=(12.0, 6.6), width_ratios=(1.0, 1.0))
    found = mass_properties(weight.parts, weight.density)
    com = found.com / MM
    _side_view(side, weight, com)
    _top_view(top, weight, com)
    low, high = _reach(weight)
    pad = 0.34 * float((high - low).max()) + 14.0
    for axes, up, name in ((side, 2, "Side view"), (top, 1, "View onto the flange")):
        axes.set_xlim(low[0] - pad, high[0] + pad)
        axes.set_ylim(low[up] - pad, high[up] + pad)
        axes.set_aspect("equal")
        axes.axis("off")
        axes.set_title(name, fontsize=11, color=INK)
    stated = ", ".join(
        f"{each.name} {size:g}" for each, size in zip(SHAPES[weight.shape].dimensions, weight.dimensions, strict=True)
    )
    where = ", ".join(f"{axis} {value:.1f}" for axis, value in zip("xyz", weight.turned @ com, strict=True))
    bracket = f"; bracket {BRACKET:g} thick" if weight.shape == "bar" else ""
    frame = f"the flange, {flange!r} of the model" if flange else "the flange, at the last joint, z along its axis"
    figure.suptitle(
        f"{weight.shape.capitalize()}: {stated} mm{bracket}\n"
        f"{found.mass:.3f} kg at {weight.density:g} kg/m$^3$; centre of mass [mm] in the axes of {frame}: {where}",
        fontsize=12,
        color=INK,
    )
    figure.text(
        0.5,
        0.02,
        "All dimensions in mm, ISO 2768-m. Screws and their holes are left out: weigh the weight when it is made.",
        ha="center",
        fontsize=9,
        color=INK,
    )
    plt.close(figure)  # the caller has it; pyplot need not keep it
    return figure


def _reach(weight: Weight) -> tuple[Array, Array]:
    """Lowest and highest coordinates of weight and flange [mm], each (3,)."""
    corners = [np.array([[-FACE, -FACE, -0.5 * FACE], [FACE, FACE, 0.0]])]
    for part in weight.parts:
        half = np.array(_edges(part)) / 2.0
        corners.append(np.array(part.center) + np.outer([-1.0, 1.0], half))
    every = np.concatenate(corners)
    return every.min(axis=0), every.max(axis=0)


def _edges(part: Part) -> tuple[float, float, float]:
    """Extent along x, y and z [mm]."""
    a, b, c = (part.size[0], *part.size) if part.cylinder else part.size
    return a, b, c


def _side_view(axes: "Axes", weight: Weight, com: Array) -> None:
    """The weight's x to the right, z upwards."""
    from matplotlib.patches import Rectangle

    axes.add_patch(Rectangle((-FACE, -0.5 * FACE), 2.0 * FACE, 0.5 * FACE, facecolor=FLANGE, edgecolor=INK))
    axes.text(0.0, -0.25 * FACE, "flange", ha="center", va="center", fontsize=8, color="white")
    for part in weight.parts:
        width, _, height = _edges(part)
        x, z = part.center[0] - width / 2.0, part.center[2] - height / 2.0
        axes.add_patch(Rectangle((x, z), width, height, facecolor=STEEL, edgecolor=INK, linewidth=1.2))
    low, high = _reach(weight)
    gap = 0.08 * float((high - low).max()) + 6.0
    main = weight.parts[-1]
    width, _, height = _edges(main)
    x, z = main.center[0], main.center[2]
    _across(axes, x - width / 2.0, x + width / 2.0, high[2] + gap, z + height / 2.0)
    _upright(axes, z - height / 2.0, z + height / 2.0, high[0] + gap, x + width / 2.0)
    if main.center[0]:
        axes.plot([x, x], [-0.9 * FACE, high[2] + 0.4 * gap], color=INK, linewidth=0.6, linestyle="-.")
        _across(axes, 0.0, x, low[2] - 0.8 * gap, low[2])
    if len(weight.parts) > 1:
        _upright(axes, 0.0, BRACKET, low[0] - gap, low[0])
    axes.plot([0.0, 0.0], [low[2] - gap, high[2] + 0.4 * gap], color=INK, linewidth=0.6, linestyle="-.")
    _frame(axes, np.array([1.0, 0.0]), np.array([0.0, 1.0]), _axis_names(weight)[0], "z")
    _center(axes, com[0], com[2])


def _top_view(axes: "Axes", weight: Weight, com: Array) -> None:
    """Seen from outside: x to the right, y upwards."""
    from matplotlib.patches import Circle, Rectangle

    for part in weight.parts:
        width, depth, _ = _edges(part)
        x, y = part.center[0], part.center[1]
        if part.cylinder:
            axes.add_patch(Circle((x, y), width / 2.0, facecolor=STEEL, edgecolor=INK, linewidth=1.2))
        else:
            corner = (x - width / 2.0, y - depth / 2.0)
            axes.add_patch(Rectangle(corner, width, depth, facecolor=STEEL, edgecolor=INK, linewidth=1.2))
    axes.add_patch(Circle((0.0, 0.0), FACE, fill=False, edgecolor=INK, linestyle="--", linewidth=0.9))
    low, high = _reach(weight)
    gap = 0.08 * float((high - low).max()) + 6.0
    last = len(weight.parts) - 1
    for k, part in enumerate(weight.parts):
        width, depth, _ = _edges(part)
        outer = k < last  # the bracket's dimensions stand farther out
        x, y = part.center[0], part.center[1]
        if part.cylinder:
            axes.text(x, high[1] + 0.5 * gap, f"\u2300 {width:g}", ha="center", fontsize=9, color=INK)
            continue
        level = low[1] - (2.2 if outer else 1.0) * gap
        _across(axes, x - width / 2.0, x + width / 2.0, level, y - depth / 2.0)
        at = low[0] - gap if outer else high[0] + gap
        _upright(axes, y - depth / 2.0, y + depth / 2.0, at, x + (-1.0 if outer else 1.0) * width / 2.0)
    along, across = weight.turned.T @ np.eye(3)[:, 0], weight.turned.T @ np.eye(3)[:, 1]
    _frame(axes, along[:2], across[:2], "x", "y")
    _center(axes, com[0], com[1])


def _axis_names(weight: Weight) -> tuple[str, str]:
    """Which of the flange's axes lie along the weight's x and y."""
    return (("x", "y"), ("y", "\u2212x"), ("\u2212x", "\u2212y"), ("\u2212y", "x"))[weight.quarter % 4]


def _frame(axes: "Axes", first: Array, second: Array, first_name: str, second_name: str) -> None:
    """Two of the flange's axes, from its centre."""
    for direction, name in ((first, first_name), (second, second_name)):
        tip = 1.5 * FACE * direction
        axes.annotate(
            "", xy=(tip[0], tip[1]), xytext=(0.0, 0.0), arrowprops={"arrowstyle": "-|>", "color": AXIS, "lw": 1.4}
        )
        label = 1.7 * FACE * direction
        axes.text(label[0], label[1], name, color=AXIS, fontsize=10, ha="center", va="center")


def _center(axes: "Axes", x: float, y: float) -> None:
    """The centre of mass."""
    axes.plot([x], [y], marker="o", markersize=11, markerfacecolor="white", markeredgecolor=INK, zorder=5)
    axes.plot([x], [y], marker="+", markersize=11, color=INK, zorder=6)


def _across(axes: "Axes", a: float, b: float, level: float, edge: float) -> None:
    """A horizontal dimension, its number above the line."""
    for x in (a, b):
        axes.plot([x, x], [edge, level], color=INK, linewidth=0.5)
    axes.annotate("", xy=(a, level), xytext=(b, level), arrowprops={"arrowstyle": "<->", "color": INK, "lw": 0.8})
    axes.text((a + b) / 2.0, level, f"{b - a:g}", ha="center", va="bottom", fontsize=9, color=INK)


def _upright(axes: "Axes", a: float, b: float, level: float, edge: float) -> None:
    """A vertical dimension, its number beside the line."""
    axes.plot([edge, level], [a, a], color=INK, linewidth=0.5)
    axes.plot([edge, level], [b, b], color=INK, linewidth=0.5)
    axes.annotate("", xy=(level, a), xytext=(level, b), arrowprops={"arrowstyle": "<->", "color": INK, "lw": 0.8})
    outside = level > edge
    axes.text(
        level + (3.0 if outside else -3.0),
        (a + b) / 2.0,
        f"{b - a:g}",
        ha="left" if outside else "right",
        va="center",
        fontsize=9,
        color=INK,
    )
