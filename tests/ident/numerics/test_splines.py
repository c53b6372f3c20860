import numpy as np
import pytest
from scipy import interpolate

from ident.numerics.splines import CubicSpline


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
