"""Directions that columns span, whatever their sizes."""

import numpy as np

from ident.column_space import column_space


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
