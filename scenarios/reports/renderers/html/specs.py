"""Vega-Lite specification of a plot; the page inserts the data.

Colours are names of the style sheet, with values for light, dark and print.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from scenarios.reports.plot import Axis, Mark, Plot, Reference, Series, Tone

Spec = dict[str, object]
ROW, STRIPE = 17, 22
"""Least height of a category, and width of a band behind intervals [pixel]."""


@dataclass(frozen=True, slots=True)
class Style:
    """Appearance of a style.

    Attributes:
        colour: Name in the style sheet.
        dash: Dash pattern of a line, as in SVG.
        shape: Shape of a point.
        width: Width of a line [pixel].
        fill: Opacity of a bar.
    """

    colour: str
    dash: tuple[int, ...]
    shape: str
    width: float
    fill: float

    @property
    def quiet(self) -> bool:
        """Whether it is drawn behind the others."""
        return self == STYLES[Tone.QUIET]


STYLES = {
    Tone.FIRST: Style("var(--first)", (), "circle", 1.8, 1.0),
    Tone.SECOND: Style("var(--second)", (5, 2), "square", 1.4, 0.65),
    Tone.THIRD: Style("var(--third)", (3, 1), "triangle-up", 1.6, 0.35),
    Tone.FOURTH: Style("var(--fourth)", (7, 2, 1, 2), "diamond", 1.4, 0.15),
    Tone.FIFTH: Style("var(--fifth)", (1, 2), "cross", 1.5, 0.8),
    Tone.SIXTH: Style("var(--sixth)", (9, 3), "triangle-down", 1.7, 0.5),
    Tone.QUIET: Style("var(--quiet)", (), "circle", 1.0, 0.0),
}
CONFIG: Spec = {
    "font": "system-ui, 'DejaVu Sans', sans-serif",  # the font of the page, which Vega measures
    "background": "transparent",
    "view": {"stroke": "var(--grid)"},
    "axis": {
        "labelColor": "var(--ink)",
        "titleColor": "var(--ink)",
        "gridColor": "var(--grid)",
        "domainColor": "var(--grid)",
        "tickColor": "var(--grid)",
        "labelFontSize": 11,
        "titleFontSize": 11,
        "titleFontWeight": "normal",
        "labelLimit": 150,
    },
    "axisY": {"minExtent": 44},  # a plot and the strip below it are aligned
    "aria": False,
}


def drawn_plots(plots: Sequence[Plot]) -> list[Spec]:
    """Return the data for the page's script: specification, numbers, and texts of their table."""
    import vl_convert

    return [
        {
            "vega": vl_convert.vegalite_to_vega(specification(plot)),
            "data": {f"s{k}": _rows(each) for k, each in enumerate(plot.series)}
            | {"bands": {"x": [start for start, _ in plot.bands], "high": [stop for _, stop in plot.bands]}},
            "zoom": plot.zoom,
            "title": plot.title,
            "x": plot.x.words,
            "y": plot.y.words,
            "labels": [each.label for each in plot.series],
        }
        for plot in plots
    ]


def legend(plot: Plot) -> list[tuple[str, str, Style]]:
    """Return the legend: label, mark and style of each labelled series."""
    return [(each.label, each.mark.value, STYLES[each.tone]) for each in plot.series if each.label]


def specification(plot: Plot) -> Spec:
    """Return a plot in Vega-Lite without numbers: data are named s0, s1 .. and bands."""
    layers: list[Spec] = [_bands(plot)] if plot.bands else []
    layers += [_reference(each) for each in plot.references]
    layers += [_series(k, each, plot) for k, each in enumerate(plot.series)]
    if plot.zoom:
        interval = {"type": "interval", "encodings": ["x"], "zoom": "wheel![event.ctrlKey]"}
        layers[-1] |= {"params": [{"name": "zoom", "select": interval, "bind": "scales"}]}
    return {
        "$schema": "https://vega.github.io/schema/vega-lite/v6.json",
        "width": "container",
        "height": max(plot.height, ROW * len(plot.y.categories) * max(1, len(_beside(plot)))),
        "autosize": {"type": "fit-x", "contains": "padding"},
        "config": CONFIG,
        "datasets": {name: [] for name in (*(f"s{k}" for k in range(len(plot.series))), "bands")},
        "layer": layers,
    }


def _rows(series: Series) -> Spec:
    ends: Spec = {"low": list(series.low), "high": list(series.high)} if series.low else {}
    return {"x": list(series.x), "y": list(series.y), **ends}


def _axis(axis: Axis, field: str) -> Spec:
    title = axis.words or None
    if axis.categories:
        scale = {"domain": list(axis.categories), "paddingInner": 0.25}
        return {
            "field": field,
            "type": "nominal",
            "sort": None,
            "scale": scale,
            "title": title,
            "axis": {"labelAngle": 0},
        }
    kind: Spec = {"type": "log"} if axis.log else {"zero": axis.zero}
    ticks: Spec = {"labelOverlap": True, "tickCount": 5}
    scale = {**kind, "nice": field == "y" and not axis.log}
    return {"field": field, "type": "quantitative", "scale": scale, "title": title, "axis": ticks}


def _series(k: int, series: Series, plot: Plot) -> Spec:
    x, y = _axis(plot.x, "x"), _axis(plot.y, "y")
    encoding: Spec = {"x": x, "y": y, **_offset(series, plot)}
    data, style = {"name": f"s{k}"}, STYLES[series.tone]
    match series.mark:
        case Mark.LINE:
            drawn: Spec = {"type": "line", "strokeWidth": style.width, "strokeDash": list(style.dash), "clip": True}
            return {"data": data, "mark": {**drawn, "color": style.colour}, "encoding": encoding}
        case Mark.POINTS:
            filled = {"type": "point", "shape": style.shape, "size": 14, "filled": True, "clip": True, "opacity": 0.75}
            return {"data": data, "mark": {**filled, "color": style.colour}, "encoding": encoding}
        case Mark.BARS:
            bar = {
                "type": "bar",
                "color": style.colour,
                "fillOpacity": style.fill,
                "stroke": "var(--ink)",
                "strokeWidth": 0.5,
            }
            drawn_bar: Spec = {"mark": bar}
            ends = [_ends(upright=not plot.y.categories)] if series.low else []
            return {"data": data, "encoding": encoding, "layer": [drawn_bar, *ends]}
        case Mark.STACK:
            part: Spec = {
                "type": "bar",
                "color": style.colour,
                "fillOpacity": max(style.fill, 0.15),
                "stroke": "var(--ink)",
            }
            return {
                "data": data,
                "encoding": encoding | _from_to(upright=True, axis=y),
                "mark": part | {"strokeWidth": 0.5},
            }
        case Mark.INTERVALS:
            return {"data": data, "encoding": encoding, "layer": _interval(style, upright=not plot.y.categories)}


def _interval(style: Style, *, upright: bool) -> list[Spec]:
    """Return a rule from low to high with a point; background series are a wide band."""
    ends = _from_to(upright=upright)
    if style.quiet:
        stripe = {"type": "rule", "color": "var(--band)", "strokeWidth": STRIPE, "strokeCap": "butt"}
        return [{"mark": stripe, "encoding": ends}]
    rule = {"type": "rule", "color": style.colour, "strokeWidth": 2.0, "strokeDash": list(style.dash)}
    point = {"type": "point", "shape": style.shape, "size": 40, "filled": True, "opacity": 1.0}
    return [{"mark": rule, "encoding": ends}, {"mark": {**point, "color": style.colour}}]


def _ends(*, upright: bool) -> Spec:
    """Return a thin rule on a bar, from low to high."""
    return {"mark": {"type": "rule", "color": "var(--ink)", "strokeWidth": 1.0}, "encoding": _from_to(upright=upright)}


def _from_to(*, upright: bool, axis: Mapping[str, object] | None = None) -> Spec:
    along = "y" if upright else "x"
    return {along: {**(axis or {}), "field": "low", "type": "quantitative"}, f"{along}2": {"field": "high"}}


def _beside(plot: Plot) -> list[str]:
    """Return the labels of series that share categories and would overlap."""
    if not plot.x.categories and not plot.y.categories:
        return []
    among = [each for each in plot.series if each.mark in (Mark.BARS, Mark.INTERVALS)]
    return [each.label for each in among if each.mark is Mark.BARS or each.tone is not Tone.QUIET]


def _offset(series: Series, plot: Plot) -> Spec:
    """Return an offset within a category."""
    among = _beside(plot)
    if len(among) < 2 or series.label not in among:
        return {}
    channel = "yOffset" if plot.y.categories else "xOffset"
    return {channel: {"datum": series.label, "type": "nominal", "scale": {"domain": among}}}


def _bands(plot: Plot) -> Spec:
    shaded = {"type": "rect", "color": "var(--band)", "opacity": 1.0, "clip": True}
    ends: Mapping[str, object] = {"x": {**_axis(plot.x, "x")}, "x2": {"field": "high"}}
    return {"data": {"name": "bands"}, "mark": shaded, "encoding": ends}


def _reference(reference: Reference) -> Spec:
    along = "x" if reference.upright else "y"
    rule: Spec = {"type": "rule", "color": "var(--ink)", "strokeDash": [3, 3], "strokeWidth": 1.0, "clip": True}
    words: Spec = {"type": "text", "text": reference.label, "color": "var(--ink)", "fontSize": 10, "clip": False}
    place: Spec = (
        {"align": "left", "dx": 3, "y": 8} if reference.upright else {"align": "right", "dy": -5, "x": "width"}
    )
    where: Spec = {along: {"datum": reference.at, "type": "quantitative"}}
    return {"data": {"values": [{}]}, "encoding": where, "layer": [{"mark": rule}, {"mark": {**words, **place}}]}
