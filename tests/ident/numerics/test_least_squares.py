import numpy as np
import pytest
from refusals import refused

from ident.model.structure import independent_columns
from ident.numerics.least_squares import column_space, least_squares, row_weights
from ident.support.errors import IdentificationError

EPS = np.finfo(float).eps


@pytest.fixture
def system(rng):
    W = rng.normal(size=(60, 5)) * 10.0 ** np.arange(-4, 1)
    x = rng.normal(size=5) * 10.0 ** np.arange(4, -1, -1)
    return W, x, W @ x + 0.1 * rng.normal(size=60)


def test_solution_covariance_and_sigma_are_the_textbook_s(system):
    W, _, Y = system
    fit = least_squares(W, Y, rank_tol=1e-9)
    normal = np.linalg.inv(W.T @ W)  # the form that eq. 17 to 20 print; fine for a well-conditioned W
    np.testing.assert_allclose(fit.x, normal @ W.T @ Y, rtol=1e-8)
    residual = Y - W @ fit.x
    np.testing.assert_allclose(fit.sigma**2, residual @ residual / (60 - 5), rtol=1e-12)
    np.testing.assert_allclose(fit.covariance, fit.sigma**2 * normal, rtol=1e-7)
    np.testing.assert_allclose(fit.std, np.sqrt(np.diag(fit.covariance)))


def test_units_of_a_column_do_not_matter(system):
    W, _, Y = system
    scale = 10.0 ** np.array([9, -7, 0, 3, -3])
    a, b = least_squares(W, Y, rank_tol=1e-9), least_squares(W * scale, Y, rank_tol=1e-9)
    np.testing.assert_allclose(b.x * scale, a.x, rtol=1e3 * EPS)


def test_what_the_data_cannot_give_is_an_error_with_the_reason(system):
    W, _, Y = system
    for column, said in (
        (W[:, 0] + W[:, 1], "relative singular value .* below 1e-09"),
        (0.0 * Y, "column 5 .* is zero"),
    ):
        refused(IdentificationError, said, least_squares, np.column_stack((W, column)), Y, rank_tol=1e-9)
    with pytest.raises(IdentificationError, match="5 rows cannot give 5 unknowns; record a longer motion") as caught:
        least_squares(W[:5], Y[:5], rank_tol=1e-9)
    assert (caught.value.value, caught.value.bounds) == (5, (6, np.inf))


def test_weights_are_the_residuals_of_each_group_s_own_solution(rng):
    W, x = rng.normal(size=(4000, 3)), np.array([1.0, -2.0, 0.5])
    groups = np.repeat([0, 1], 2000)
    noise = np.where(groups == 0, 0.01, 1.0)
    Y = W @ x + noise * rng.normal(size=4000)
    found = row_weights(W, Y, groups)
    fit = least_squares(W * found[:, None], Y * found, rank_tol=1e-9)
    # By construction each group's residual has unit deviation over its own solution's.
    np.testing.assert_allclose(fit.sigma, 1.0, atol=0.01)
    weight = np.empty(4000)
    for g in (0, 1):
        own = np.linalg.lstsq(W[groups == g], Y[groups == g])[0]
        weight[groups == g] = 1 / np.sqrt(np.sum((Y - W @ own)[groups == g] ** 2) / (2000 - 3))
    np.testing.assert_allclose(found, weight, rtol=1e-10)


def test_independent_columns_prefer_the_first_tier_and_ignore_rounding(rng):
    A = rng.normal(size=(50, 3))
    W = np.column_stack((A[:, 0] + A[:, 1], A, 1e-17 * rng.normal(size=50), 1e6 * A[:, 2]))
    assert sorted(independent_columns(W, [np.array([0, 1]), np.array([2, 3, 4, 5])])) in ([0, 1, 3], [0, 1, 5])
    assert sorted(independent_columns(W, [np.array([5, 4]), np.array([1, 2]), np.array([0, 3])])) == [1, 2, 5]


def test_columns_of_any_size_give_the_directions_that_they_span(rng):
    one, other = rng.normal(size=(2, 7))
    columns = np.column_stack((3e-9 * one, np.zeros(7), 4e5 * other, 0.3 * one - 0.7 * other))
    basis = column_space(columns)
    assert basis.shape == (7, 2)
    np.testing.assert_allclose(basis.T @ basis, np.eye(2), atol=1e-12)  # rounding
    for each in (one, other):
        np.testing.assert_allclose(basis @ (basis.T @ each), each, rtol=1e-9)  # rounding


def test_a_direction_that_is_hardly_new_spans_nothing_more_and_zeros_or_none_span_nothing(rng):
    for k in (0, 3):
        assert column_space(np.zeros((5, k))).shape == (5, 0)
    inside, across = np.linalg.qr(rng.normal(size=(9, 2)))[0].T
    for new, rank in ((1e-5, 2), (1e-7, 1)):  # ten times what counts as something new, and a tenth
        assert column_space(np.column_stack((inside, 3e4 * (inside + new * across)))).shape == (9, rank)
