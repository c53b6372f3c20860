"""What moved from one set of gains to another."""

import numpy as np
import pytest
from scipy import stats

from ident.estimation.gain_comparison import compared
from ident.estimation.known_gains import KnownGains
from ident.support.errors import GainsError

NAMES = ("a", "b", "c", "d")


def gains(joints, value, rel_std, correlation: float = 0.0, names=NAMES) -> KnownGains:
    value, std = np.array(value), np.abs(value) * np.array(rel_std)
    unit = np.full((len(std), len(std)), correlation) + (1.0 - correlation) * np.eye(len(std))
    return KnownGains(names=names, joints=np.array(joints), value=value, covariance=unit * np.outer(std, std))


def test_a_change_is_held_against_the_deviations_of_both_sets():
    A = gains([0, 1, 2], [2.0, -3.0, 5.0], [0.03, 0.01, 0.02])
    B = gains([0, 1, 2], [2.1, -3.3, 5.1], [0.04, 0.02, 0.01])
    found = compared(A, B)
    std, ratio = np.hypot([0.03, 0.01, 0.02], [0.04, 0.02, 0.01]), np.array([1.05, 1.1, 1.02])
    told = [(each.std, each.rel_change, each.rel_std) for each in found.each]  # the last of a ratio, as the change is
    np.testing.assert_allclose(told, np.transpose((std, ratio - 1.0, std * ratio)), rtol=1e-12)  # rounding
    x = np.log(ratio)
    assert [each.moved for each in found.each] == [False, True, False]  # 1.0, 4.3 and 0.9 deviations
    np.testing.assert_allclose(found.limit, stats.norm.isf(0.025 / 3), rtol=1e-12)  # Bonferroni, two-sided
    np.testing.assert_allclose(found.together.chi2, np.sum((x / std) ** 2), rtol=1e-12)
    np.testing.assert_allclose(found.together.p, stats.chi2(3).sf(np.sum((x / std) ** 2)), rtol=1e-12)
    weight = std**-2.0
    np.testing.assert_allclose(np.log1p(found.scale.rel_change), weight @ x / weight.sum(), rtol=1e-12)
    np.testing.assert_allclose(found.scale.std, weight.sum() ** -0.5, rtol=1e-12)
    assert found.moved


def test_a_scale_common_to_all_joints_is_told_apart_from_a_pattern():
    A = gains([0, 1, 3], [2.0, -3.0, 5.0], [0.01, 0.03, 0.02])
    found = compared(A, gains([0, 1, 3], [2.2, -3.3, 5.5], [0.02, 0.01, 0.02]))
    np.testing.assert_allclose(found.scale.rel_change, 0.1, rtol=1e-12)
    assert found.scale.moved
    np.testing.assert_allclose([np.log1p(each.rel_change) for each in found.apart], 0.0, atol=1e-12)
    variance = np.array([0.01, 0.03, 0.02]) ** 2 + np.array([0.02, 0.01, 0.02]) ** 2
    # The scale is the weighted mean, whose variance is its covariance with each change.
    left = variance - 1.0 / np.sum(1.0 / variance)
    np.testing.assert_allclose([each.std for each in found.apart], np.sqrt(left), rtol=1e-12)
    np.testing.assert_allclose(found.pattern.p, 1.0, rtol=1e-9)
    assert (found.pattern.moved, found.pattern.freedom, found.together.moved) == (False, 2, True)


def test_correlated_errors_hide_a_common_change_and_show_a_difference():
    # A correlation of 0.9 makes the sum of two changes uncertain and their difference sure: with deviation 0.1 each,
    # var(x1 + x2) = 0.038, var(x1 - x2) = 0.002, and chi2 is (sum)^2 / 0.038 + (difference)^2 / 0.002, halves of both.
    exact = gains([0, 1], [1.5, 2.5], [1e-9, 1e-9])
    apart = gains([0, 1], [1.5 * np.exp(0.1), 2.5 * np.exp(-0.1)], [0.1, 0.1], 0.9)
    alike = gains([0, 1], [1.5 * np.exp(0.1), 2.5 * np.exp(0.1)], [0.1, 0.1], 0.9)
    np.testing.assert_allclose(compared(exact, apart).together.chi2, 0.2**2 / 0.002, rtol=1e-6)  # 1e-9 beside 0.1
    np.testing.assert_allclose(compared(exact, alike).together.chi2, 0.2**2 / 0.038, rtol=1e-6)
    assert compared(exact, apart).together.moved
    assert not compared(exact, alike).moved


def test_a_joint_that_moved_alone_does_not_draw_the_common_scale_along():
    # The joint that moved is the surest one, which a mean would follow; the errors of all are related.
    A = gains([0, 1, 2, 3], [2.0, 3.0, 5.0, 7.0], [0.03, 0.002, 0.02, 0.01], 0.3)
    B = gains([0, 1, 2, 3], [2.04, 6.12, 5.1, 7.14], [0.03, 0.002, 0.02, 0.01], 0.3)
    found = compared(A, B)
    assert found.sharing.tolist() == [0, 2, 3]
    np.testing.assert_allclose(found.scale.rel_change, 0.02, rtol=1e-9)
    np.testing.assert_allclose([each.rel_change for each in found.apart], [0.0, 1.0, 0.0, 0.0], atol=1e-9)
    assert [each.moved for each in found.apart] == [False, True, False, False]
    assert (found.pattern.moved, found.pattern.freedom) == (True, 3)  # the test of all joints stays one of all joints
    rest = [gains([0, 2, 3], known.value[[0, 2, 3]], [0.03, 0.02, 0.01], 0.3) for known in (A, B)]
    np.testing.assert_allclose(found.scale.std, compared(*rest).scale.std, rtol=1e-9)


def test_where_no_scale_is_common_to_more_than_half_there_is_none():
    A, B = (gains([0, 1, 2, 3], value, [0.01] * 4) for value in ([2.0] * 4, [2.0, 2.0, 3.0, 5.0]))
    found = compared(A, B)  # two of four have one scale
    assert not len(found.sharing)
    np.testing.assert_allclose(np.log1p(found.scale.rel_change), np.log([1.5, 2.5]).sum() / 4.0, rtol=1e-12)
    chance = gains([0, 1, 2, 3], [2.0, 2.0, 2.0, 2.12], [0.01] * 4)  # chi2 12.7 of 3: one time in 190
    assert compared(A, chance).sharing.tolist() == [0, 1, 2, 3]


def test_a_joint_without_a_name_is_any_of_that_number():
    named, bare = (gains([0, 1], [2.0, 3.0], [0.1, 0.1], names=names) for names in (("a", "b"), ("1", "2")))
    for pair in ((named, bare), (bare, named), (bare, bare)):
        assert compared(*pair).joints.tolist() == [0, 1]
    swapped = gains([0, 1], [2.0, 3.0], [0.1, 0.1], names=("2", "1"))
    with pytest.raises(GainsError, match="have different joints"):
        compared(named, swapped)


def test_a_gain_that_turned_moved_and_joints_with_a_gain_in_one_set_only_are_named():
    turned = compared(gains([0, 1], [2.0, 3.0], [0.1, 0.1]), gains([0, 1], [2.0, -3.0], [0.1, 0.1]))
    assert [each.moved for each in turned.each] == [False, True]
    assert turned.moved
    found = compared(gains([0, 1, 3], [2.0, 3.0, 4.0], [0.1] * 3), gains([1, 2, 3], [3.1, 4.0, 4.1], [0.1] * 3))
    assert found.joints.tolist() == [1, 3]
    assert found.missing == ((0, "A"), (2, "B"))
    np.testing.assert_allclose([each.rel_change for each in found.each], [0.1 / 3.0, 0.025], rtol=1e-12)
    one = compared(gains([2], [2.0], [0.1]), gains([2], [2.1], [0.1]))
    assert (one.pattern, one.together.freedom) == (None, 1)


def test_what_cannot_be_compared_is_refused():
    for B, words in (
        (gains([0], [2.0], [0.1], names=("a", "b", "d", "c")), "different joints: a, b, c, d against a, b, d, c"),
        (gains([2], [2.0], [0.1]), "no joint has a gain in both sets"),
        (gains([0, 1], [2.0, 3.0], [0.1, 0.0]), "joint 2: neither gain has a standard deviation"),
        (gains([0, 1], [2.0, 3.0], [0.1, 0.2], 1.0), "the covariance of the gains is singular"),
    ):
        with pytest.raises(GainsError, match=words):
            compared(gains([0, 1], [2.0, 3.0], [0.0, 0.0]), B)
