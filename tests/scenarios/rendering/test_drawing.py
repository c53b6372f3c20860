"""What plots show, read back from the axes and the SVG that Matplotlib draws."""

import re

import numpy as np
import pytest
from matplotlib.colors import to_hex

from scenarios.rendering.drawing import COLOURS, ROW, STYLES, figure, svg
from scenarios.rendering.plot import TONES, Axis, Plot, Reference, Series

JOINTS = Axis(title="joint", categories=("10", "9", "2"))
ENDS = {"low": (3.0, 1.0), "high": (4.5, 2.5)}
BARS = Series(label="bars", mark="bars", x=("10", "2"), y=(3.5, 1.5), **ENDS)


def plot(*series: Series, **more) -> Plot:
    return Plot(**{"title": "", "caption": "", "x": JOINTS, "y": Axis(title="gain"), "series": series, **more})


def drawn(*series: Series, **more):
    return figure(plot(*series, **more)).axes[0]


def spans(axes) -> list[tuple[float, float, float, float]]:
    """Left, right, lower and upper end of every bar."""
    boxes = [patch.get_bbox() for patch in axes.patches]
    return [(box.x0, box.x1, box.y0, box.y1) for box in boxes]


def rules(axes) -> list[np.ndarray]:
    return [segment for lines in axes.collections for segment in lines.get_segments()]


def test_bars_stand_at_their_categories_in_order_with_a_rule_between_their_ends():
    axes = drawn(BARS)
    assert [each.get_text() for each in axes.get_xticklabels()] == ["10", "9", "2"]
    assert [(0.5 * (a + b), low, high) for a, b, low, high in spans(axes)] == [(0.0, 0.0, 3.5), (2.0, 0.0, 1.5)]
    np.testing.assert_array_equal(rules(axes), [[[0, 3], [0, 4.5]], [[2, 1], [2, 2.5]]])
    lying = Series(label="bars", mark="bars", x=(3.5, 1.5), y=("10", "2"), **ENDS)
    axes = drawn(lying, x=Axis(title="rms"), y=JOINTS)
    assert [(low, high, 0.5 * (a + b)) for low, high, a, b in spans(axes)] == [(0.0, 3.5, 0.0), (0.0, 1.5, 2.0)]
    np.testing.assert_array_equal(rules(axes), [[[3, 0], [4.5, 0]], [[1, 2], [2.5, 2]]])
    assert axes.get_ylim()[0] > axes.get_ylim()[1]  # the first category is at the top


def test_series_that_share_categories_stand_beside_each_other_and_a_band_behind_them():
    other = Series(label="other", mark="bars", tone="second", x=("10", "2"), y=(1.0, 2.0))
    first, last, *_ = spans(drawn(BARS, other))
    left, *_ = spans(drawn(other, BARS))
    assert first[1] == pytest.approx(0.0, abs=1e-12)  # half of a category each
    assert first[1] - first[0] == pytest.approx(0.375, rel=1e-12)
    assert (left[0], left[1]) == pytest.approx((first[0], first[1]), rel=1e-12)
    assert last[0] > 1.0
    band = Series(label="limit", mark="intervals", tone="quiet", x=("9",), y=(0.0,), low=(-1.0,), high=(2.0,))
    axes = drawn(band, BARS)
    assert spans(axes)[0][2:] == (-1.0, 2.0)
    assert spans(axes)[1][1] - spans(axes)[1][0] == pytest.approx(0.75, rel=1e-12)  # alone beside the band
    assert axes.patches[0].zorder < axes.patches[1].zorder


def test_an_interval_is_a_rule_with_a_point():
    found = Series(label="", mark="intervals", x=("10", "2"), y=(3.5, 1.5), **ENDS)
    axes = drawn(found)
    np.testing.assert_array_equal(rules(axes), [[[0, 3], [0, 4.5]], [[2, 1], [2, 2.5]]])
    (points,) = axes.lines
    np.testing.assert_array_equal(points.get_xydata(), [[0, 3.5], [2, 1.5]])


def test_a_line_breaks_where_it_has_no_number_and_the_strip_below_has_the_same_time():
    line = Series(label="line", mark="line", x=(0.5, 2.0, 7.0), y=(1.5, None, 2.5))
    time = Axis(title="time", unit="s")
    strip = plot(line, x=time, y=Axis(title="residual", unit="N m"), height=50)
    whole = figure(plot(line, x=time, bands=((0.7, 0.9),), bands_label="still", strip=strip))
    below, above = sorted(whole.axes, key=lambda axes: axes.get_position().y0)
    np.testing.assert_array_equal(np.isnan(above.lines[0].get_ydata()), [False, True, False])
    assert below.get_xlim() == above.get_xlim()
    assert [text.get_text() for text in above.get_legend().get_texts()] == ["still", "line"]
    assert spans(above) == [(0.7, pytest.approx(0.9), 0.0, 1.0)]  # as high as the axes
    whole.draw_without_rendering()
    label = below.yaxis.label.get_window_extent()
    assert below.yaxis.label.get_text().split() == ["Residual", "[N", "m]"]
    assert label.x0 > 0.0
    assert label.height < below.get_window_extent().height  # not beside the plot above


def test_a_reference_stands_at_a_value_of_y_or_upright_at_one_of_x():
    level, upright = drawn(references=(Reference("", 2.25), Reference("", 0.7, upright=True))).lines
    assert (set(level.get_ydata()), set(upright.get_xdata())) == ({2.25}, {0.7})


def test_an_axis_is_logarithmic_or_includes_zero_where_that_is_stated():
    line = Series(label="line", mark="line", x=(0.5, 2.0), y=(1.5, 3.0))
    axes = drawn(line, x=Axis(title="f", unit="Hz", log=True), y=Axis(title="power", zero=True))
    assert (axes.get_xscale(), axes.get_ylim()[0], axes.get_xlabel()) == ("log", 0.0, "F [Hz]")
    assert drawn(line, x=Axis(title="f"), y=Axis(title="power")).get_ylim()[0] > 1.0


def test_many_categories_have_room():
    many = Axis(title="source", categories=tuple(map(str, range(40))))
    tall, short = (figure(plot(x=Axis(title="rms"), y=axis, height=20)).get_figheight() for axis in (many, JOINTS))
    assert 72.0 * (tall - short) == pytest.approx(37 * ROW, rel=1e-12)
    for axes in (drawn(BARS), drawn(y=JOINTS, x=Axis(title="rms"))):
        place = axes.get_position()
        assert 0.0 < place.x0 < place.x1 < 1.0
        assert 0.0 < place.y0 < place.y1 < 1.0


def test_every_tone_differs_from_others_without_its_colour():
    assert len({(style.dash, style.shape, style.width) for style in STYLES.values()}) == len(STYLES) == len(TONES) + 1
    fills = sorted(style.fill for style in STYLES.values())
    assert min(np.diff(fills)) >= 0.1 - 1e-12


def test_svg_has_text_and_names_of_colours_and_no_size_or_identifier_of_another_plot():
    series = tuple(Series(label=tone, mark="line", tone=tone, x=(0.0, 1.0), y=(0.1, 0.123456)) for tone in STYLES)
    one, two = (svg(plot(*series, x=Axis(title="a < b")), number) for number in (3, 4))
    assert one.startswith("<svg")
    assert "<text" in one
    assert "A &lt; b" in one
    assert set(re.findall(r"var\(--(\w+)\)", one)) >= {"ink", "grid", *STYLES}
    assert not re.findall(r"#[0-9a-f]{6}\b", one)
    assert not re.search(r'<svg[^>]* (width|height)="', one)
    ids = [set(re.findall(r' id="([^"]+)"', text)) for text in (one, two)]
    assert ids[0]
    assert not ids[0] & ids[1]
    assert svg(plot(*series, x=Axis(title="a < b")), 3) == one
    assert len(set(map(to_hex, COLOURS.values()))) == len(COLOURS)  # each can be told by its value
