"""A motion that no fit has seen, predicted from exact states: errors that follow from what is put in."""

from dataclasses import replace

import numpy as np
import pytest
from exact import GAIN, TRUSTING, exact_problem

from ident.diagnosis.diagnosis import Diagnosed
from ident.estimation.known_gains import KnownGains, stated_gains
from ident.payload_identification.gains_outcome import arm_in_use
from ident.recordings.motion import Motion
from ident.recordings.recording import Recording
from ident.support.errors import Contradiction, GainsError
from ident.unseen import BETTER, NO_DIFFERENT, WORSE, UnseenMotion, UsedModel, explained, predicted, used_model

LOG = Motion(Recording(np.arange(9.0), *2 * [np.outer(np.arange(9.0), np.ones(6))], "new"), None)
"""Its samples are nobody's: what they give is made apart."""
OFF = np.array([1.25, 1.0, 0.8, 1.0, 1.0, 2.0])


@pytest.fixture
def motion(structure, heavy, rng) -> tuple[UnseenMotion, np.ndarray]:
    """Exact states of a loaded motion, ready to be predicted, and the arm's base parameters."""
    chi = rng.uniform(0.5, 2.0, 84)
    problem = exact_problem(structure, [(chi, heavy, heavy)], GAIN, rng, options=TRUSTING, noise=1e-3)
    return UnseenMotion(
        log=replace(LOG, payload=heavy), parts=problem.motions, found=Diagnosed()
    ), structure.base.regrouping @ chi


def model(structure, base: np.ndarray, gain: np.ndarray, joints: tuple[int, ...] = (0, 1, 2, 3, 4, 5)) -> UsedModel:
    at = np.array(joints)
    gains = KnownGains(
        names=structure.arm.joint_names, joints=at, value=gain[at], covariance=np.zeros((len(at), len(at)))
    )
    return UsedModel(gains=gains, base=base, fitted={2: 0.017})


def test_a_gain_k_times_too_large_leaves_1_less_1_over_k_of_the_current(structure, motion):
    unseen, base = motion
    found = predicted(unseen, model(structure, base, GAIN), model(structure, base, OFF * GAIN))
    # Noise of 0.1 % of each joint's rms current.
    np.testing.assert_allclose([each.rel_error for each in found.joints], 1e-3, rtol=0.2)
    np.testing.assert_allclose([each.other_rel_error for each in found.joints], np.abs(1.0 / OFF - 1.0), atol=2e-3)
    np.testing.assert_allclose(found.other_rel_error, np.sqrt(np.mean((1.0 / OFF - 1.0) ** 2)), atol=2e-3)
    assert found.verdict == BETTER
    assert found.passed
    assert [each.fitted_rel_error for each in found.joints] == [None, None, 0.017, None, None, None]


def test_a_motion_of_which_nothing_is_predicted_on_a_joint_is_refused(structure, motion):
    unseen, base = motion
    turned = np.array([1.0, 1.0, 1.0, -1.0, 1.0, 1.0]) * GAIN
    with pytest.raises(Contradiction, match="the motion to predict: nothing of the current of joint 4 is predicted"):
        explained(predicted(unseen, model(structure, base, turned), model(structure, base, GAIN)))
    found = predicted(unseen, model(structure, base, turned))  # asked of any gains, it is a number
    np.testing.assert_allclose(found.joints[3].rel_error, 2.0, atol=3e-3)
    assert predicted(unseen, model(structure, base, GAIN), model(structure, base, turned)).verdict == BETTER
    small = np.array([1.0, 0.51, 1.0, 1.0, 1.0, 1.0]) * GAIN  # 96 % too much current
    found = explained(predicted(unseen, model(structure, base, small))).joints[1]
    np.testing.assert_allclose(found.rel_error, 1.0 / 0.51 - 1.0, atol=3e-3)


def test_what_is_worse_and_what_is_the_same_does_not_pass(structure, motion):
    unseen, base = motion
    right, off = model(structure, base, GAIN), model(structure, base, OFF * GAIN)
    assert predicted(unseen, off, right).verdict == WORSE
    assert predicted(unseen, right, right).verdict == NO_DIFFERENT
    # A gain 1e-5 off beside noise of 1e-3: what differs is chance, which a test at 5 % takes for more once in 20 seeds.
    assert predicted(unseen, right, model(structure, base, (1.0 + 1e-5) * GAIN)).verdict == NO_DIFFERENT
    assert not predicted(unseen, off, right).passed
    assert not predicted(unseen, right, right).passed
    assert predicted(unseen, off).verdict is None
    assert predicted(unseen, off).passed


def test_the_payload_is_part_of_the_prediction(structure, motion, heavy):
    unseen, base = motion
    double = replace(unseen, log=replace(unseen.log, payload=replace(heavy, mass=2.0 * heavy.mass)))
    right, off = (predicted(each, model(structure, base, GAIN)).rel_error for each in (unseen, double))
    assert off > 10.0 * right


def test_gains_are_compared_on_joints_that_have_one_in_both(structure, motion):
    unseen, base = motion
    found = predicted(unseen, model(structure, base, GAIN, (0, 1, 2, 3)), model(structure, base, OFF * GAIN, (2, 3, 5)))
    assert [each.rel_error is None for each in found.joints] == [False, False, False, False, True, True]
    assert [each.other_rel_error is None for each in found.joints] == [True, True, False, False, True, False]
    both = [found.joints[j].other_rel_error for j in (2, 3)]
    assert found.other_rel_error == pytest.approx(np.sqrt(np.mean(np.square(both))), rel=1e-12)
    with pytest.raises(GainsError, match="no joint has one here and among those to compare with"):
        predicted(unseen, model(structure, base, GAIN, (0, 1)), model(structure, base, GAIN, (2, 3)))


def test_a_factor_common_to_all_gains_shows_with_a_payload_alone(structure, heavy, rng):
    chi = rng.uniform(0.5, 2.0, 84)
    motions = [(chi, None, None), (chi, None, None), (chi, heavy, heavy)]
    problem = exact_problem(structure, motions, GAIN, rng, options=TRUSTING, noise=1e-3)
    bare, parts = replace(problem, motions=problem.motions[:1]), problem.motions[1:]
    models = [used_model(arm_in_use(bare, stated_gains(structure.arm, k * GAIN)), structure) for k in (1.0, 1.3)]
    on_bare, on_loaded = (
        predicted(UnseenMotion(log=replace(LOG, payload=each), parts=(part,), found=Diagnosed()), *models)
        for each, part in zip((None, heavy), parts, strict=True)
    )
    assert on_bare.other_rel_error == pytest.approx(on_bare.rel_error, rel=1e-3)
    assert on_loaded.verdict == BETTER
    assert on_loaded.other_rel_error > 5.0 * on_loaded.rel_error
