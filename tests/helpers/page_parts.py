"""Parts of results, and intervals as they are drawn."""

from scenarios.rendering.content import Cell, Table
from scenarios.rendering.plot import Plot
from scenarios.rendering.result import ResultModel


def drawn_intervals(axes) -> list[dict[int, tuple[float, float, float]]]:
    """Value, lower and upper end of joints, by their labels on the x axis, of every series of intervals."""
    names = [int(each.get_text()) for each in axes.get_xticklabels()]
    found = []
    for line, rules in zip(axes.lines, axes.collections, strict=False):
        ends = [segment[:, 1].tolist() for segment in rules.get_segments()]
        values = line.get_xydata().tolist()
        found.append({names[round(at)]: (y, *own) for (at, y), own in zip(values, ends, strict=True)})
    return found


def cells(*texts: str) -> tuple[Cell, ...]:
    """A row of a table."""
    return tuple(map(Cell, texts))


def tables(result: ResultModel) -> list[Table]:
    return [part for part in result.parts() if isinstance(part, Table)]


def plots(result: ResultModel) -> list[Plot]:
    return [part for part in result.parts() if isinstance(part, Plot)]
