"""Whether positions are where the joints can be."""

from dataclasses import replace

import numpy as np
import pytest
from known_logs import arm_of, scara

from ident.diagnosis.hypothesis import SLACK, STILL, as_logged, beyond_limits, within_limits
from ident.recordings.recording import Recording

T = 0.01 * np.arange(200)


@pytest.fixture(scope="module")
def slider():
    """Two hinges of -1 to 2 rad, a slide of 0 to 0.3 m, a hinge without limits."""
    arm = arm_of(scara())
    return replace(arm, lower=np.array([-1.0, -1.0, 0.0, -np.inf]), upper=np.array([2.0, 2.0, 0.3, np.inf]))


def log(*ranges: tuple[float, float]) -> Recording:
    phase = 0.5 - 0.5 * np.cos(np.pi * T / T[-1])
    q = np.column_stack([low + (high - low) * phase for low, high in ranges])
    return Recording(T, q, np.sin(q), "log")


INSIDE = ((-0.7, 1.8), (0.3, 1.1), (0.05, 0.28), (-3.0, 11.0))


def test_a_log_within_the_limits_reaches_every_position(slider):
    assert beyond_limits(slider, log(*INSIDE)) == ()


def test_a_joint_beyond_its_limits_is_named_and_one_beyond_by_the_slack_is_not(slider):
    for extra, found in ((0.9 * SLACK, ()), (1.1 * SLACK, (0,))):
        assert beyond_limits(slider, log((-0.7, 2.0 + extra), *INSIDE[1:])) == found
        assert beyond_limits(slider, log((-1.0 - extra, 1.3), *INSIDE[1:])) == found
    for extra, found in ((0.9 * SLACK, ()), (1.1 * SLACK, (2,))):
        assert beyond_limits(slider, log(*INSIDE[:2], (0.1, 0.3 + extra), INSIDE[3])) == found


def test_a_hinge_may_be_counted_from_another_turn_and_a_slide_may_not(slider):
    turn = 2.0 * np.pi
    assert beyond_limits(slider, log((-0.7 + turn, 1.8 + turn), (0.3 - turn, 1.1 - turn), *INSIDE[2:])) == ()
    assert beyond_limits(slider, log(*INSIDE[:2], (0.05 + turn, 0.28 + turn), INSIDE[3])) == (2,)


def test_a_hinge_without_limits_turns_no_more_than_twice_either_way(slider):
    assert beyond_limits(slider, log(*INSIDE[:3], (-12.0, 12.0))) == ()
    assert beyond_limits(slider, log(*INSIDE[:3], (-14.0, 14.0))) == (3,)


@pytest.mark.parametrize(
    ("span", "factor", "within"),
    [((20.0, 80.0), np.pi / 180.0, True), ((-30.0, 170.0), np.pi / 180.0, False), ((0.3, 1.1), np.pi / 180.0, False)],
)
def test_another_unit_has_to_leave_a_joint_in_reach_and_moving(slider, span, factor, within):
    how = replace(as_logged(slider, 1).logs[0], q_factor=np.array([1.0, factor, 1.0, 1.0]))
    assert within_limits(slider, log(INSIDE[0], span, *INSIDE[2:]), how) == within
    # of joints whose unit stays nothing is asked
    assert within_limits(slider, log((-7.0, 8.0), span, *INSIDE[2:]), how) == within


def test_a_range_at_which_a_joint_moves_is_that_of_the_arm(slider):
    for span, within in ((1.1 * STILL, True), (0.9 * STILL, False)):
        how = replace(as_logged(slider, 1).logs[0], q_factor=np.array([0.01, 1.0, 1.0, 1.0]))
        assert within_limits(slider, log((0.0, 100.0 * span), *INSIDE[1:]), how) == within
