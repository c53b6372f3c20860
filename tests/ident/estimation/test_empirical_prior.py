"""The normal distribution that values of known noise most likely come from."""

import numpy as np
import pytest
from scipy import optimize

from ident.estimation.selection import LEAST_STD, MOST_STD, Belief, fitted_prior

SEEN, NOISE = np.array([0.031, 0.012, 0.093, 0.047, 0.064]), np.array([0.004, 0.011, 0.007, 0.023, 0.002])


def unlikely(mean: float, std: float) -> float:
    """-2 log L, less what is constant."""
    v = NOISE**2 + std**2
    return np.sum(np.log(v) + (SEEN - mean) ** 2 / v)


def test_the_likeliest_distribution_is_that_of_a_search_from_everywhere():
    found = optimize.brute(
        lambda x: unlikely(x[0], np.exp(x[1])), ((0.0, 0.2), (np.log(LEAST_STD), 0.0)), Ns=40, finish=optimize.fmin
    )
    belief = fitted_prior(SEEN, NOISE)
    np.testing.assert_allclose((belief.mean, belief.std), (found[0], np.exp(found[1])), rtol=1e-3)  # fmin ends at 1e-4
    assert unlikely(belief.mean, belief.std) <= unlikely(found[0], np.exp(found[1]))


@pytest.mark.parametrize(
    ("seen", "noise", "expected"),
    [
        (SEEN.tolist(), 1e-9, Belief(SEEN.mean(), SEEN.std())),  # nothing but spread
        ([0.021, 0.021, 0.021], 0.013, Belief(0.021, LEAST_STD)),  # nothing but noise
        ([-30.0, 50.0, -70.0], 0.013, Belief(0.0, MOST_STD)),
        ([2.3, 2.3, 2.3], 0.013, Belief(1.0, MOST_STD)),
    ],
)
def test_no_belief_is_beyond_the_least_and_the_most(seen, noise, expected):
    found = fitted_prior(np.array(seen), np.full(len(seen), noise))
    np.testing.assert_allclose((found.mean, found.std), (expected.mean, expected.std), rtol=1e-10)
