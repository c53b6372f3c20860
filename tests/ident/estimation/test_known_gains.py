"""Gains for use: their covariance holds every share, and what cannot be is refused."""

from dataclasses import replace

import numpy as np
import pytest
from estimates import gain_estimate

from ident.estimation.known_gains import KnownGains, estimated_gains
from ident.support.errors import GainsError

NAMES = ("a", "b", "c")
COVARIANCE = np.array([[0.04, -0.01], [-0.01, 0.09]])


def gains(**changes) -> KnownGains:
    stated = {"names": NAMES, "joints": np.array([0, 2]), "value": np.array([2.0, -3.0]), "covariance": COVARIANCE}
    return KnownGains(**{**stated, **changes})


def test_covariance_of_an_estimate_is_that_of_the_inverses_and_of_what_moves_joints_together():
    estimate = gain_estimate(2.0, None, -5.0, std=0.1, reason="no load")
    inverse = np.array([[0.0011, -0.0004], [-0.0004, 0.0007]])
    payload, model = np.array([[0.02, 0.01], [-0.03, 0.005]]), np.array([[0.04], [0.007]])
    solution = replace(estimate.solution, payload=payload, model=model)
    found = estimated_gains(replace(estimate, covariance=inverse, solution=solution))
    assert found.joints.tolist() == [0, 2]
    assert found.names == ("j1", "j2", "j3")
    # dg = -g^2 d(1/g), and g times each relative share; written out for the pair 2 and -5
    first = 2.0**4 * 0.0011 + 2.0**2 * (0.02**2 + 0.01**2 + 0.04**2)
    second = 5.0**4 * 0.0007 + 5.0**2 * (0.03**2 + 0.005**2 + 0.007**2)
    mixed = 2.0**2 * 5.0**2 * -0.0004 + 2.0 * -5.0 * (0.02 * -0.03 + 0.01 * 0.005 + 0.04 * 0.007)
    np.testing.assert_allclose(found.covariance, [[first, mixed], [mixed, second]], rtol=1e-12)  # rounding
    np.testing.assert_allclose(found.std, np.sqrt([first, second]), rtol=1e-12)
    np.testing.assert_allclose(found.log_covariance[0, 1], mixed / -10.0, rtol=1e-12)


def test_a_joint_without_solution_is_left_out_wherever_it_stands():
    found = estimated_gains(gain_estimate(None, 3.0, None, 0.5, std=0.1, reason="no load"))
    assert found.joints.tolist() == [1, 3]
    assert found.value.tolist() == [3.0, 0.5]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"value": np.array([2.0])}, r"2 joints, values \(1,\)"),
        ({"covariance": np.eye(3)}, r"covariance \(3, 3\) do not fit"),
        ({"joints": np.array([2, 0])}, r"joints \[3, 1\]; expected increasing numbers from 1 to 3"),
        ({"joints": np.array([-1, 2])}, r"joints \[0, 3\]; expected increasing"),
        ({"value": np.array([2.0, 0.0])}, "joint 3: a gain of 0 is invalid; refuse the joint instead"),
        ({"covariance": np.diag([0.1, -0.1])}, "negative variance"),
        ({"covariance": np.array([[0.04, 0.01], [0.02, 0.09]])}, "not symmetric"),
        ({"covariance": np.array([[0.04, 0.07], [0.07, 0.09]])}, "negative eigenvalue"),
    ],
)
def test_what_no_gains_can_be_is_refused(changes, words):
    with pytest.raises(GainsError, match=words):
        gains(**changes)


def test_gains_taken_as_exact_have_no_deviation():
    assert gains(covariance=np.zeros((2, 2))).std.tolist() == [0.0, 0.0]


def test_gains_belong_to_an_arm_by_number_and_name(arm):
    n, one = arm.n, {"joints": np.array([1]), "value": np.array([2.0]), "covariance": np.array([[0.3]])}
    gains(names=arm.joint_names, **one).check_arm(arm)
    gains(names=tuple("123456"), **one).check_arm(arm)  # a file written by hand may not name joints
    with pytest.raises(GainsError, match=f"gains of 3 joints, but robot rx90 has {n}"):
        gains(**one).check_arm(arm)
    with pytest.raises(GainsError, match="joint 2 is joint3, but that of robot rx90 is joint2"):
        gains(names=("joint1", "joint3", "joint2", *arm.joint_names[3:]), **one).check_arm(arm)
    nothing = {"joints": np.zeros(0, dtype=np.intp), "value": np.zeros(0), "covariance": np.zeros((0, 0))}
    with pytest.raises(GainsError, match="no joint has a gain"):
        gains(names=arm.joint_names, **nothing).check_arm(arm)
