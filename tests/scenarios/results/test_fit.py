import math
from types import SimpleNamespace

import numpy as np
import pytest

from scenarios.rendering.plot import Plot
from scenarios.results.check import short_names
from scenarios.results.fit import MOST, begins, torque_plot


def plot_of(measured, residual, *, unit="N m", t=None, motion=None, starts=(("bare", 0.0),)) -> Plot:
    t = 0.05 * np.arange(len(measured)) if t is None else np.array(t)
    motion = np.zeros(len(measured), int) if motion is None else np.array(motion)
    return torque_plot(2, unit, t, np.array(measured), np.array(residual), motion, starts, ((0.2, 0.3),))


def test_a_torque_is_what_is_measured_and_what_the_model_makes_of_it_above_the_residual():
    measured, residual = np.arange(2.5, 17.0, 2.5), np.array([1.25, -0.625, 0.3125, 0.0, 1.875, -1.25])
    plot = plot_of(measured, residual, starts=[("bare", 0.0), ("heavy", 0.2)])
    above, below = plot.figure().axes
    np.testing.assert_array_equal(above.lines[0].get_ydata(), measured)
    np.testing.assert_array_equal(above.lines[1].get_ydata(), measured - residual)
    np.testing.assert_array_equal(below.lines[0].get_ydata(), residual)
    assert [line.get_label() for line in above.lines[:2]] == ["Measured", "Reconstructed"]
    assert [(text.get_text(), text.xy) for text in above.texts] == [("bare", (0.0, 1.0)), ("heavy", (0.2, 1.0))]
    assert [line.get_xdata()[0] for line in above.lines[2:]] == [0.0, 0.2]
    (band,) = [patch.get_bbox() for patch in above.patches]
    assert (band.x0, band.x1) == pytest.approx((0.2, 0.3), rel=1e-12)
    assert above.get_xlim() == below.get_xlim()
    share = np.linalg.norm(residual) / np.linalg.norm(measured)
    assert f"residual {100 * share:.2g} % of its rms. Shown: every row of 6" in plot.caption


def test_a_line_breaks_where_rows_are_left_out_and_between_motions():
    plot = plot_of(np.ones(6), np.arange(6.0), t=[0.0, 0.05, 0.1, 0.4, 0.45, 0.5], motion=[0, 0, 0, 0, 1, 1])
    at, broken = plot.figure().axes[1].lines[0].get_data()
    np.testing.assert_array_equal(np.isnan(broken), [0, 0, 0, 1, 0, 1, 0, 0])
    np.testing.assert_allclose(at[[3, 5]], [0.25, 0.425], rtol=1e-12)  # half-way, but for rounding
    one_left_out = plot_of(np.ones(6), np.arange(6.0), t=[0.0, 0.05, 0.1, 0.2, 0.25, 0.3])
    broken = one_left_out.figure().axes[0].lines[0].get_ydata()
    np.testing.assert_array_equal(np.isnan(broken), [0, 0, 0, 1, 0, 0, 0])


def test_logs_follow_each_other_each_as_long_as_its_samples_last():
    logs = [SimpleNamespace(t=np.zeros(count), period=period) for count, period in ((5, 0.1), (8, 0.25))]
    np.testing.assert_allclose(begins(logs), [0.0, 0.5, 2.5], rtol=1e-12)


def test_a_long_line_is_thinned_out_and_its_caption_says_so():
    plot = plot_of(np.ones(2 * MOST + 1), np.ones(2 * MOST + 1))
    assert len(plot.figure().axes[0].lines[0].get_ydata()) == math.ceil((2 * MOST + 1) / 3)
    assert f"one row in 3 of {2 * MOST + 1}" in plot.caption


def test_a_refused_joint_is_shown_by_its_current_and_a_prismatic_one_by_its_force():
    for unit, shown in (
        ("drive units", ("Current [drive units]", "Residual\n[units]")),
        ("N", ("Force [N]", "Residual\n[N]")),
    ):
        plot = plot_of(np.ones(40), np.sin(np.arange(40.0)), unit=unit)
        figure = plot.figure()
        assert tuple(axes.get_ylabel() for axes in figure.axes) == shown
        figure.draw_without_rendering()
        label, below = figure.axes[1].yaxis.label.get_window_extent(), figure.axes[1].get_window_extent()
        assert label.x0 > 0.0
        assert label.height < below.height  # not beside the plot above
        assert plot.caption.startswith("Current (the gain is refused)") == (unit == "drive units")


def test_logs_of_one_name_in_two_folders_are_told_apart():
    assert short_names(["monday/bare.csv", "monday/heavy.csv"]) == ("bare", "heavy")
    assert short_names(["monday/bare.csv", "friday/bare.csv"]) == ("monday/bare.csv", "friday/bare.csv")
