"""`nls` beyond what every estimator must do: gains without any payload."""

import numpy as np
import pytest
from exact import GAIN, TRUSTING, exact_observation, values

from ident.estimation.estimators.nls import AllJointsOptions, all_joints_gains
from ident.estimation.problem import ObservedMotion, Problem
from ident.support.errors import NotIdentifiable, OptionError


@pytest.fixture
def bare(structure, rng) -> Problem:
    """Two motions of one arm, nothing mounted."""
    chi, nothing = rng.uniform(0.5, 2.0, 84), np.zeros(10)
    motions = [exact_observation(structure, chi, nothing, GAIN, rng, noise=0.0, rows=200) for _ in range(2)]
    return Problem(structure, tuple(ObservedMotion(each, None) for each in motions), TRUSTING)


@pytest.mark.parametrize("joint", [2, 5])
def test_bare_motions_and_one_given_gain_give_the_others(bare, joint):
    options = AllJointsOptions(gain_joint=joint, gain_value=float(GAIN[joint - 1]))
    estimate = all_joints_gains(bare, options)
    # Exact rows; the search ends at steps of 1e-11 in the logarithms.
    np.testing.assert_allclose(values(estimate), GAIN, rtol=1e-8)
    twice = all_joints_gains(bare, AllJointsOptions(gain_joint=joint, gain_value=2.0 * float(GAIN[joint - 1])))
    np.testing.assert_allclose(values(twice), 2.0 * GAIN, rtol=1e-8)


def test_without_payload_and_given_gain_the_scale_is_free(bare):
    with pytest.raises(NotIdentifiable, match="only ratios of gains are identifiable; mount one"):
        all_joints_gains(bare, AllJointsOptions())


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"gain_joint": 3}, "gain_joint and gain_value must be given together"),
        ({"gain_value": 3.0}, "gain_joint and gain_value must be given together"),
        ({"gain_joint": 2, "gain_value": 0.0}, "gain_value = 0: expected a gain that is not zero"),
    ],
)
def test_half_a_given_gain_is_none(given, words):
    with pytest.raises(OptionError, match=words):
        AllJointsOptions(**given)


def test_a_given_gain_is_of_a_joint_of_the_arm(bare):
    with pytest.raises(OptionError, match="gain_joint = 7: the arm has joints 1 to 6"):
        all_joints_gains(bare, AllJointsOptions(gain_joint=7, gain_value=1.5))
