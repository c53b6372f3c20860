"""Gains for use: their covariance holds every share, what cannot be is refused; torques, and fits that hold gains."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from estimates import gain_estimate
from exact import GAIN, TRUSTING, exact_problem
from unseen_motions import loaded_motion, model
from weighings import PLAIN, known

from ident.estimation.all_joints import GIVEN_STD
from ident.estimation.estimate import GainCurve, GainEstimate
from ident.estimation.intervals import UNCERTAINTIES
from ident.estimation.known_gains import KnownGains, check_comparable, estimated_gains, joint_torque, shares
from ident.estimation.problem import GainOptions, Problem
from ident.parameters.arm import arm_in_use, gain_ratios
from ident.recordings.recording import Recording
from ident.support.errors import GainsError
from ident.unseen import predicted

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


# Gains that depend on the current: the curve in closed form, and every use of gains through it

K = ((-0.0007, 0.0004, -0.0003), (0.0005, -0.0003, 0.0009))
CURVE = GainCurve(current=3.0, largest=5.0, slope=0.02, by_sign=-0.03, covariance=K)
OTHER = GainCurve(current=0.7, largest=1.9, slope=-0.05, by_sign=0.0, covariance=K)


def test_a_gain_falls_in_proportion_to_the_size_of_the_current_and_differs_between_signs_up_to_the_largest_one():
    i = np.array([[2.0, -2.0, 0.0], [7.0, -7.0, 5.0]])
    np.testing.assert_allclose(CURVE.relative(i), [[1.05, 0.99, 1.06], [0.99, 0.93, 0.99]], rtol=1e-14)
    np.testing.assert_allclose(CURVE.even.relative(np.array([2.0, -3.0, 9.0])), [1.02, 1.0, 0.96], rtol=1e-14)


def test_the_variance_of_a_gain_is_that_of_the_sum_with_what_is_correlated():
    for i, x in ((2.0, (1.0, -1.0)), (-2.0, (1.0, 1.0)), (7.0, (-2.0, -1.0))):
        J, C = np.array((1.0, *x)), np.array([[0.0, K[0][0], K[1][0]], *K])
        C[0, 1:] = C[1:, 0]
        np.testing.assert_allclose(CURVE.rel_variance(np.array([i])), J @ C @ J, rtol=1e-12)


def test_a_curve_is_said_in_one_line():
    for curve, words in (
        (CURVE, " at a current of 3, falls to 39.36 at 5, the largest seen; 3 % larger at positive"),
        (OTHER, " at a current of 0.7, rises to 43.46 at 1.9, the largest seen"),
        (replace(CURVE, slope=0.0, by_sign=0.03), "; 3 % smaller at positive and larger at negative"),
    ):
        assert curve.words(1, 41.0, "N m").startswith(f"joint 2: 41 N m/unit{words}")


def bent(estimate: GainEstimate, joint: int, curve: GainCurve) -> GainEstimate:
    joints = tuple(replace(each, curve=curve) if j == joint else each for j, each in enumerate(estimate.joints))
    return replace(estimate, joints=joints)


def test_gains_at_currents_are_masked_where_refused_and_beyond_the_largest_current():
    estimate = bent(gain_estimate(2.0, None, -5.0, std=0.1, reason="no load"), 2, CURVE)
    at = estimate.gain_at(np.array([[9.0, 2.0, 2.0], [0.5, 0.1, -5.1], [-7.0, 0.2, -5.0]]))
    np.testing.assert_array_equal(at.mask, [[False, True, False], [False, True, True], [False, True, False]])
    np.testing.assert_allclose(at.compressed(), [2.0, -5.25, 2.0, 2.0, -4.65], rtol=1e-14)
    np.testing.assert_allclose(estimate.gain_at(np.array([1.0, 1.0, 2.0])).compressed(), [2.0, -5.25], rtol=1e-14)
    assert estimated_gains(estimate).curves == {2: CURVE}


def test_torque_is_the_gain_at_the_current_times_the_current():
    found = joint_torque(LOG, gains(curves={2: CURVE}))
    share, x = np.array([1.0 - 0.02 - 0.03, 0.99, 1.06]), np.array([[-1.0, 1.0], [-2.0, -1.0], [3.0, 0.0]])
    np.testing.assert_allclose(found.tau, np.transpose([2.0 * V[:, 0], -3.0 * share * V[:, 2]]), rtol=1e-14)
    variance = 0.01 + 2.0 * x @ (K[0][0], K[1][0]) + np.einsum("ka,ab,kb->k", x, np.array(K)[:, 1:], x)
    np.testing.assert_allclose(found.std[:, 1], np.abs(found.tau[:, 1]) * np.sqrt(variance), rtol=1e-12)
    np.testing.assert_allclose(found.std[:, 0], 0.2 * np.abs(V[:, 0]), rtol=1e-12)


def test_gains_that_change_their_sign_with_the_current_are_refused():
    gains(curves={2: replace(CURVE, slope=0.49, by_sign=0.0)})
    for wrong in ({"slope": 0.51}, {"slope": -0.33}, {"by_sign": 1.07}, {"by_sign": -1.07}):
        with pytest.raises(GainsError, match="joint 3: its gain changes its sign with the current"):
            gains(curves={2: replace(CURVE, **wrong)})


def test_gains_are_compared_at_the_current_of_the_others():
    mine = gains(curves={0: OTHER, 2: CURVE})
    found = mine.at_currents_of({2: replace(OTHER, current=4.0)})
    assert not found.curves
    np.testing.assert_allclose(found.value, [2.0, -3.0 * 0.98], rtol=1e-14)
    log = mine.log_covariance
    more = 2.0 * -1.0 * K[0][0] + K[0][1]
    np.testing.assert_allclose(found.log_covariance - log, np.diag([0.0, more]), rtol=1e-12, atol=1e-17)
    np.testing.assert_array_equal(mine.at_currents_of({}).value, mine.value)


def curved(problem: Problem, curves: dict[int, GainCurve]) -> Problem:
    """The same torques, from drives with these curves: currents u = relative(v) v, solved for v."""

    def solved(joint: int, u: np.ndarray) -> np.ndarray:
        v = u
        for _ in range(60 if joint in curves else 0):
            v = u / curves[joint].relative(v)
        return v

    motions = []
    for each in problem.motions:
        rows = tuple(replace(one, V=solved(j, one.V)) for j, one in enumerate(each.observation.joints))
        motions.append(replace(each, observation=replace(each.observation, joints=rows)))
    return replace(problem, motions=tuple(motions))


@pytest.fixture
def curves() -> dict[int, GainCurve]:
    """Of two joints, with currents up to some 100 and 10 units."""
    return {1: replace(CURVE, current=70.0, largest=150.0, slope=2e-3), 2: replace(OTHER, current=50.0, slope=-1e-3)}


def test_an_arm_is_identified_through_the_curve(structure, rng, curves):
    chi = rng.uniform(0.5, 2.0, 84)
    plain = exact_problem(structure, [(chi, None, None)], GAIN, rng, options=TRUSTING, noise=1e-5)
    problem, of_gains = curved(plain, curves), replace(known(), curves=curves)
    found = arm_in_use(problem, of_gains).in_si()[0]
    np.testing.assert_allclose(found, arm_in_use(plain, known()).in_si()[0], rtol=1e-6, atol=1e-8)
    one, other = gain_ratios(problem, PLAIN, of_gains), gain_ratios(plain, PLAIN)
    np.testing.assert_allclose(one.ratios.value, other.ratios.value, rtol=1e-6)
    assert one.friction[1][0].value == pytest.approx(other.friction[1][0].value, rel=1e-6)


def test_a_motion_is_predicted_through_the_curve(structure, heavy, rng, curves):
    unseen, base = loaded_motion(structure, heavy, rng)
    (part,) = unseen.parts
    (seen,) = curved(Problem(structure, (part,), TRUSTING), curves).motions
    plain = model(structure, base, GAIN)
    found = predicted(replace(unseen, parts=(seen,)), replace(plain, gains=replace(plain.gains, curves=curves)))
    same = predicted(unseen, plain)
    for one, other in zip(found.joints, same.joints, strict=True):
        assert one.rel_error == pytest.approx(other.rel_error, rel=0.1)  # currents differ by a few per cent
    assert found.joints[2].gain_rel_error == pytest.approx(same.joints[2].gain_rel_error, abs=1e-9)
    assert predicted(replace(unseen, parts=(seen,)), plain).joints[1].rel_error > 10.0 * same.joints[1].rel_error
