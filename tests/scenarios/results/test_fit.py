"""Plots of a fit, against closed forms."""

import math
from types import SimpleNamespace

import numpy as np

from scenarios.results.check import short_names
from scenarios.results.fit import MOST, FitRows, begins, torque_plot


def rows_of(residual: np.ndarray, **more) -> FitRows:
    n = len(residual)
    given = {
        "joint": 2,
        "scale": 2.5,
        "unit": "N m",
        "turning": True,
        "t": 0.05 * np.arange(n),
        "stamp": 0.05 * np.arange(n),
        "V": np.full(n, 4.0),
        "residual": residual,
        "q": np.linspace(-1.0, 2.0, n),
        "dq": np.linspace(3.0, -2.0, n),
        "motion": np.zeros(n, dtype=np.intp),
        "sigma": 0.5,
        "still": ((0.2, 0.3),),
    }
    return FitRows(**{**given, **more})


def test_a_torque_is_the_gain_times_what_is_measured_and_what_the_model_makes_of_it():
    residual = np.array([0.5, -0.25, 0.125, 0.0, 0.75, -0.5])
    plot = torque_plot(rows_of(residual, V=np.arange(1.0, 7.0)), ("bare", "heavy"), (0.0, 0.2, 0.3))
    (measured, predicted), (left,) = plot.series, plot.strip.series
    assert measured.y == (2.5, 5.0, 7.5, 10.0, 12.5, 15.0)
    assert left.y == (1.25, -0.625, 0.3125, 0.0, 1.875, -1.25)
    np.testing.assert_allclose(predicted.y, np.subtract(measured.y, left.y), rtol=1e-4)  # five digits
    assert [(each.label, each.at, each.upright) for each in plot.references] == [
        ("bare", 0.0, True),
        ("heavy", 0.2, True),
    ]
    assert plot.bands == ((0.2, 0.3),)
    share = np.linalg.norm(residual) / np.linalg.norm(np.arange(1.0, 7.0))
    assert f"{100 * share:.2g} % of its rms. Shown: every row of 6" in plot.caption


def test_a_line_breaks_where_rows_are_left_out_and_between_motions():
    t = np.array([0.0, 0.05, 0.1, 0.4, 0.45, 0.5])
    rows = rows_of(np.ones(6), t=t, motion=np.array([0, 0, 0, 0, 1, 1]))
    at, broken = rows.broken(np.arange(6.0))
    np.testing.assert_array_equal(np.isnan(broken), [0, 0, 0, 1, 0, 1, 0, 0])
    np.testing.assert_allclose(at[[3, 5]], [0.25, 0.425], rtol=1e-12)  # half-way, but for rounding
    one_left_out = rows_of(np.ones(6), t=np.array([0.0, 0.05, 0.1, 0.2, 0.25, 0.3]))
    np.testing.assert_array_equal(np.isnan(one_left_out.broken(np.arange(6.0))[1]), [0, 0, 0, 1, 0, 0, 0])


def test_logs_follow_each_other_each_as_long_as_its_samples_last():
    logs = [SimpleNamespace(t=np.zeros(count), period=period) for count, period in ((5, 0.1), (8, 0.25))]
    np.testing.assert_allclose(begins(logs), [0.0, 0.5, 2.5], rtol=1e-12)


def test_a_long_line_is_thinned_out_and_its_caption_says_so():
    plot = torque_plot(rows_of(np.ones(2 * MOST + 1)), ("bare",), (0.0, 1.0))
    assert len(plot.series[0].y) == math.ceil((2 * MOST + 1) / 3)
    assert f"one row in 3 of {2 * MOST + 1}" in plot.caption


def test_a_refused_joint_is_shown_by_its_current_and_a_prismatic_one_by_its_force():
    for unit, shown in (
        ("drive units", ("Current [drive units]", "Residual [units]")),
        ("N", ("Force [N]", "Residual [N]")),
    ):
        plot = torque_plot(rows_of(np.sin(np.arange(40.0)), unit=unit), ("bare",), (0.0, 2.0))
        assert (plot.y.words, plot.strip.y.words) == shown
        assert plot.caption.startswith("Current (the gain is refused)") == (unit == "drive units")


def test_logs_of_one_name_in_two_folders_are_told_apart():
    assert short_names(["monday/bare.csv", "monday/heavy.csv"]) == ("bare", "heavy")
    assert short_names(["monday/bare.csv", "friday/bare.csv"]) == ("monday/bare.csv", "friday/bare.csv")
