"""Draws architecture.png: the folders of `ident` and `scenarios`, and which of them import which."""

import ast
from collections import defaultdict
from pathlib import Path

from matplotlib.figure import Figure

HOME = Path(__file__).parent
ROOT = HOME.parent
PACKAGES = ("ident", "scenarios")
BOX, INK, FILL = 0.36, "#37474f", {"ident": "#e0f2f1", "scenarios": "#e8eaf6"}

Folders = dict[str, set[str]]
"""What each folder imports from."""


def imports(package: str) -> Folders:
    """The folders of a package, those of other packages left out; modules in its root are none."""
    there = {path.name for path in (ROOT / package).iterdir() if list(path.glob("*.py"))}
    found: Folders = {name: set() for name in there}
    for path in (ROOT / package).rglob("*.py"):
        own = path.relative_to(ROOT / package).parts[0]
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if own in there and isinstance(node, ast.ImportFrom) and (node.module or "").startswith(f"{package}."):
                found[own].add(str(node.module).split(".")[1])
    return {name: others & there - {name} for name, others in found.items()}


def without_shortcuts(folders: Folders) -> Folders:
    """Only the imports that no chain of others implies."""

    def reached(name: str) -> set[str]:
        return folders[name].union(*(reached(other) for other in folders[name]))

    return {
        name: {other for other in others if not any(other in reached(between) for between in others - {other})}
        for name, others in folders.items()
    }


def levels(folders: Folders) -> dict[str, int]:
    """How many folders stand below each, one on the other."""

    def level(name: str) -> int:
        return 1 + max((level(other) for other in folders[name]), default=-1)

    return {name: level(name) for name in folders}


def drawn() -> Figure:
    """The picture: a column a package, what is imported below what imports it."""
    figure = Figure(figsize=(9.5, 6.5), layout="constrained")
    for axes, package in zip(figure.subplots(1, 2, width_ratios=(3, 3.4)), PACKAGES, strict=True):
        folders = imports(package)
        rows = defaultdict[int, list[str]](list)
        for name, level in sorted(levels(folders).items()):
            rows[level].append(name)
        place = {name: (k - 0.5 * (len(row) - 1), level) for level, row in rows.items() for k, name in enumerate(row)}
        for name, others in without_shortcuts(folders).items():
            for other in others:
                (x, y), (below_x, below_y) = place[name], place[other]
                arrow = {"arrowstyle": "-|>", "color": INK, "lw": 1.0, "shrinkA": 0, "shrinkB": 0}
                axes.annotate("", (below_x, below_y + 0.5 * BOX), (x, y - 0.5 * BOX), arrowprops=arrow)
        for name, (x, y) in place.items():
            box = {"boxstyle": "round,pad=0.45", "facecolor": FILL[package], "edgecolor": INK}
            axes.text(x, y, name, ha="center", va="center", fontsize=9, bbox=box)
        width = max(len(row) for row in rows.values())
        axes.set(xlim=(-0.5 * width, 0.5 * width), ylim=(-0.6, max(rows) + 0.6))
        axes.set_title(package, fontsize=12)
        axes.axis("off")
    return figure


if __name__ == "__main__":
    drawn().savefig(HOME / "architecture.png", dpi=130)
