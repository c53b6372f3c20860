"""The normal distribution that values of known noise most likely come from."""

import numpy as np
import pytest
from scipy import optimize

from ident.estimation.selection import LEAST_STD, MOST_STD, Belief, fitted_prior, likelihood_slope

SEEN, NOISE = np.array([0.031, 0.012, 0.093, 0.047, 0.064]), np.array([0.004, 0.011, 0.007, 0.023, 0.002])


def unlikely(mean: float, std: complex, seen: np.ndarray = SEEN, noise: np.ndarray = NOISE) -> complex:
    """-2 log L, less what is constant."""
    v = noise**2 + std**2
    return np.sum(np.log(v) + (seen - mean) ** 2 / v)


def best_mean(std: float, seen: np.ndarray = SEEN, noise: np.ndarray = NOISE) -> float:
    return optimize.minimize_scalar(
        lambda mean: unlikely(mean, std, seen, noise), bounds=(0.0, 1.0), method="bounded", options={"xatol": 1e-12}
    ).x


@pytest.mark.parametrize("std", [0.0023, 0.017, 0.31])
@pytest.mark.parametrize("shift", [0.0, -0.2])
def test_the_slope_is_the_complex_step_of_the_likelihood_with_its_best_mean(std, shift):
    # Shifted values are best explained by a mean of zero, the least there is.
    seen, step = SEEN + shift, 1e-30
    at = std * np.exp(1j * step)
    expected = np.imag(unlikely(best_mean(std, seen), at, seen)) / step
    # A mean that a search found is off by 1e-9, of which the slope feels 1e-9 / 0.02.
    np.testing.assert_allclose(likelihood_slope(seen, NOISE, std), expected, rtol=1e-6)


def test_the_likeliest_distribution_is_that_of_a_search_from_everywhere():
    found = optimize.brute(
        lambda x: unlikely(x[0], np.exp(x[1])), ((0.0, 0.2), (np.log(LEAST_STD), 0.0)), Ns=40, finish=optimize.fmin
    )
    belief = fitted_prior(SEEN, NOISE)
    np.testing.assert_allclose((belief.mean, belief.std), (found[0], np.exp(found[1])), rtol=1e-3)  # fmin ends at 1e-4
    assert unlikely(belief.mean, belief.std) <= unlikely(found[0], np.exp(found[1]))
    # The root ends at 1e-13 of the logarithm; of the slope's terms, some thousand each, as much is left.
    assert abs(likelihood_slope(SEEN, NOISE, belief.std)) < 1e-10


def test_values_without_noise_have_their_own_mean_and_deviation():
    belief = fitted_prior(SEEN, np.full(5, 1e-9))
    np.testing.assert_allclose((belief.mean, belief.std), (SEEN.mean(), SEEN.std()), rtol=1e-10)


@pytest.mark.parametrize(
    ("seen", "noise", "expected"),
    [
        ([0.021, 0.021, 0.021], 0.013, Belief(0.021, LEAST_STD)),  # no spread but noise
        ([-30.0, 50.0, -70.0], 0.013, Belief(0.0, MOST_STD)),
        ([2.3, 2.3, 2.3], 0.013, Belief(1.0, MOST_STD)),
    ],
)
def test_no_belief_is_beyond_the_least_and_the_most(seen, noise, expected):
    found = fitted_prior(np.array(seen), np.full(3, noise))
    np.testing.assert_allclose((found.mean, found.std), (expected.mean, expected.std), rtol=1e-12)
