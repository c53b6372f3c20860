"""Columns of beliefs that belong to gains that are held, and what is left without them."""

import numpy as np
import pytest

from ident.estimation.all_joints.solution import GIVEN_STD
from ident.estimation.fixed_gains import gain_covariance, gain_sensitivity, own_beliefs
from ident.estimation.known_gains import KnownGains

BELIEF = np.array([[3.0, -1.0, 0.4, 7.0, 2.0, -5.0], [0.3, 0.9, -6.0, 1.7, -8.0, 0.6]])
"""Of two parameters: two beliefs of others, and those on log h of four gains."""


@pytest.fixture
def gains() -> KnownGains:
    value = np.array([2.0, -5.0, 0.7])
    log_covariance = np.array([[4.0, 1.0, -0.5], [1.0, 9.0, 2.0], [-0.5, 2.0, 1.5]]) * 1e-4
    return KnownGains(
        names=("a", "b", "c", "d"),
        joints=np.array([0, 2, 3]),
        value=value,
        covariance=log_covariance * np.outer(value, value),
    )


def test_a_gain_that_is_held_moves_parameters_as_the_row_that_holds_it(gains):
    # A deviation of log h = -log g is one of GIVEN_STD.
    expected = -BELIEF[:, [2, 4, 5]] / GIVEN_STD
    np.testing.assert_allclose(gain_sensitivity(BELIEF, gains), expected, rtol=1e-14)
    log_covariance = np.array([[4.0, 1.0, -0.5], [1.0, 9.0, 2.0], [-0.5, 2.0, 1.5]]) * 1e-4
    np.testing.assert_allclose(gain_covariance(BELIEF, gains), expected @ log_covariance @ expected.T, rtol=1e-12)


def test_beliefs_in_gains_that_are_held_are_no_beliefs_of_the_model(gains):
    np.testing.assert_array_equal(own_beliefs(BELIEF, gains), BELIEF[:, [0, 1, 3]])
