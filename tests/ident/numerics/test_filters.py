import numpy as np
import pytest
from scipy import signal

from ident.numerics.filters import butterworth, filtered, filtered_both_ways

RNG = np.random.default_rng(7)
X = 1.0 + 1e-2 * RNG.standard_normal((4001, 3)).cumsum(axis=0)
CUTOFFS = [(4, 8.0, 1000.0), (4, 30.0, 500.0), (2, 20.0, 1000.0), (6, 200.0, 1000.0), (4, 2.0, 1000.0)]


@pytest.mark.parametrize(("order", "cutoff_hz", "rate_hz"), CUTOFFS)
def test_the_sections_are_those_of_scipy(order, cutoff_hz, rate_hz):
    sections, expected = (
        butterworth(order, cutoff_hz, rate_hz),
        signal.butter(order, cutoff_hz, fs=rate_hz, output="sos"),
    )
    # Few operations each: rounding. SciPy has the gain of all sections in the first.
    np.testing.assert_allclose(sections[:, 3:], expected[:, 3:], rtol=1e-14)
    np.testing.assert_allclose(sections[:, 0].prod(), expected[0, 0], rtol=1e-13)
    np.testing.assert_allclose(sections[:, :3], sections[:, :1] * (1.0, 2.0, 1.0), rtol=1e-15)


def test_the_power_at_the_cut_off_is_half_and_a_slow_signal_passes():
    _, H = signal.sosfreqz(butterworth(4, 15.0, 1000.0), worN=[0.0, 15.0], fs=1000.0)
    np.testing.assert_allclose(np.abs(H) ** 2, (1.0, 0.5), rtol=1e-11)  # rounding over (15 / 1000)^2 a section


@pytest.mark.parametrize(("order", "cutoff_hz", "rate_hz"), CUTOFFS)
def test_a_filtered_signal_is_that_of_scipy(order, cutoff_hz, rate_hz):
    sections = butterworth(order, cutoff_hz, rate_hz)
    np.testing.assert_allclose(
        filtered(sections, X), signal.sosfilt(sections, X, axis=0), rtol=0, atol=1e-9 * np.abs(X).max()
    )


@pytest.mark.parametrize(("order", "cutoff_hz", "rate_hz"), CUTOFFS)
@pytest.mark.parametrize("padding", [1, 130, 4000])
def test_a_signal_filtered_both_ways_is_that_of_scipy_up_to_its_ends(order, cutoff_hz, rate_hz, padding):
    sections = butterworth(order, cutoff_hz, rate_hz)
    expected = signal.sosfiltfilt(sections, X, axis=0, padlen=padding)
    found = filtered_both_ways(sections, X, padding)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(X).max())
    # Accelerations are second differences of it: rounding is smooth as well.
    np.testing.assert_allclose(
        np.diff(found, 2, axis=0),
        np.diff(expected, 2, axis=0),
        rtol=0,
        atol=1e-8 * np.abs(np.diff(expected, 2, axis=0)).max(),
    )


def test_signals_of_one_and_two_samples_are_filtered():
    sections = butterworth(4, 15.0, 1000.0)
    for count in (1, 2):
        np.testing.assert_allclose(
            filtered(sections, X[:count]), signal.sosfilt(sections, X[:count], axis=0), rtol=1e-13
        )


def test_filtering_leaves_the_signal_as_it_was():
    x = np.asfortranarray(X)
    before = x.copy()
    filtered(butterworth(4, 15.0, 1000.0), x)
    np.testing.assert_array_equal(x, before)
