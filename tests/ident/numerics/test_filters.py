"""Filters, spectra, splines and neighbourhoods are those of SciPy, whose import takes long."""

import numpy as np
import pytest
from scipy import interpolate, ndimage, signal

from ident.numerics.filters import butterworth, filtered, filtered_both_ways
from ident.numerics.neighbours import running_median, widened
from ident.numerics.signals import power_density
from ident.numerics.splines import CubicSpline

RNG = np.random.default_rng(7)
X = 1.0 + 1e-2 * RNG.standard_normal((4001, 3)).cumsum(axis=0)
CUTOFFS = [(4, 8.0, 1000.0), (4, 30.0, 500.0), (2, 20.0, 1000.0), (6, 200.0, 1000.0), (4, 2.0, 1000.0)]


@pytest.mark.parametrize(("order", "cutoff_hz", "rate_hz"), CUTOFFS)
def test_filters_and_their_sections_are_those_of_scipy(order, cutoff_hz, rate_hz):
    sections = butterworth(order, cutoff_hz, rate_hz)
    expected = signal.butter(order, cutoff_hz, fs=rate_hz, output="sos")
    # Few operations each: rounding. SciPy has the gain of all sections in the first.
    np.testing.assert_allclose(sections[:, 3:], expected[:, 3:], rtol=1e-14)
    np.testing.assert_allclose(sections[:, 0].prod(), expected[0, 0], rtol=1e-13)
    np.testing.assert_allclose(sections[:, :3], sections[:, :1] * (1.0, 2.0, 1.0), rtol=1e-15)
    x = np.asfortranarray(X)
    for count in (1, 2, len(x)):
        wanted = signal.sosfilt(sections, X[:count], axis=0)
        np.testing.assert_allclose(filtered(sections, x[:count]), wanted, rtol=0, atol=1e-9 * np.abs(wanted).max())
    np.testing.assert_array_equal(x, X)  # the signal is left as it was
    for padding in (1, 130, 4000):
        wanted = signal.sosfiltfilt(sections, X, axis=0, padlen=padding)
        found = filtered_both_ways(sections, X, padding)
        np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-9 * np.abs(X).max())
        # Accelerations are second differences of it: rounding is smooth as well.
        found, wanted = np.diff(found, 2, axis=0), np.diff(wanted, 2, axis=0)
        np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-8 * np.abs(wanted).max())


@pytest.mark.parametrize("size", [6, 64, 65])
def test_densities_are_those_of_scipy(size):
    x = RNG.standard_normal((1000, 2)).cumsum(axis=0) + 5.0
    f, power = power_density(x, 2e-3, size)
    expected_f, expected = signal.welch(x, fs=500.0, nperseg=size, axis=0)
    np.testing.assert_allclose(f, expected_f, rtol=1e-14)
    atol = 1e-15 * expected.max()  # transforms round, zero is left of the mean
    np.testing.assert_allclose(power, expected, rtol=1e-9, atol=atol)


@pytest.mark.parametrize(("knots", "shape"), [(4, ()), (37, (3, 2))])
def test_splines_and_their_derivatives_are_those_of_scipy(rng, knots, shape):
    x = 2.0 + np.cumsum(rng.uniform(0.3, 1.9, knots))
    y = rng.normal(size=(knots, *shape))
    between = np.linspace(x[0] - 0.2, x[-1] + 0.2, 333)
    ours, theirs = CubicSpline.through(x, y), interpolate.CubicSpline(x, y)
    for order in range(4):
        size = np.abs(theirs(between, order)).max()
        for t in (x, between):
            np.testing.assert_allclose(ours(t, order), theirs(t, order), rtol=0.0, atol=1e-12 * size)  # cond < 100


@pytest.mark.parametrize("count", [1, 2, 7, 200])
def test_a_running_median_is_that_of_scipy(count):
    x = np.random.default_rng(count).standard_normal(count)
    for reach in (0, 1, 3, 10):
        expected = ndimage.median_filter(x, size=2 * reach + 1, mode="nearest")
        np.testing.assert_array_equal(running_median(x, reach), expected)


@pytest.mark.parametrize("reach", [1, 4, 300])
def test_a_widened_mask_is_that_of_scipy(reach):
    marked = np.random.default_rng(5).random((200, 3)) < (0.0, 0.02, 0.1)
    expected = ndimage.binary_dilation(marked, np.ones((2 * reach + 1, 1), dtype=np.bool_))
    np.testing.assert_array_equal(widened(marked, reach), expected)
    assert not widened(marked, reach)[:, 0].any()
