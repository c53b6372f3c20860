import numpy as np
import pytest
from scipy import signal

from ident.numerics.signals import power_density


@pytest.mark.parametrize("size", [6, 64, 65])
def test_densities_are_those_of_scipy(size):
    x = np.random.default_rng(3).standard_normal((1000, 2)).cumsum(axis=0) + 5.0
    f, power = power_density(x, 2e-3, size)
    expected_f, expected = signal.welch(x, fs=500.0, nperseg=size, axis=0)
    np.testing.assert_allclose(f, expected_f, rtol=1e-14)
    np.testing.assert_allclose(
        power, expected, rtol=1e-9, atol=1e-15 * expected.max()
    )  # transforms round, zero is left of the mean
