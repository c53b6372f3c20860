"""Gains that depend on the current: the curve in closed form, and every use of gains through it."""

from dataclasses import replace

import numpy as np
import pytest
from estimates import gain_estimate
from exact import GAIN, TRUSTING, exact_problem
from unseen_motions import loaded_motion, model
from weighings import PLAIN, known, weighed

from ident.estimation.estimate import GainEstimate
from ident.estimation.gain_curve import GainCurve
from ident.estimation.known_gains import KnownGains, estimated_gains, joint_torque
from ident.estimation.problem import Problem
from ident.parameters.arm import arm_in_use, gain_ratios
from ident.parameters.payload import payload_of
from ident.recordings.recording import Recording
from ident.support.errors import GainsError
from ident.unseen import predicted

K = ((-0.0007, 0.0004, -0.0003), (0.0005, -0.0003, 0.0009))
CURVE = GainCurve(current=3.0, largest=5.0, slope=0.02, by_sign=-0.03, covariance=K)
OTHER = GainCurve(current=0.7, largest=1.9, slope=-0.05, by_sign=0.0, covariance=K)
V = np.array([[1.5, 2.0, -4.0], [-0.5, 3.0, 7.0], [2.5, -6.0, 0.0]])


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


def bent_gains(**changes) -> KnownGains:
    stated = {"joints": np.array([0, 2]), "value": np.array([2.0, -3.0]), "curves": {2: CURVE}}
    covariance = np.array([[0.04, -0.01], [-0.01, 0.09]])
    return KnownGains(**{"names": ("a", "b", "c"), "covariance": covariance, **stated, **changes})


def test_torque_is_the_gain_at_the_current_times_the_current():
    found = joint_torque(Recording(np.array([0.3, 0.5, 0.7]), np.cumsum(V, axis=0), V, "log"), bent_gains())
    share, x = np.array([1.0 - 0.02 - 0.03, 0.99, 1.06]), np.array([[-1.0, 1.0], [-2.0, -1.0], [3.0, 0.0]])
    np.testing.assert_allclose(found.tau, np.transpose([2.0 * V[:, 0], -3.0 * share * V[:, 2]]), rtol=1e-14)
    variance = 0.01 + 2.0 * x @ (K[0][0], K[1][0]) + np.einsum("ka,ab,kb->k", x, np.array(K)[:, 1:], x)
    np.testing.assert_allclose(found.std[:, 1], np.abs(found.tau[:, 1]) * np.sqrt(variance), rtol=1e-12)
    np.testing.assert_allclose(found.std[:, 0], 0.2 * np.abs(V[:, 0]), rtol=1e-12)


def test_gains_that_change_their_sign_with_the_current_are_refused():
    bent_gains(curves={2: replace(CURVE, slope=0.49, by_sign=0.0)})
    for wrong in ({"slope": 0.51}, {"slope": -0.33}, {"by_sign": 1.07}, {"by_sign": -1.07}):
        with pytest.raises(GainsError, match="joint 3: its gain changes its sign with the current"):
            bent_gains(curves={2: replace(CURVE, **wrong)})


def test_gains_are_compared_at_the_current_of_the_others():
    mine = bent_gains(curves={0: OTHER, 2: CURVE})
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


def test_a_payload_is_weighed_through_the_curve(structure, heavy, rng, curves):
    plain = weighed(structure, heavy, rng, noise=1e-4)
    problem = curved(plain, curves)
    of_gains = replace(known(), curves=curves)
    found, same = payload_of(problem, of_gains, PLAIN), payload_of(plain, known(), PLAIN)
    # Initial values follow from currents as they are; the search ends within 1e-8.
    np.testing.assert_allclose(found.value, same.value, rtol=1e-6, atol=1e-9)
    off = payload_of(problem, known(), PLAIN)
    assert np.linalg.norm(off.value - heavy.known_part().chi) > 0.01


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
