"""Residuals that are autocorrelated are told where they make a deviation much larger."""

from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import LOOSE, all_joints, logs_of, problem_of, with_current
from real_friction import Truth

from ident.diagnosis.diagnosis import Severity
from ident.diagnosis.gain_checks import MUCH, autocorrelation, lag_one
from ident.estimation.intervals import Rows, classical
from ident.estimation.problem import Problem


@pytest.fixture(scope="module")
def lasting(axes) -> Problem:
    """Logs in which a drift of more than a second moves the current of joint 2."""
    rng = np.random.default_rng(6)

    def drifting(v, t, q, dq):
        noise = np.convolve(rng.normal(size=len(v) + 160), np.ones(160) / 160.0**0.5, "valid")[: len(v)]
        return v + 0.04 * np.std(v) * noise

    return problem_of(axes, [with_current(log, 1, drifting) for log in logs_of(Truth())])


def test_residuals_that_are_white_are_no_doubt(sound_estimate):
    found = autocorrelation(sound_estimate)
    assert (found.severity, found.advice) == (Severity.GOOD, None)
    assert found.value < MUCH


def test_residuals_that_last_are_told_with_the_ratio_of_deviations(lasting):
    estimate = all_joints(lasting)
    found = autocorrelation(estimate)
    assert (found.severity, found.joints) == (Severity.WEAK, (1,))
    white = np.sqrt(np.diag(classical(estimate.solution.rows, estimate.solution.influence)))
    ratio = float(np.sqrt(estimate.covariance[1, 1])) / white[1]  # of 1/g, as the influence is
    np.testing.assert_allclose(found.value, ratio, rtol=1e-9)  # rounding of sums of 700 rows
    assert f"accounts for it is {ratio:.2g} times that of white residuals" in found.sentence


def test_a_deviation_that_takes_residuals_as_white_is_held_against_one_that_does_not(lasting):
    aware = autocorrelation(all_joints(lasting))
    unaware = autocorrelation(all_joints(replace(lasting, options=replace(LOOSE, uncertainty="classical"))))
    assert unaware.severity is Severity.WEAK
    assert "accounts for it would be" in unaware.sentence
    np.testing.assert_allclose(unaware.value, aware.value, rtol=1e-6)  # the default is the cautious one


def test_an_estimate_without_a_gain_has_no_deviation_to_tell(sound_estimate):
    assert autocorrelation(replace(sound_estimate, joints=())) is None


def test_the_correlation_of_neighbours_is_that_of_rows_that_follow_each_other():
    left = np.array([1.0, 2.0, -3.0, 5.0, 7.0, -2.0])
    rows = Rows(
        V=left, residual=left, joint=np.array([0, 0, 0, 0, 0, 1]), motion=np.array([0, 0, 0, 1, 1, 1]),
        position=np.array([4, 5, 7, 0, 1, 2]), row_period=0.05, unknowns={0: 1, 1: 0}, weight=np.ones(6),
        explained=np.zeros((6, 0)),
    )  # fmt: skip
    # Pairs (1, 2) and (5, 7); -3 follows after a gap, 5 begins a motion.
    np.testing.assert_allclose(lag_one(rows, 0), 37.0 / np.sqrt(26.0 * 53.0), rtol=1e-12)
