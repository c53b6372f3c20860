"""How often intervals hold, and whether the ranks of z are uniform: from closed forms and fresh draws."""

import numpy as np
import pytest
from scipy import stats

from scenarios.experiments.calibration import GRID, Band, Calibration, calibration, simultaneous_band

LEVEL, DRAWS = 0.9, 4000
ALONE = np.eye(1)
SURE = 4.0 * np.sqrt(LEVEL * (1 - LEVEL) / DRAWS)
"""Four deviations of a level that is found from that many draws."""


def band(trials: int, correlation: np.ndarray = ALONE, *, level: float = LEVEL, seed: int = 5) -> Band:
    return simultaneous_band(correlation, trials, level=level, draws=DRAWS, rng=np.random.default_rng(seed))


def chance_of_staying(within: Band, trials: int) -> float:
    """That the counts of uniform ranks stay in a band at every point: a Markov chain of binomial steps, exact."""
    counts = np.arange(trials + 1)
    chance, before = np.where(counts == 0, 1.0, 0.0), 0.0
    for rank, low, high in zip(GRID, within.low, within.high, strict=True):
        step = (rank - before) / (1.0 - before)
        chance = stats.binom.pmf(counts[:, None] - counts, trials - counts, step) @ chance
        chance[(counts / trials - rank < low - 1e-12) | (counts / trials - rank > high + 1e-12)] = 0.0
        before = rank
    return float(chance.sum())


def test_the_band_holds_uniform_ranks_jointly_at_its_level():
    # At its k-th curve the simulated level is 0.9 or, by what one more k changes, a little above: less than 0.012 here.
    for trials in (60, 170):
        chance = chance_of_staying(band(trials), trials)
        assert LEVEL - SURE < chance < LEVEL + SURE + 0.012


def test_the_band_is_the_narrowest_that_leaves_as_many_simulated_curves_inside_as_its_level_says():
    draws, trials = 300, 40
    within = simultaneous_band(ALONE, trials, level=LEVEL, draws=draws, rng=np.random.default_rng(7))
    z = np.random.default_rng(7).multivariate_normal([0.0], ALONE, (draws, trials), method="eigh")[..., 0]
    curves = (stats.norm.cdf(z)[:, None, :] <= GRID[:, None]).mean(axis=2) - GRID

    def inside(low: np.ndarray, high: np.ndarray) -> float:
        return float(((low - 1e-12 <= curves) & (curves <= high + 1e-12)).all(axis=1).mean())

    step = np.sort(curves, axis=0)
    k = max(k for k in range(1, draws // 2) if inside(step[k - 1], step[-k]) >= LEVEL)
    np.testing.assert_allclose(within.low, step[k - 1], atol=1e-12)  # rounding alone
    np.testing.assert_allclose(within.high, step[-k], atol=1e-12)


@pytest.mark.parametrize("shared", [0.6])
def test_the_band_of_joints_that_err_together_holds_them_jointly_at_its_level(shared):
    correlation = np.eye(3) + shared * (1.0 - np.eye(3))
    within, rng, T, tries = band(30, correlation), np.random.default_rng(19), 30, 1000
    ranks = stats.norm.cdf(rng.multivariate_normal(np.zeros(3), correlation, (tries, T)).reshape(tries, -1))
    curves = [stats.ecdf(each).cdf.evaluate(GRID) - GRID for each in ranks]
    held = np.mean([((within.low - 1e-12 <= c) & (c <= within.high + 1e-12)).all() for c in curves])
    # The level is known to 0.005 from 4000 draws, the share to 0.010 from 1000; four deviations of both, and one k.
    assert abs(held - LEVEL) < 0.042 + 0.012


def quantiles(trials: int) -> np.ndarray:
    """A sample as normal as can be."""
    return stats.norm.ppf((np.arange(trials) + 0.5) / trials)


def held(z: np.ndarray) -> Calibration:
    return calibration(z, level=LEVEL, draws=1000, rng=np.random.default_rng(2))


def test_curves_of_wide_narrow_and_shifted_claims_leave_the_band_where_they_should():
    z = quantiles(300)[:, None]
    low, high = GRID < 0.4, GRID > 0.6
    for scale, side in ((0.6, -1.0), (1.7, 1.0)):  # claims too wide: no z far out; too narrow: too many
        found = held(scale * z)
        expected = stats.norm.cdf(stats.norm.ppf(GRID) / scale) - GRID
        np.testing.assert_allclose(found.difference, expected, atol=0.5 / 300 + 1e-12)
        assert found.outside.any()
        assert (side * found.difference[found.outside & low] > 0.0).all()
        assert (side * found.difference[found.outside & high] < 0.0).all()
    for shift in (0.5, -0.5):
        found = held(z + shift)
        assert (np.sign(found.difference[found.outside]) == -np.sign(shift)).all()
        assert found.outside[45:55].all()


def test_several_joints_make_one_curve_of_all_their_ranks():
    z = np.column_stack([quantiles(90) - 0.7, np.random.default_rng(4).permutation(quantiles(90)) + 1.1])
    expected = (stats.norm.cdf(z).reshape(-1, 1) <= GRID).mean(axis=0) - GRID
    np.testing.assert_allclose(held(z).difference, expected, atol=1e-12)


def test_joints_that_err_together_in_the_sample_are_given_the_wider_band():
    z, rng = quantiles(120), np.random.default_rng(8)
    samples = (z[:, None], np.column_stack([z, z]), np.column_stack([z, rng.permutation(z)]))
    one, together, apart = (float(np.mean(each.band.high - each.band.low)) for each in map(held, samples))
    # A correlation of 120 trials is known to 0.09, half of which is the width's; 1000 curves know it to a few percent.
    np.testing.assert_allclose(together, one, rtol=0.07)
    np.testing.assert_allclose(apart, one / np.sqrt(2.0), rtol=0.15)
