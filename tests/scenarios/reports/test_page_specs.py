"""Plots as the page's script has them: what is drawn from where to where, in which order."""

import pytest

from scenarios.reports.content import Heading, Paragraph
from scenarios.reports.plot import Axis, Mark, Plot, Reference, Series, Tone
from scenarios.reports.renderers.html import blocks
from scenarios.reports.renderers.html.specs import ROW, STRIPE, drawn_plots, specification

JOINTS = Axis(title="joint", categories=("10", "9", "2"))
BARS = Series(label="bars", mark=Mark.BARS, x=("10", "2"), y=(3.5, 1.5), low=(3.0, 1.0), high=(4.5, 2.5))


def plot(*series: Series, **more) -> Plot:
    return Plot(**{"title": "", "caption": "", "x": JOINTS, "y": Axis(title="gain"), "series": series, **more})


def test_plots_are_numbered_over_the_whole_page():
    found = blocks((plot(), plot(), Paragraph("text"), plot(), plot(), Heading("more"), plot()))
    assert [(each.kind, each.first) for each in found if each.kind == "plots"] == [("plots", k) for k in (0, 2, 4)]
    assert [len(each.parts) for each in found] == [2, 1, 2, 1, 1]


def test_the_numbers_of_a_plot_are_those_of_its_series_and_bands(monkeypatch):
    monkeypatch.setattr("vl_convert.vegalite_to_vega", dict)  # which takes a second to begin
    line = Series(label="line", mark=Mark.LINE, x=(0.5, 2.0), y=(1.5, None))
    (drawn,) = drawn_plots([plot(BARS, bands=((0.1, 0.4), (0.7, 0.9)))])
    assert drawn["data"] == {
        "s0": {"x": ["10", "2"], "y": [3.5, 1.5], "low": [3.0, 1.0], "high": [4.5, 2.5]},
        "bands": {"x": [0.1, 0.7], "high": [0.4, 0.9]},
    }
    (other,) = drawn_plots([plot(line, x=Axis(title="time", unit="s"))])
    assert other["data"]["s0"] == {"x": [0.5, 2.0], "y": [1.5, None]}  # a line has no ends


def test_a_reference_stands_at_a_value_of_y_or_upright_at_one_of_x():
    level, upright, _ = specification(plot(BARS, references=(Reference("", 2.25), Reference("", 0.7, upright=True))))[
        "layer"
    ]
    assert {axis: each["datum"] for axis, each in level["encoding"].items()} == {"y": 2.25}
    assert {axis: each["datum"] for axis, each in upright["encoding"].items()} == {"x": 0.7}


@pytest.mark.parametrize(("axes", "along"), [({}, "y"), ({"x": Axis(title="rms"), "y": JOINTS}, "x")])
def test_an_interval_lies_along_its_numbers(axes, along):
    (layer,) = specification(plot(BARS, **axes))["layer"]
    _, ends = layer["layer"]
    assert {name: each["field"] for name, each in ends["encoding"].items()} == {along: "low", f"{along}2": "high"}


def test_categories_keep_their_order_and_have_room():
    spec = specification(plot(BARS, x=Axis(title="rms"), y=JOINTS, height=20))
    encoding = spec["layer"][0]["encoding"]
    assert (encoding["y"]["sort"], encoding["y"]["scale"]["domain"]) == (None, ["10", "9", "2"])
    assert spec["height"] == 3 * ROW
    assert "yOffset" not in encoding  # one series alone has all of its category
    assert specification(plot(BARS, height=20))["height"] == 20


def test_an_axis_is_logarithmic_or_begins_at_zero_where_that_is_said():
    line = Series(label="line", mark=Mark.LINE, x=(0.5, 2.0), y=(1.5, 3.0))
    axes = {"x": Axis(title="f", unit="Hz", log=True), "y": Axis(title="power", zero=True)}
    encoding = specification(plot(line, **axes))["layer"][0]["encoding"]
    assert encoding["x"]["scale"]["type"] == "log"
    assert encoding["y"]["scale"] == {"zero": True, "nice": True}


def test_what_is_quiet_is_a_stripe_and_the_rest_a_rule_with_a_point():
    quiet = Series(
        label="limit", mark=Mark.INTERVALS, tone=Tone.QUIET, x=("9",), y=(0.0,), low=(-1.0,), high=(1.0,)
    )  # fmt: skip
    loud = Series(label="found", mark=Mark.INTERVALS, x=("9",), y=(0.0,), low=(-1.0,), high=(1.0,))
    stripe, shown = (each["layer"] for each in specification(plot(quiet, loud))["layer"])
    assert [each["mark"]["strokeWidth"] for each in stripe] == [STRIPE]
    assert [each["mark"]["type"] for each in shown] == ["rule", "point"]
