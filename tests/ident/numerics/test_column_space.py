"""Directions that columns span, whatever their sizes."""

import numpy as np

from ident.numerics.column_space import column_space


def test_columns_of_any_size_give_the_directions_that_they_span(rng):
    one, other = rng.normal(size=(2, 7))
    columns = np.column_stack((3e-9 * one, np.zeros(7), 4e5 * other, 0.3 * one - 0.7 * other))
    basis = column_space(columns)
    assert basis.shape == (7, 2)
    np.testing.assert_allclose(basis.T @ basis, np.eye(2), atol=1e-12)  # rounding
    for each in (one, other):
        np.testing.assert_allclose(basis @ (basis.T @ each), each, rtol=1e-9)  # rounding


def test_columns_of_zeros_or_none_span_nothing():
    assert column_space(np.zeros((5, 3))).shape == (5, 0)
    assert column_space(np.zeros((5, 0))).shape == (5, 0)


def test_of_known_directions_nothing_is_new_and_of_others_their_part_across(rng):
    known = column_space(rng.normal(size=(9, 3)))
    across = rng.normal(size=9)
    across -= known @ (known.T @ across)
    across /= np.linalg.norm(across)
    inside = known @ np.array([0.7, -1.9, 0.4])
    little = inside / np.linalg.norm(inside) + 1e-5 * across  # ten times what counts as something new
    nothing = 3e4 * (inside + 1e-7 * across)
    new = column_space(np.column_stack((inside, np.zeros(9), nothing, -2e-9 * little)), known)
    assert new.shape == (9, 1)
    np.testing.assert_allclose(abs(new[:, 0] @ across), 1.0, rtol=1e-9)  # rounding over 1e-5
    assert column_space(np.column_stack((inside, nothing)), known).shape == (9, 0)
