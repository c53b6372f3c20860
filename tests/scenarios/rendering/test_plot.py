"""What plots show, read back from the axes and the SVG that Matplotlib draws."""

import re
from functools import partial

import numpy as np
import pytest
from page_parts import drawn_intervals

from scenarios.rendering.plot import COLOURS, LIMIT, SERIES, Plot, draw_bars, intervals_plot

JOINTS = (10, 9, 2)
ENDS = {10: (3.5, 3.0, 4.5), 2: (1.5, 1.0, 2.5)}


def plot(draw, **more) -> Plot:
    return Plot(**{"title": "", "caption": "", "x": "Joint", "y": "Gain", "draw": draw, **more})


def test_bars_stand_at_their_joints_in_order_beside_those_of_other_series():
    series = {"one": {10: 3.5, 2: 1.5}, "other": {10: 1.0, 9: 2.0}}
    (axes,) = plot(partial(draw_bars, joints=JOINTS, series=series)).figure().axes
    assert [each.get_text() for each in axes.get_xticklabels()] == ["10", "9", "2"]
    boxes = [patch.get_bbox() for patch in axes.patches]
    found = [(box.x0, box.x1, box.y0, box.y1) for box in boxes]
    expected = [(-0.375, 0.0, 0.0, 3.5), (1.625, 2.0, 0.0, 1.5), (0.0, 0.375, 0.0, 1.0), (1.0, 1.375, 0.0, 2.0)]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)
    assert [each.get_facecolor()[3] for each in axes.patches] == [1.0, 1.0, 0.65, 0.65]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("Joint", "Gain")
    assert [text.get_text() for text in axes.figure.legends[0].get_texts()] == ["one", "other"]


def test_an_interval_is_a_rule_with_a_point_and_its_axis_includes_a_limit_that_is_stated():
    (axes,) = intervals_plot("", "", "Gain", JOINTS, {"one": ENDS}).figure().axes
    assert drawn_intervals(axes) == [{10: ENDS[10], 2: ENDS[2]}]
    assert axes.get_ylim()[0] > 0.5
    for limit, ends in ((0.0, (-0.2, 4.7)), (9.0, (0.5, 9.4))):
        series = {"one": ENDS, "two": {9: (2, 1, 3)}}
        (axes,) = intervals_plot("", "", "Gain", JOINTS, series, limit=limit).figure().axes
        assert drawn_intervals(axes) == [{10: ENDS[10], 2: ENDS[2]}, {9: (2, 1, 3)}]
        assert axes.get_ylim() == pytest.approx(ends, abs=0.2)
    assert set(axes.lines[-1].get_ydata()) == {9.0}
    np.testing.assert_allclose(
        [axes.lines[0].get_xdata()[0], axes.lines[1].get_xdata()[0]], [-0.1875, 1.1875], rtol=1e-12
    )


def test_every_series_differs_from_others_without_its_colour():
    assert len({(str(dashes), width, shape) for _, dashes, width, shape, _ in SERIES}) == len(SERIES)
    assert min(-np.diff([fill for *_, fill in SERIES])) >= 0.2 - 1e-12


def test_svg_has_text_and_names_of_colours_and_no_size_or_identifier_of_another_plot():
    def draw(axes):
        for k in range(len(SERIES)):
            axes.plot([0.0, 1.0], [0.1, 0.123456 + k], label=f"line {k}")
        axes.axhline(0.3, **LIMIT)

    shown = plot(draw, x="a < b")
    one, two = (shown.svg(number) for number in (3, 4))
    assert one.startswith("<svg")
    assert "<text" in one
    assert "a &lt; b" in one
    assert set(re.findall(r"var\(--(\w+)\)", one)) >= {"ink", "grid", *(name for name, *_ in SERIES)}
    assert not re.findall(r"#[0-9a-f]{6}\b", one)
    assert not re.search(r'<svg[^>]* (width|height)="', one)
    ids = [set(re.findall(r' id="([^"]+)"', text)) for text in (one, two)]
    assert ids[0]
    assert not ids[0] & ids[1]
    assert shown.svg(3) == one
    assert len(set(COLOURS.values())) == len(COLOURS)  # each can be told by its value
