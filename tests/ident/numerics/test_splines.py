import numpy as np
import pytest
from scipy import interpolate

from ident.numerics.splines import BLOCK, periodic_spline, spline

RNG = np.random.default_rng(11)
POINTS = np.cumsum(RNG.uniform(0.2, 1.7, 60))
T = np.concatenate((np.linspace(POINTS[0] - 0.3, POINTS[-1] + 0.4, 3 * BLOCK + 7), POINTS))
SHAPES = [(), (3,), (2, 3)]


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("order", range(4))
@pytest.mark.parametrize("count", [4, 5, 60])
def test_a_spline_and_its_derivatives_are_those_of_scipy(shape, order, count):
    x, y = POINTS[:count], RNG.standard_normal((count, *shape))
    found, expected = spline(x, y)(T, order), interpolate.CubicSpline(x, y)(T, order)
    # The same operations in the same order; other compilers may contract some.
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("count", [4, 5, 60])
def test_a_periodic_spline_is_that_of_scipy_inside_its_period(shape, count):
    x, y = POINTS[:count], RNG.standard_normal((count, *shape))
    y[-1] = y[0]
    t = np.linspace(x[0], x[-1], 500, endpoint=False)
    expected = interpolate.CubicSpline(x, y, bc_type="periodic")(t)
    np.testing.assert_allclose(periodic_spline(x, y)(t), expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())


def test_a_spline_goes_through_its_points_and_has_every_cubic_exactly():
    y = RNG.standard_normal((60, 2))
    np.testing.assert_allclose(spline(POINTS, y)(POINTS), y, rtol=0, atol=1e-14)  # a few roundings of numbers about 1
    cubic = np.polynomial.Polynomial([0.3, -1.2, 0.07, 0.011])
    # Rounding of t^3, at the points some 1e5, over the shortest piece.
    np.testing.assert_allclose(spline(POINTS, cubic(POINTS))(T, 1), cubic.deriv()(T), rtol=1e-10)


@pytest.mark.parametrize("samples", [38, 39, 40, 41, 42])
def test_even_samples_between_points_are_those_of_a_call(samples):
    t = 0.7 + 0.03 * np.arange(samples)
    at = np.append(np.arange(0, samples - 1, 4), samples - 1)
    through = spline(t[at], np.random.default_rng(3).standard_normal((len(at), 2, 3)))
    np.testing.assert_allclose(through.evenly(4, samples), through(t), rtol=0, atol=1e-11)  # of values about 1
