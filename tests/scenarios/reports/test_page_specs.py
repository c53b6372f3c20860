"""Plots as the page's script has them: what is drawn from where to where, in which order."""

import re

import pytest

from scenarios.rendering import Page, renderer
from scenarios.rendering.content import Facts, Heading, Paragraph, Picture, Report
from scenarios.rendering.drawing import ROW, STRIPE, drawn_plots, specification
from scenarios.rendering.html import sections
from scenarios.rendering.plot import Axis, Mark, Plot, Reference, Series, Tone

JOINTS = Axis(title="joint", categories=("10", "9", "2"))
BARS = Series(label="bars", mark=Mark.BARS, x=("10", "2"), y=(3.5, 1.5), low=(3.0, 1.0), high=(4.5, 2.5))


def plot(*series: Series, **more) -> Plot:
    return Plot(**{"title": "", "caption": "", "x": JOINTS, "y": Axis(title="gain"), "series": series, **more})


def test_parts_stand_below_their_headings_plots_together_and_facts_beside_the_picture():
    beside = Picture("", b"", 4, 3), Facts((("Date", "today"),))
    parts = (*beside, plot(), plot(), Paragraph("text"), plot(), Heading("more"), Heading("last", folded=True), plot())
    found = [(each.heading and each.heading.text, [len(b.parts) for b in each.blocks]) for each in sections(parts)]
    assert found == [(None, [2, 2, 1, 1]), ("more", []), ("last", [1])]


def test_plots_and_their_strips_are_numbered_over_the_whole_page():
    parts = (plot(BARS), plot(BARS, strip=plot(BARS)), Heading("more"), plot(BARS))
    page = renderer("html")(Report("Title", parts, {}), Page())
    assert re.findall(r'class="plot" id="plot(\d)"', page) == ["0", "1", "3"]
    assert re.findall(r'class="canvas" id="canvas(\d)"', page) == ["0", "1", "2", "3"]


def test_links_lead_to_sections_and_some_are_folded():
    parts = (Paragraph("verdict"), *(Heading(f"H{k}", folded=k == 2) for k in range(3)))
    page = renderer("html")(Report("Title", parts, {}), Page())
    assert re.findall(r'<a href="#(\w+)">(\w+)<', page) == [(f"section{k + 1}", f"H{k}") for k in range(3)]
    assert re.findall(r'<(section|details class="section") id="(\w+)"', page) == [
        ("section", "section1"),
        ("section", "section2"),
        ('details class="section"', "section3"),
    ]
    assert "<nav" not in renderer("html")(Report("Title", parts[:2], {}), Page())


def test_a_stack_lies_between_the_ends_of_its_parts():
    part = Series(label="part", mark=Mark.STACK, x=("9",), y=(20.0,), low=(10.0,), high=(30.0,))
    (layer,) = specification(plot(part))["layer"]
    assert {name: each["field"] for name, each in layer["encoding"].items()} == {"x": "x", "y": "low", "y2": "high"}


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
