"""Currents that are logged later than positions: how late, what it does to a gain, and what is said of it."""

from dataclasses import replace

import numpy as np
import pytest
from ident.delay import SURE, Delay, common_delay, joint_delay
from ident.lag import MOST, SEEN, Lag, in_time, lag_notes, lags, with_suspects
from ident.wiring import known_wiring
from known_logs import BRICK, UR_GAIN, UR_MIDDLE, arm_of, known_logs, scara, ur_like

from ident.errors import Contradiction, NotIdentifiable
from ident.estimate import GainEstimate, IdentifiedGain, RefusedGain
from ident.estimators import ESTIMATORS
from ident.gain_system import joint_rows
from ident.identification import identify
from ident.observation import ObserveOptions, observe
from ident.options import GainOptions
from ident.problem import Problem, pair
from ident.recording import Recording
from ident.structure import Structure, structure_of

OPTIONS = ObserveOptions()


@pytest.fixture(scope="module")
def logs() -> tuple[Recording, Recording]:
    return known_logs(ur_like(), BRICK, UR_GAIN, np.random.default_rng(5), middle=UR_MIDDLE, noise=0.003)


def late(log: Recording, seconds: float, joints: slice = slice(None)) -> Recording:
    """The log with some joints' currents that much later than its positions."""
    v = log.v.copy()
    for j in range(log.n)[joints]:
        v[:, j] = np.interp(log.t - seconds, log.t, log.v[:, j])
    return Recording(log.t, log.q, v, log.name)


def problem_of(ur: Structure, bare: Recording, loaded: Recording) -> Problem:
    return pair(observe(bare, ur, OPTIONS), observe(loaded, ur, OPTIONS), BRICK, GainOptions())


def estimate_of(problem: Problem) -> GainEstimate:
    return ESTIMATORS["ls-2011"].estimate(problem, ESTIMATORS["ls-2011"].options())


def common_of(problem: Problem) -> Delay:
    return common_delay([joint_delay(problem, joint_rows(problem, j)) for j in range(6)])


@pytest.mark.parametrize("seconds", [(0.0, 0.0), (0.007, 0.007), (0.004, -0.011), (0.0, 0.016), (-0.013, 0.003)])
def test_the_delay_of_each_motion_is_found_whatever_that_of_the_other(ur, logs, seconds):
    found = common_of(problem_of(ur, *(late(log, s) for log, s in zip(logs, seconds, strict=True))))
    # Five deviations are a false alarm in 10^6; they stand below 1.5 ms, so that a wrong sign or motion is seen.
    deviation = np.sqrt(np.diag(found.covariance))
    assert (deviation < 1.5e-3).all()
    np.testing.assert_array_less(np.abs(found.value - seconds), 5.0 * deviation + 5e-4)  # interpolation, second order
    assert found.sure is (seconds != (0.0, 0.0))


def test_a_slide_along_gravity_tells_its_delay_and_its_gain(rng):
    """Its offset is no column of its own: its weight is the same torque at every sample."""
    gain = np.array([8.7, -6.1, 37.0, 2.9])
    model = scara()
    logs = known_logs(model, BRICK, gain, rng, middle=np.array([0.3, -0.7, 0.9, 0.4]), noise=0.003)
    structure = structure_of(arm_of(model))
    assert "off3" not in structure.base.names
    in_time, behind = (
        joint_delay(problem, joint_rows(problem, 2))
        for problem in (
            problem_of(structure, *(late(log, seconds, slice(2, 3)) for log in logs)) for seconds in (0.0, 0.006)
        )
    )
    np.testing.assert_allclose(behind.value - in_time.value, 0.006, atol=0.0015)  # of first order; noise is the same
    slide = estimate_of(problem_of(structure, *logs)).joints[2]
    assert isinstance(slide, IdentifiedGain)
    np.testing.assert_allclose(slide.value, gain[2], rtol=0.005)  # noise of 0.3 %


def test_motions_that_are_in_time_give_no_word(ur, logs):
    problem = problem_of(ur, *logs)
    estimate = estimate_of(problem)
    assert lags(problem, estimate) == ()
    assert in_time(estimate, ()).joints == estimate.joints
    assert lag_notes(()) == ()


def test_a_delay_of_both_motions_alike_that_moves_no_gain_is_not_worth_a_word(ur, logs):
    problem = problem_of(ur, *(late(log, 0.012) for log in logs))
    assert common_of(problem).sure
    assert lags(problem, estimate_of(problem)) == ()


@pytest.mark.parametrize("seconds", [(0.0, 0.006), (0.006, 0.0), (0.0, -0.006)])
def test_what_a_delay_is_said_to_do_to_a_gain_is_what_its_undoing_does(ur, logs, seconds):
    problem = problem_of(ur, *(late(log, s) for log, s in zip(logs, seconds, strict=True)))
    wrong, right = estimate_of(problem), estimate_of(problem_of(ur, *logs))
    found = lags(problem, wrong)
    assert [each.joint for each in found] == [0]
    before, after = wrong.joints[0], right.joints[0]
    assert isinstance(before, IdentifiedGain)
    assert isinstance(after, IdentifiedGain)
    # First order in a change of 2 %, by delays that are known to a tenth.
    np.testing.assert_allclose(found[0].change, after.value / before.value - 1.0, rtol=0.2)


def test_a_gain_that_a_delay_moves_far_is_refused_and_the_others_are_kept(ur):
    logs = known_logs(ur_like(), BRICK, UR_GAIN, np.random.default_rng(5), middle=UR_MIDDLE)
    found = identify(logs[0], late(logs[1], 0.02), ur, BRICK, method="ls-2011", wiring=known_wiring)
    assert list(found.estimate.identifiable) == [False, True, True, True, True, True]
    refused = found.estimate.joints[0]
    assert isinstance(refused, RefusedGain)
    assert refused.reason.startswith("the currents come later than the positions, by ")
    assert refused.reason.endswith("; shift v against q in the logs, or log both with one clock")


def test_a_gain_that_a_delay_moves_a_little_is_kept_with_a_note(ur, logs):
    found = identify(logs[0], late(logs[1], 0.006), ur, BRICK, method="ls-2011", wiring=known_wiring)
    assert found.estimate.identifiable.all()
    (note,) = (note for note in found.notes if "later" in note)
    assert note.startswith("joint 1: the currents come later than the positions, by ")


def test_one_joint_alone_that_is_late_is_not_believed(ur, logs):
    problem = problem_of(ur, logs[0], late(logs[1], 0.03, slice(2, 3)))
    assert lags(problem, estimate_of(problem)) == ()


def test_the_common_delay_is_the_weighted_mean_of_those_of_the_joints():
    # By hand: weights 4 and 1 in the first motion, 1 and 9 in the second, of values that agree within a deviation.
    one = Delay(np.array([0.3, -0.2]), np.diag([0.25, 1.0]))
    two = Delay(np.array([0.7, 0.1]), np.diag([1.0, 1.0 / 9.0]))
    found = common_delay([one, two])
    np.testing.assert_allclose(found.value, [(4 * 0.3 + 0.7) / 5, (-0.2 + 9 * 0.1) / 10], rtol=1e-12)  # rounding
    np.testing.assert_allclose(found.covariance, np.diag([1 / 5, 1 / 10]), rtol=1e-12, atol=1e-15)


def test_joints_that_contradict_each_other_make_a_delay_uncertain():
    one = Delay(np.array([3.0, 1.0]), np.diag([0.25, 0.25]))
    two = Delay(np.array([-3.0, 1.0]), np.diag([0.25, 0.25]))
    # By hand: the mean is (0, 1) with variance 1/8; squared deviations 36 + 36 over 2 degrees of freedom are 36.
    found = common_delay([one, two])
    np.testing.assert_allclose(found.covariance, np.diag([36 / 8, 36 / 8]), rtol=1e-12, atol=1e-15)  # rounding
    assert common_delay([one]).covariance == pytest.approx(one.covariance)


@pytest.mark.parametrize(("factor", "sure"), [(0.99, False), (1.01, True)])
def test_a_delay_is_sure_by_the_squares_of_its_deviations(factor, sure):
    covariance = np.array([[2.0, 0.6], [0.6, 0.5]])
    value = np.linalg.cholesky(covariance) @ np.array([0.6, 0.8]) * np.sqrt(factor * SURE)  # a unit vector's length
    assert Delay(value, covariance).sure is sure


def test_rows_without_a_rate_show_no_delay(ur, logs):
    bare, loaded = (observe(log, ur, OPTIONS) for log in logs)
    still = tuple(replace(joint, V_rate=np.zeros(len(joint.V))) for joint in loaded.joints)
    problem = pair(bare, replace(loaded, joints=still), BRICK, GainOptions())
    assert joint_delay(problem, joint_rows(problem, 2)) is None
    assert lags(problem, estimate_of(problem)) == ()


def test_too_few_rows_show_no_delay(ur, logs):
    short = [Recording(log.t[:800], log.q[:800], log.v[:800], log.name) for log in logs]
    problem = problem_of(ur, *short)
    unknowns = len(joint_rows(problem, 0).names) + 10 + 3
    few = len(joint_rows(problem, 0).V) - unknowns
    assert (joint_delay(problem, joint_rows(problem, 0)) is None) == (few < 20)


def test_where_no_gain_survives_that_is_said(ur, logs):
    estimate = estimate_of(problem_of(ur, *logs))
    every = [Lag(joint=j, change=1.5 * MOST, words="3 ms in the loaded motion") for j in range(6)]
    with pytest.raises(NotIdentifiable, match=r"joint 1: the currents come later than the positions, by 3 ms in the l"):
        in_time(estimate, every)
    kept = in_time(estimate, every[:5])
    assert list(kept.identifiable) == [False] * 5 + [True]
    assert len(lag_notes([replace(each, change=-0.5 * (SEEN + MOST)) for each in every])) == 6


def test_a_contradiction_that_a_delay_can_make_names_the_delay_too(ur, logs):
    # With little noise the delay itself is another shape of the payload's torque.
    with pytest.raises(Contradiction, match=r"another shape.*; or else, on joint 1, the currents come later"):
        identify(logs[0], late(logs[1], 0.02), ur, BRICK, method="ls-2011", wiring=known_wiring)
    small = Lag(joint=0, change=0.9 * MOST, words="3 ms in the loaded motion")
    assert with_suspects("what it is", [small]) == "what it is"
