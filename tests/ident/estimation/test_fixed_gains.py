"""Columns of beliefs that belong to gains that are held, and what is left without them."""

from types import SimpleNamespace

import numpy as np
import pytest

from ident.estimation.all_joints import GIVEN_STD
from ident.estimation.intervals import UNCERTAINTIES
from ident.estimation.known_gains import KnownGains, shares
from ident.estimation.problem import GainOptions

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


def test_the_covariance_of_gains_replaces_that_of_the_priors_which_fix_them(gains, monkeypatch):
    monkeypatch.setitem(UNCERTAINTIES, "classical", lambda rows, influence: 0.3 * influence @ influence.T)
    influence, rivals = np.array([[0.2, -0.7], [0.5, 0.3]]), np.array([[0.4], [-0.9]])
    options = GainOptions(uncertainty="classical")
    told = SimpleNamespace(fit=SimpleNamespace(rows=None), influence=influence, belief=BELIEF)
    found = shares(told, options, gains, list(rivals.T))
    # A deviation of log h = -log g is one of GIVEN_STD.
    S, B = -BELIEF[:, [2, 4, 5]] / GIVEN_STD, np.hstack((BELIEF[:, [0, 1, 3]], rivals))
    np.testing.assert_allclose(found.gains, S @ gains.log_covariance @ S.T, rtol=1e-12)
    np.testing.assert_allclose(found.model, B @ B.T, rtol=1e-12)
    np.testing.assert_allclose(found.residual, 0.3 * influence @ influence.T, rtol=1e-12)
    np.testing.assert_allclose(found.total, found.residual + found.gains + found.model, rtol=1e-12)
    J = np.array([[0.6, -1.7]])
    np.testing.assert_allclose(found.of(J).total, J @ found.total @ J.T, rtol=1e-12)
    relative = shares(told, options, None, list(rivals.T))
    B = np.hstack((BELIEF, rivals))  # of the scale alone, which is exact
    np.testing.assert_allclose(relative.total, found.residual + B @ B.T, rtol=1e-12)
