"""Gains for use: their covariance holds every share, what cannot be is refused; torques, and fits that hold gains."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from estimates import gain_estimate

from ident.estimation.all_joints import GIVEN_STD
from ident.estimation.intervals import UNCERTAINTIES
from ident.estimation.known_gains import KnownGains, check_comparable, estimated_gains, joint_torque, shares
from ident.estimation.problem import GainOptions
from ident.recordings.recording import Recording
from ident.support.errors import GainsError

NAMES = ("a", "b", "c")
COVARIANCE = np.array([[0.04, -0.01], [-0.01, 0.09]])


def gains(**changes) -> KnownGains:
    stated = {"names": NAMES, "joints": np.array([0, 2]), "value": np.array([2.0, -3.0]), "covariance": COVARIANCE}
    return KnownGains(**{**stated, **changes})


NOTHING = {"joints": np.zeros(0, dtype=np.intp), "value": np.zeros(0), "covariance": np.zeros((0, 0))}


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


def test_what_no_gains_can_be_is_refused():
    for name, value, words in (
        ("value", [2.0], r"2 joints, values \(1,\)"),
        ("covariance", np.eye(3), r"covariance \(3, 3\) do not fit"),
        ("joints", np.array([2, 0]), r"joints \[3, 1\]; expected increasing numbers from 1 to 3"),
        ("joints", np.array([-1, 2]), r"joints \[0, 3\]; expected increasing"),
        ("value", [2.0, 0.0], "joint 3: a gain of 0 is invalid; refuse the joint instead"),
        ("covariance", np.diag([0.1, -0.1]), "negative variance"),
        ("covariance", [[0.04, 0.01], [0.02, 0.09]], "not symmetric"),
        ("covariance", [[0.04, 0.07], [0.07, 0.09]], "negative eigenvalue"),
        ("covariance", 1e6 * np.array([[1.0, 1.5], [1.5, 1.0]]), "negative eigenvalue"),
    ):
        with pytest.raises(GainsError, match=words):
            gains(**{name: np.array(value)})


def test_gains_belong_to_an_arm_by_number_and_name(arm):
    n, one = arm.n, {"joints": np.array([1]), "value": np.array([2.0]), "covariance": np.array([[0.3]])}
    gains(names=arm.joint_names, **one).check_arm(arm)
    gains(names=tuple("123456"), **one).check_arm(arm)  # a file written by hand may not name joints
    with pytest.raises(GainsError, match=f"gains of 3 joints, but robot rx90 has {n}"):
        gains(**one).check_arm(arm)
    with pytest.raises(GainsError, match="joint 2 is joint3, but that of robot rx90 is joint2"):
        gains(names=("joint1", "joint3", "joint2", *arm.joint_names[3:]), **one).check_arm(arm)
    with pytest.raises(GainsError, match="no joint has a gain"):
        gains(names=arm.joint_names, **NOTHING).check_arm(arm)


V = np.array([[1.5, 2.0, -4.0], [-0.5, 3.0, 7.0], [2.5, -6.0, 0.0]])
LOG = Recording(np.array([0.3, 0.5, 0.7]), np.cumsum(V, axis=0), V, "log")


def test_there_is_a_torque_of_joints_that_have_a_gain_and_of_no_other_arm():
    found = joint_torque(LOG, gains())
    assert (found.joints.tolist(), found.t.tolist()) == ([0, 2], [0.3, 0.5, 0.7])
    np.testing.assert_allclose(found.tau, [[3.0, 12.0], [-1.0, -21.0], [5.0, 0.0]], rtol=1e-15)
    two = Recording(LOG.t, LOG.q[:, :2], LOG.v[:, :2], "two.csv")
    with pytest.raises(GainsError, match=r"two\.csv: 2 joints, but gains of 3"):
        joint_torque(two, gains())
    with pytest.raises(GainsError, match="no joint has a gain"):
        joint_torque(LOG, gains(**NOTHING))


BELIEF = np.array([[3.0, -1.0, 0.4, 7.0, 2.0, -5.0], [0.3, 0.9, -6.0, 1.7, -8.0, 0.6]])
"""Of two parameters: two beliefs of others, and those on log h of four gains."""


def test_the_covariance_of_gains_replaces_that_of_the_priors_which_fix_them(monkeypatch):
    value = np.array([2.0, -5.0, 0.7])
    covariance = np.array([[4.0, 1.0, -0.5], [1.0, 9.0, 2.0], [-0.5, 2.0, 1.5]]) * 1e-4 * np.outer(value, value)
    fixed = gains(names=("a", "b", "c", "d"), joints=np.array([0, 2, 3]), value=value, covariance=covariance)
    monkeypatch.setitem(UNCERTAINTIES, "classical", lambda rows, influence: 0.3 * influence @ influence.T)
    influence, rivals = np.array([[0.2, -0.7], [0.5, 0.3]]), np.array([[0.4], [-0.9]])
    options = GainOptions(uncertainty="classical")
    told = SimpleNamespace(fit=SimpleNamespace(rows=None), influence=influence, belief=BELIEF)
    found = shares(told, options, fixed, list(rivals.T))
    # A deviation of log h = -log g is one of GIVEN_STD.
    S, B = -BELIEF[:, [2, 4, 5]] / GIVEN_STD, np.hstack((BELIEF[:, [0, 1, 3]], rivals))
    np.testing.assert_allclose(found.gains, S @ fixed.log_covariance @ S.T, rtol=1e-12)
    np.testing.assert_allclose(found.model, B @ B.T, rtol=1e-12)
    np.testing.assert_allclose(found.residual, 0.3 * influence @ influence.T, rtol=1e-12)
    np.testing.assert_allclose(found.total, found.residual + found.gains + found.model, rtol=1e-12)
    J = np.array([[0.6, -1.7]])
    np.testing.assert_allclose(found.of(J).total, J @ found.total @ J.T, rtol=1e-12)
    relative = shares(told, options, None, list(rivals.T))
    B = np.hstack((BELIEF, rivals))  # of the scale alone, which is exact
    np.testing.assert_allclose(relative.total, found.residual + B @ B.T, rtol=1e-12)


def test_gains_of_another_sign_or_unit_are_not_of_the_same_drives():
    one, two = np.zeros((2, 2)), np.array([1, 2])
    check_comparable(gains(covariance=one), gains(joints=two, value=[-5.0, -4.0], covariance=one))
    for value, said in ((4.0, "joint 3: 4, .*same sign"), (-50.0, "joint 3: -50 is 17 times")):
        with pytest.raises(GainsError, match=said):
            check_comparable(gains(covariance=one), gains(joints=two, value=[5.0, value], covariance=one))
