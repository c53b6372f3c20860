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
    masses = np.array([0.923, 0.926, 0.919, 0.924])
    x, w = np.log(masses), (masses / (0.004, 0.006, 0.009, 0.02)) ** 2
    np.testing.assert_allclose(common.rel_error, np.expm1(w @ x / w.sum()), rtol=1e-9)
    np.testing.assert_allclose(common.rel_std, np.exp(w @ x / w.sum()) * np.hypot(w.sum() ** -0.5, SCALE), rtol=1e-9)
    assert common.apart == ()


@pytest.mark.parametrize("unweighed", [0, 4])  # joints are numbered with those that do not weigh the payload
def test_a_joint_that_departs_from_the_others_is_named_beside_what_they_have_in_common(unweighed):
    masses = [0.051, 0.049, 0.052, -0.14]
    masses.insert(unweighed, None)
    common = common_error(weighing(*masses))
    first = 0 if unweighed else 1
    assert common.joints == (first, first + 1, first + 2)
    assert [each.joint for each in common.apart] == [first + 3]
    np.testing.assert_allclose(common.apart[0].rel_error, 0.86 / 1.05066 - 1.0, atol=2e-4)
    # sqrt(1 / 0.86^2 + 1 / (3 * 1.05^2)) % of the mass, times 0.86 / 1.05
    np.testing.assert_allclose(common.apart[0].rel_std, 0.01057, atol=5e-5)


def test_joints_that_pass_have_no_error_in_common():
    found = weighing(0.026, 0.025, 0.024, 0.026)
    assert common_error(found) is not None
    assert common_error(replace(found, together=replace(found.together, verdict=AGREES))) is None


def test_what_gains_have_in_common_is_at_most_the_deviation_of_the_surest():
    shares = (0.11, 0.03, 0.07)
    common = common_error(weighing(0.3, 0.3, 0.3, gain_share=shares))
    std = np.hypot(0.01, shares)
    expected = np.linalg.norm((np.sum(std**-2.0) ** -0.5, 0.03, 1.3 * SCALE))
    np.testing.assert_allclose(common.rel_std, expected, rtol=1e-9)


def test_joints_have_a_common_error_if_it_is_significant_without_any_of_them():
    five = 0.05, 0.051, 0.052, 0.049, 0.048
    for found, joints in (
        (weighing(0.003, 0.09, -0.004, 0.002), None),  # a gain that is off alone
        (weighing(-0.08, -0.05, -0.06, stds=(0.005, 0.05, 0.05)), None),  # one sure joint does not speak for all
        (weighing(0.08, -0.08), None),
        (weighing(0.08, None), None),
        (weighing(0.08, 0.081), (0, 1)),
        (weighing(-1.2, 0.08, 0.081, stds=(0.01, 0.01, 0.0)), None),  # no logarithm, no deviation
        (weighing(*five, gain_share=0.0), (0, 1, 2, 3, 4)),
        (weighing(*five, gain_share=0.03), None),  # errors that gains have in common do not average out
    ):
        common = common_error(found)
        assert (None if common is None else common.joints) == joints
