import numpy as np
import pytest
from scipy import signal

from ident.numerics.signals import hann_window, power_density


@pytest.mark.parametrize("size", [64, 65])
def test_densities_are_those_of_scipy(size):
    x = np.random.default_rng(3).standard_normal((1000, 2)).cumsum(axis=0) + 5.0
    f, power = power_density(x, 2e-3, size)
    expected_f, expected = signal.welch(x, fs=500.0, nperseg=size, axis=0)
    np.testing.assert_allclose(f, expected_f, rtol=1e-14)
    np.testing.assert_allclose(
        power, expected, rtol=1e-9, atol=1e-15 * expected.max()
    )  # transforms round, zero is left of the mean


@pytest.mark.parametrize("size", [6, 7, 256])
def test_the_window_is_that_of_scipy(size):
    np.testing.assert_allclose(hann_window(size), signal.get_window("hann", size), rtol=0, atol=1e-15)
