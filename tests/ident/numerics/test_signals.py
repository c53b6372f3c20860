import numpy as np
import pytest

from ident.numerics.signals import (
    Decimator,
    decimator,
    delayed,
    group_means,
    low_passed,
    low_passed_at,
    noise_density,
    smooth_motion,
)

PERIOD, CUTOFF = 1e-3, 15.0


def test_error_of_the_derivatives_falls_with_the_fourth_power_of_the_period():
    errors = []
    for period in (4e-3, 2e-3):
        t = period * np.arange(int(20 / period))
        _, dq, ddq = smooth_motion(np.sin(2 * np.pi * 5 * t)[:, None], period, 60.0)
        inner = slice(len(t) // 4, -len(t) // 4)
        rate = 2 * np.pi * 5  # the inner half holds 50 whole periods: amplitudes are projections
        speed = 2 * np.mean(dq[inner, 0] * np.cos(rate * t[inner])) / rate
        acceleration = -2 * np.mean(ddq[inner, 0] * np.sin(rate * t[inner])) / rate**2
        errors.append(1 - np.array([speed, acceleration]))
    order = np.log2(errors[0] / errors[1])
    np.testing.assert_allclose(order, 4, atol=0.2)  # next order and the filter's own droop


def test_a_low_pass_keeps_what_is_slow_and_a_half_at_its_cut_off():
    t = PERIOD * np.arange(20_000)
    for rate, kept in ((2.0, 1.0), (8.0, 0.5), (40.0, 0.0)):  # 1 / (1 + (f / f_c)^8), both ways
        x = np.column_stack((np.sin(2 * np.pi * rate * t), 3.0 * np.sin(2 * np.pi * rate * t)))
        inner = slice(4000, -4000)
        np.testing.assert_allclose(low_passed(x, PERIOD, 8.0)[inner], kept * x[inner], rtol=0, atol=1e-3)


def test_a_low_pass_at_a_few_samples_is_that_of_all_samples(rng):
    x = np.cumsum(rng.normal(size=(900, 2)), axis=0) + np.array([30.0, -7.0])
    for samples in (slice(3, 880, 41), slice(60, None, 97)):
        found = low_passed_at(x, PERIOD, 8.0, samples)
        expected = low_passed(x, PERIOD, 8.0)[samples]
        # The response has decayed to 1e-5 where it is cut off; at the ends it starts in a steady state.
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-4 * np.abs(x).max())


def test_the_density_of_noise_is_what_white_noise_of_a_deviation_has():
    t, sigma = PERIOD * np.arange(20_000), np.array([3e-5, 7e-6])
    noise = sigma * np.random.default_rng(8).standard_normal((len(t), 2))
    motion = np.column_stack((0.9 * np.sin(5.0 * t), 0.4 * np.cos(3.0 * t)))
    # Some 150 stretches give each of 50 lines to 9 %, their median to 2 %.
    for x in (noise, noise + motion):
        np.testing.assert_allclose(noise_density(x, PERIOD), 2.0 * sigma**2 * PERIOD, rtol=0.08)
    assert (noise_density(motion, PERIOD) < 1e-6 * 2.0 * sigma**2 * PERIOD).all()


@pytest.fixture
def D() -> Decimator:
    return decimator(PERIOD, 10.0, 50)


def test_the_decimator_has_no_phase_and_stops_what_would_fold(D):
    np.testing.assert_allclose(D.kernel, D.kernel[::-1], rtol=0, atol=1e-16)  # of 0.02 at most
    np.testing.assert_allclose(D.kernel.sum(), 1.0, rtol=1e-14)
    t = PERIOD * (np.arange(len(D.kernel)) - len(D.kernel) // 2)
    gain = [abs(D.kernel @ np.exp(2j * np.pi * f * t)) for f in (1.0, 10.0, 20.0, 100.0)]
    assert abs(gain[0] - 1) < 2e-3  # Hamming ripple
    np.testing.assert_allclose(gain[1], 0.5, atol=0.01)  # cut-off is at half amplitude
    assert max(gain[2:]) < 4e-3


def test_rows_are_the_convolution_with_the_kernel_at_every_factor_th_sample(D, rng):
    x = rng.normal(size=2345)
    rows = D.rows(len(x))
    # Sums of as many products as the kernel is long, of numbers around 1.
    expected = np.convolve(x, D.kernel, mode="valid")[:: D.factor]
    assert len(expected) == rows
    whole = D.band(len(x))[D.overlap :][:rows]
    np.testing.assert_allclose(whole @ x, expected, rtol=0, atol=1e-14)
    assert len(D.kernel) > 2 * D.factor  # several groups of samples a row
    applied = D.applied(x[:, None, None] * [[1.0, -3.0]])
    np.testing.assert_allclose(applied[:, 0], np.outer(expected, [1.0, -3.0]), rtol=0, atol=1e-13)


def test_pieces_add_up_to_the_whole_band(D):
    samples, piece = 2345, 8 * D.factor
    whole, band = D.band(samples), D.band(piece)
    pieces = np.zeros((len(whole) + 8, samples))  # the band of the last, incomplete piece reaches beyond the end
    for start in range(0, samples, piece):
        inside = band[:, : samples - start]
        pieces[start // D.factor :, start : start + piece][: len(band)] += inside
    np.testing.assert_array_equal(pieces[: len(whole)], whole)
    assert not pieces[len(whole) :].any()


@pytest.mark.parametrize(("periods", "inner", "held", "end"), [(2.25, slice(3, None), slice(2), 0.0),
                                                               (-2.25, slice(-3), slice(-2, None), 9.0)])  # fmt: skip
def test_a_delay_shifts_a_ramp_and_keeps_its_start_or_a_negative_one_its_end(periods, inner, held, end):
    ramp = np.arange(10.0)[:, None]
    np.testing.assert_array_equal(delayed(ramp, 0.0), ramp)
    np.testing.assert_allclose(delayed(ramp, periods)[inner, 0], ramp[inner, 0] - periods, rtol=1e-15)
    np.testing.assert_array_equal(delayed(ramp, periods)[held], end)
    assert delayed(ramp, 12.0 * periods).shape == ramp.shape


def test_group_means_leave_out_an_incomplete_group():
    np.testing.assert_array_equal(group_means(np.arange(7.0), 3), [1.0, 4.0])
    x = np.arange(12.0).reshape(6, 2)
    np.testing.assert_array_equal(group_means(x, 1), x)
