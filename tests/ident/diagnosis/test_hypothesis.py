"""Hypotheses on logs: every field by itself and all at once, against plain sums; limits of joints."""

from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import LOOSE, PAYLOADS, logs_of
from known_logs import arm_of, ur_like
from real_friction import Truth

from ident.diagnosis.hypothesis import (
    SLACK,
    STILL,
    LogHypothesis,
    Logs,
    as_logged,
    beyond_limits,
    read_as,
    within_limits,
)
from ident.estimation.problem import ObservedMotion, Problem
from ident.observation.observation import ObserveOptions, observe
from ident.recordings.recording import Recording

RATE = 100.0


@pytest.fixture(scope="module")
def arm():
    return arm_of(ur_like(count=3))


@pytest.fixture
def log() -> Recording:
    t = 3.0 + np.arange(400) / RATE
    q = np.column_stack([np.sin(2.0 * t), 0.4 * np.cos(3.0 * t), 0.1 * t])
    v = np.column_stack([np.cos(5.0 * t), np.sin(4.0 * t) + 0.3, 7.0 * np.sin(t)])
    return Recording(t, q, v, "log.csv")


def how(arm, **fields) -> LogHypothesis:
    return replace(as_logged(arm, 1).logs[0], **fields)


def test_spoilt_samples_follow_the_columns_they_are_of(arm):
    spoilt = np.zeros((400, 3), dtype=np.bool_)
    spoilt[31:47, 0] = spoilt[203, 1] = True
    read = how(arm, q_order=np.array([2, 0, 1]), v_order=np.array([0, 2, 1])).read_mask(spoilt)
    np.testing.assert_array_equal(np.flatnonzero(read[:, 0]), np.arange(31, 47))  # by its current
    np.testing.assert_array_equal(np.flatnonzero(read[:, 1]), np.arange(31, 47))  # by its position
    np.testing.assert_array_equal(np.flatnonzero(read[:, 2]), [203])  # by both
    mixing = np.zeros((3, 3))
    mixing[2, 1] = -0.7  # of joint 2's position in that of joint 3
    read = how(arm, q_mixing=mixing).read_mask(spoilt)
    assert [np.count_nonzero(each) for each in read.T] == [16, 1, 1]
    assert how(arm).read_mask(None) is None


def test_signs_zeros_and_orders_of_one_reading_belong_to_the_joint_that_is_read(arm, log):
    factors = {"q_factor": np.array([-1.0, 2.0, 1.0]), "v_factor": np.array([1.0, -4.0, 1.0])}
    orders = {"q_order": np.array([1, 0, 2]), "v_order": np.array([0, 2, 1])}
    read = how(arm, zero=np.array([0.7, 0.0, -0.2]), **factors, **orders).read(log)
    expected = np.column_stack((-log.q[:, 1] + 0.7, 2.0 * log.q[:, 0], log.q[:, 2] - 0.2))
    np.testing.assert_allclose(read.q, expected, rtol=1e-14)
    np.testing.assert_allclose(read.v, np.column_stack((log.v[:, 0], -4.0 * log.v[:, 2], log.v[:, 1])), rtol=1e-14)


@pytest.mark.parametrize("periods", [3.0, -4.0, 0.37, -2.6])
def test_currents_that_were_logged_late_are_read_earlier_and_early_ones_later(arm, log, periods):
    order = np.array([1, 0, 2])  # the delay is that of the column that the joint has
    read = how(arm, v_order=order, delay=np.array([periods, 0.0, 0.3 * periods]) / RATE).read(log)
    for j, share in ((0, 1.0), (2, 0.3)):
        late = np.interp(log.t + share * periods / RATE, log.t, log.v[:, order[j]])  # whose ends are repeated
        # Cubic or linear between samples: at 5 rad/s and 100 Hz an eighth of the second difference.
        exact = share == 1.0 and periods == round(periods)
        np.testing.assert_allclose(read.v[:, j], late, atol=1e-12 if exact else 0.002 * np.abs(log.v).max())
    np.testing.assert_array_equal(read.v[:, 1], log.v[:, 0])
    for name in "tq":
        np.testing.assert_array_equal(getattr(read, name), getattr(log, name))


def test_other_fields_of_some_logs_leave_the_others_as_they_are(arm):
    hypothesis = as_logged(arm, 3).changed((0, 2), clock=0.5, zero=np.ones(3))
    assert [(each.clock, float(each.zero[1])) for each in hypothesis.logs] == [(0.5, 1.0), (1.0, 0.0), (0.5, 1.0)]


def test_an_arm_as_drawn_is_itself_and_another_base_or_length_is_of_it(arm):
    hypothesis = as_logged(arm, 2)
    assert hypothesis.of_arm(arm) is arm
    longer = replace(hypothesis, length_factors=np.array([1.0, 1.1, 0.9])).of_arm(arm)
    turned = replace(hypothesis, gravity=np.array([9.81, 0.0, 0.0])).of_arm(arm)
    np.testing.assert_allclose(longer.translation, arm.translation * [[1.0], [1.1], [0.9]], rtol=1e-14)
    for found, expected in (
        (longer.gravity, arm.gravity), (turned.gravity, [9.81, 0.0, 0.0]), (turned.translation, arm.translation),
    ):  # fmt: skip
        np.testing.assert_array_equal(found, expected)


T = 0.01 * np.arange(200)


@pytest.fixture(scope="module")
def slider():
    """Two hinges of -1 to 2 rad, a slide of 0 to 0.3 m, a hinge without limits."""
    limits = {"lower": np.array([-1.0, -1.0, 0.0, -np.inf]), "upper": np.array([2.0, 2.0, 0.3, np.inf])}
    return replace(arm_of(ur_like(count=4)), revolute=np.array([1.0, 1.0, 0.0, 1.0]), **limits)


def moved(*ranges: tuple[float, float]) -> Recording:
    phase = 0.5 - 0.5 * np.cos(np.pi * T / T[-1])
    q = np.column_stack([low + (high - low) * phase for low, high in ranges])
    return Recording(T, q, np.sin(q), "log")


INSIDE = ((-0.7, 1.8), (0.3, 1.1), (0.05, 0.28), (-3.0, 11.0))
TURN = 2.0 * np.pi
BEYOND = {
    "within": ({}, ()),
    "by less than the slack": ({0: (-0.7, 2.0 + 0.9 * SLACK), 2: (0.1, 0.3 + 0.9 * SLACK)}, ()),
    "above by more": ({0: (-0.7, 2.0 + 1.1 * SLACK)}, (0,)),
    "below by less": ({0: (-1.0 - 0.9 * SLACK, 1.3)}, ()),
    "below by more": ({0: (-1.0 - 1.1 * SLACK, 1.3)}, (0,)),
    "a slide by more": ({2: (0.1, 0.3 + 1.1 * SLACK)}, (2,)),
    "hinges on other turns": ({0: (-0.7 + TURN, 1.8 + TURN), 1: (0.3 - TURN, 1.1 - TURN)}, ()),
    "a slide has no turns": ({2: (0.05 + TURN, 0.28 + TURN)}, (2,)),
    "nearly two turns without limits": ({3: (-12.0, 12.0)}, ()),
    "more than two turns": ({3: (-14.0, 14.0)}, (3,)),
}


def test_joints_beyond_their_limits_are_named(slider):
    for case, (ranges, expected) in BEYOND.items():
        log = moved(*(ranges.get(j, inside) for j, inside in enumerate(INSIDE)))
        assert beyond_limits(slider, log) == expected, case


@pytest.mark.parametrize(("span", "within"), [((20.0, 80.0), True), ((-30.0, 170.0), False), ((0.3, 1.1), False)])
def test_another_unit_has_to_leave_a_joint_in_reach_and_moving(slider, span, within):
    how = replace(as_logged(slider, 1).logs[0], q_factor=np.array([1.0, np.pi / 180.0, 1.0, 1.0]))
    assert within_limits(slider, moved(INSIDE[0], span, *INSIDE[2:]), how) == within
    # of joints whose unit stays nothing is asked
    assert within_limits(slider, moved((-7.0, 8.0), span, *INSIDE[2:]), how) == within
    elsewhere = replace(how, q_order=np.array([1, 0, 2, 3]))
    assert within_limits(slider, moved(span, INSIDE[0], *INSIDE[2:]), elsewhere) == within
    for span, within in ((1.1 * STILL, True), (0.9 * STILL, False)):  # the range at which a joint moves is the arm's
        how = replace(as_logged(slider, 1).logs[0], q_factor=np.array([0.01, 1.0, 1.0, 1.0]))
        assert within_limits(slider, moved((0.0, 100.0 * span), *INSIDE[1:]), how) == within


def test_a_clock_changes_no_sample_that_filters_combine(axes):
    options, recorded = ObserveOptions(current_delay=0.011), logs_of(Truth())
    motions = (ObservedMotion(observe(log, axes, options), each) for log, each in zip(recorded, PAYLOADS, strict=True))
    logs = Logs(tuple(recorded), Problem(axes, tuple(motions), LOOSE), options, (None, None))
    other = read_as(logs, logs.given.changed(logs.every, clock=1.25))
    for before, after in zip(logs.rows, other.rows, strict=True):
        np.testing.assert_allclose(after.V, before.V, atol=1e-9 * np.std(before.V))  # rounding of the filters
