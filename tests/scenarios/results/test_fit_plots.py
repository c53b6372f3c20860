"""Plots of a fit, against closed forms."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from scenarios.results.fit_plots import FAR, LISTED, MOST, against, outliers, spectrum_plot, torque_plot
from scenarios.results.fit_rows import FitRows, begins
from scenarios.results.motion import short_names


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


def test_residuals_against_speed_are_in_percent_of_the_rms_current_with_means_of_tenths():
    rng = np.random.default_rng(3)
    speed = rng.uniform(-2.0, 3.0, 1000)
    rows = rows_of(0.2 * speed**2 + 1e-9 * rng.normal(size=1000), dq=speed, V=np.tile([3.0, -5.0], 500))
    points, means = against(rows, "speed").series
    assert len(points.x) == 143  # one row in 7
    np.testing.assert_allclose(points.y, 100 * 0.2 * np.square(points.x) / np.sqrt(17.0), rtol=1e-3)  # five digits
    assert len(means.x) == 10
    inside = [low < y < high for low, y, high in zip(means.low, means.y, means.high, strict=True)]
    assert all(inside)
    edges = np.quantile(speed, [0.0, 0.1])
    first = (speed >= edges[0]) & (speed < edges[1])
    np.testing.assert_allclose(means.x[0], speed[first].mean(), rtol=1e-3)  # five digits, and one row more or less
    y = 100 * rows.residual[first] / np.sqrt(17.0)
    np.testing.assert_allclose(means.high[0] - means.y[0], 2 * y.std(ddof=1) / np.sqrt(first.sum()), rtol=0.02)


@pytest.mark.parametrize(("turning", "units"), [(True, ("rad", "rad/s")), (False, ("m", "m/s"))])
def test_a_refused_joint_that_slides_moves_in_metres(turning, units):
    rows = rows_of(np.sin(np.arange(40.0)), unit="drive units", turning=turning)
    assert tuple(against(rows, what).x.unit for what in ("position", "speed")) == units


def test_logs_of_one_name_in_two_folders_are_told_apart():
    assert short_names(["monday/bare.csv", "monday/heavy.csv"]) == ("bare", "heavy")
    assert short_names(["monday/bare.csv", "friday/bare.csv"]) == ("monday/bare.csv", "friday/bare.csv")


def test_outliers_are_listed_the_farthest_first_with_what_accident_would_give():
    residual = np.zeros(100)
    residual[[7, 60]] = -2.25, 3.5  # 4.5 and 7 deviations
    residual[8] = FAR * 0.5
    motion = np.repeat([0, 1], 50)
    stamp = np.r_[0.05 * np.arange(50), 1200.25 + 0.05 * np.arange(50)]  # the second log's clock is another
    said, table = outliers([rows_of(residual, motion=motion, stamp=stamp)], ("bare", "heavy"))
    assert said.text.startswith("2 of 100 rows have residuals above 4 ")
    assert f"{100 * 2 * stats.norm.sf(4):.1f} are expected" in said.text
    assert [[cell.text for cell in row] for row in table.rows] == [
        ["3", "heavy", "1200.75", "+7.0", "+8.75 N m"],
        ["3", "bare", "0.35", "-4.5", "-5.62 N m"],
    ]


@pytest.mark.parametrize(("many", "title"), [(LISTED, "Outliers"), (LISTED + 1, f"The {LISTED} largest outliers")])
def test_a_list_of_outliers_that_is_cut_says_so(many, title):
    residual = np.zeros(100)
    residual[:many] = 3.0 + 0.01 * np.arange(many)
    _, table = outliers([rows_of(residual)], ("bare",))
    assert (table.title, len(table.rows)) == (title, LISTED)


def test_the_spectrum_of_unrelated_rows_lies_about_one_between_its_lines():
    rng = np.random.default_rng(5)
    n, period = 600, 0.05
    t, motion = np.r_[period * np.arange(n), 40.0 + period * np.arange(n)], np.repeat([0, 1], n)
    white = rows_of(rng.normal(scale=0.7, size=2 * n), t=t, motion=motion)
    plot = spectrum_plot(white, period, -0.016)
    assert plot.caption.endswith(": -0.02.")
    (line,) = plot.series
    assert 0.0 < line.x[0] < 1.0
    assert 9.0 < line.x[-1] < 10.0  # half the rate of the rows
    low, high = (each.at for each in plot.references)
    # 29 seconds twice: 289 frequencies, 12 to a point, two numbers of either motion to each.
    assert (low, high) == pytest.approx(tuple(stats.chi2.ppf([0.025, 0.975], 48) / 48), rel=1e-12)
    inside = sum(low < y < high for y in line.y)
    assert inside >= 20  # of 24: fewer in one of 200 choices of a seed
    np.testing.assert_allclose(np.mean(line.y), 1.0, rtol=0.1)  # 576 squares of either sort: 4 % is one deviation
    wave = rows_of(np.sin(2.0 * np.pi * 3.1 * t), t=t, motion=motion)
    tall = spectrum_plot(wave, period, 0.6).series[0]
    assert abs(tall.x[int(np.argmax(tall.y))] - 3.1) < 0.5
