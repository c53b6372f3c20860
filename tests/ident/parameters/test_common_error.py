"""Joints that agree with each other against the scale: the weight is suspect, and no single gain."""

from dataclasses import replace

import numpy as np
import pytest
from joint_masses import SCALE, weighing

from ident.parameters.weighing import AGREES, common_error


def test_joints_that_agree_on_another_mass_leave_the_weight_suspect_and_blame_no_joint():
    found = weighing(-0.077, -0.074, -0.081, -0.076, stds=(0.004, 0.006, 0.009, 0.02))
    common = common_error(found)
    assert common.joints == (0, 1, 2, 3)
    # The mean weighted by what variances are of logarithms, by hand.
    x, w = (
        np.log([0.923, 0.926, 0.919, 0.924]),
        (np.array([0.923, 0.926, 0.919, 0.924]) / (0.004, 0.006, 0.009, 0.02)) ** 2,
    )
    np.testing.assert_allclose(common.rel_error, np.expm1(w @ x / w.sum()), rtol=1e-9)
    np.testing.assert_allclose(common.rel_std, np.exp(w @ x / w.sum()) * np.hypot(w.sum() ** -0.5, SCALE), rtol=1e-9)
    assert common.apart == ()


def test_a_joint_that_departs_from_the_others_is_named_beside_what_they_have_in_common():
    found = weighing(0.051, 0.049, 0.052, -0.14, None)
    common = common_error(found)
    assert common.joints == (0, 1, 2)
    assert [each.joint for each in common.apart] == [3]
    np.testing.assert_allclose(common.apart[0].rel_error, 0.86 / 1.05066 - 1.0, atol=2e-4)
    # sqrt(1 / 0.86^2 + 1 / (3 * 1.05^2)) % of the mass, times 0.86 / 1.05
    np.testing.assert_allclose(common.apart[0].rel_std, 0.01057, atol=5e-5)


def test_a_gain_that_is_off_alone_has_nothing_in_common_with_others():
    assert common_error(weighing(0.003, 0.09, -0.004, 0.002)) is None


def test_joints_that_pass_have_no_error_in_common():
    found = weighing(0.026, 0.025, 0.024, 0.026)
    assert common_error(found) is not None
    assert common_error(replace(found, together=replace(found.together, verdict=AGREES))) is None


def test_one_sure_joint_among_unsure_ones_does_not_speak_for_all():
    assert common_error(weighing(-0.08, -0.05, -0.06, stds=(0.005, 0.05, 0.05))) is None


def test_two_joints_that_disagree_have_nothing_in_common():
    assert common_error(weighing(0.08, -0.08)) is None
    assert common_error(weighing(0.08, None)) is None
    assert common_error(weighing(0.08, 0.081)).joints == (0, 1)


@pytest.mark.parametrize(("gain_share", "agree"), [(0.0, False), (0.03, True)])
def test_errors_that_gains_have_in_common_do_not_average_out(gain_share, agree):
    found = weighing(0.05, 0.051, 0.052, 0.049, 0.048, gain_share=gain_share)
    assert (common_error(found) is None) == agree


def test_deviations_of_gains_are_in_that_of_the_common_error():
    common = common_error(weighing(0.3, 0.3, 0.3, 0.3, 0.3, gain_share=0.039))
    # In shares of the mass that is found, which is 1.3 times the stated one; the scale's own is of that.
    expected = np.linalg.norm((np.hypot(0.01, 0.039) / np.sqrt(5.0), 0.039, 1.3 * SCALE))
    np.testing.assert_allclose(common.rel_std, expected, rtol=1e-9)


def test_what_gains_have_in_common_is_at_most_the_deviation_of_the_surest():
    shares = (0.11, 0.03, 0.07)
    common = common_error(weighing(0.3, 0.3, 0.3, gain_share=shares))
    std = np.hypot(0.01, shares)
    expected = np.linalg.norm((np.sum(std**-2.0) ** -0.5, 0.03, 1.3 * SCALE))
    np.testing.assert_allclose(common.rel_std, expected, rtol=1e-9)


def test_masses_without_a_logarithm_or_a_deviation_are_left_out():
    found = weighing(-1.2, 0.08, 0.081, stds=(0.01, 0.01, 0.0))
    assert common_error(found) is None
