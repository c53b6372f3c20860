"""Every single reading of a log: units and orders, what is the same by the kinematics, what a joint can reach."""

from dataclasses import replace

import numpy as np
import pytest
from ident.checks.comparison import Logs, _alternative, compared, prepared, same_as_it_is, single_readings
from ident.checks.further_readings import further_readings
from ident.checks.gear_ratio import motor_side
from ident.checks.reach import unreachable
from ident.checks.sameness import fingerprint, same
from ident.explanation import Explanation, unknowns_of, unknowns_under_any
from ident.readings import as_it_is
from known_logs import BRICK, UR_GAIN, UR_MIDDLE, arm_of, known_logs, ur_like

from ident.observation import ObserveOptions
from ident.recording import Recording
from ident.structure import structure_of

OPTIONS = ObserveOptions()
LOG = np.array([0.3, -1.2, 1.1, -0.4, 0.7, 0.2])


@pytest.fixture(scope="module")
def logs() -> tuple[Recording, Recording]:
    return known_logs(ur_like(), BRICK, UR_GAIN, np.random.default_rng(31), middle=UR_MIDDLE)


def named(arm, words):
    return next(each for each in single_readings(arm) if each.words == words)


def changed(logs, change):
    return [Recording(log.t, change(log.q.copy()), log.v, log.name) for log in logs]


@pytest.mark.parametrize(
    ("words", "log", "expected"),
    [
        ("all positions in degrees", np.rad2deg(LOG), LOG),
        ("q3 in degrees", LOG * [1, 1, 180 / np.pi, 1, 1, 1], LOG),
        ("all positions in revolutions", LOG / (2 * np.pi), LOG),
        ("all positions in milliradians", LOG * 1e3, LOG),
        ("columns q in reverse order", LOG[::-1], LOG),
        ("joints shifted, the first one last", np.roll(LOG, -1), LOG),
        ("joints shifted, the last one first", np.roll(LOG, 1), LOG),
    ],
)
def test_a_reading_undoes_what_its_words_say_was_done(ur, words, log, expected):
    reading = named(ur.arm, words)
    read = reading.factor * log[reading.q_order] + reading.zero
    np.testing.assert_allclose(read, expected, rtol=1e-14)  # a product and a quotient


def test_columns_in_alphabetical_order_are_brought_into_that_of_the_joints(ur):
    names = ("pan", "lift", "elbow", "w1", "w2", "w3")  # sorted: elbow, lift, pan, w1, w2, w3
    arm = replace(ur.arm, joint_names=("pan", "elbow", "lift", "w1", "w2", "w3"))
    assert sorted(names) == ["elbow", "lift", "pan", "w1", "w2", "w3"]
    logged = LOG[[1, 2, 0, 3, 4, 5]]  # elbow, lift, pan, and the wrist
    reading = next(f[1] for f in further_readings(arm) if "alphabetical" in f[0].words and len(f) == 2)
    assert reading.words == "joints in alphabetical order of the joints' names"
    np.testing.assert_array_equal(logged[reading.q_order], LOG)
    np.testing.assert_array_equal(reading.v_order, reading.q_order)


def test_orders_that_exchange_two_joints_or_none_are_not_told_twice(ur):
    words = [reading.words for family in further_readings(ur.arm) for reading in family]
    assert not any("alphabetical" in each for each in words)  # joint1 .. joint6 are in order
    swapped = replace(ur.arm, joint_names=("c", "b", "a", "d", "e", "f"))
    assert not any("alphabetical" in f[0].words for f in further_readings(swapped))


def test_joints_that_slide_have_lengths_for_units_and_joints_that_turn_angles(ur):
    arm = replace(ur.arm, revolute=np.array([1.0, 1.0, 0.0, 1.0, 1.0, 1.0]))
    words = {reading.words: reading for family in further_readings(arm) for reading in family}
    assert "q3 in millimetres" in words
    assert "q3 in degrees" not in words
    np.testing.assert_array_equal(words["q3 in millimetres"].factor, [1, 1, 1e-3, 1, 1, 1])
    np.testing.assert_allclose(words["all positions in degrees"].factor[[1, 2]], [np.pi / 180, 1.0], rtol=1e-15)


SAME = {  # of a vertical first axis, of a last one without what turns with it, and of a wrist
    "q1 plus 90 degrees", "q1 plus 180 degrees", "q1 plus 270 degrees",
    "q6 plus 90 degrees", "q6 plus 180 degrees", "q6 plus 270 degrees",
}  # fmt: skip


def alike(structure, motions):
    return {each.words for each in same_as_it_is(structure, motions=motions)}


@pytest.mark.parametrize("motions", [1, 2])
def test_zeros_of_a_vertical_first_axis_and_of_the_last_one_are_the_same_as_any(ur, motions):
    assert alike(ur, motions) == SAME | {"the log as it is"}


def test_a_tilted_base_lets_the_zero_of_the_first_axis_show():
    tilted = structure_of(arm_of(ur_like((3.6, -4.8, 7.7))))
    assert alike(tilted, 1) == {each for each in SAME if each.startswith("q6")} | {"the log as it is"}


def test_the_wrist_turned_by_a_half_turn_is_the_next_axis_reversed(ur):
    own = unknowns_of(ur)
    prints = [
        fingerprint(ur, own, named(ur.arm, words), motions=1)
        for words in ("q5 plus 180 degrees", "q6 negated", "q5 negated")
    ]
    assert same(prints[0], prints[1])
    assert not same(prints[0], prints[2])


def test_other_spans_of_one_joint_alone_tell_readings_apart(ur):
    own = unknowns_of(ur)
    swapped = fingerprint(ur, own, named(ur.arm, "columns v2 and v5 exchanged"), motions=1)
    given = fingerprint(ur, own, as_it_is(ur.arm), motions=1)
    equal = [
        bool(np.allclose(a, b, atol=1e-9)) for a, b in zip(given.projected, swapped.projected, strict=True)
    ]  # rounding
    assert equal == [True, False, True, True, False, True]
    assert not same(given, swapped)


def limited(arm, lower, upper):
    return replace(arm, lower=np.full(6, lower), upper=np.full(6, upper))


def test_a_reading_beyond_the_limits_is_out_of_reach_and_one_a_turn_away_is_not(ur, logs):
    arm, bare = limited(ur.arm, -3.0, 2.9), logs[:1]
    given = as_it_is(arm)
    assert unreachable(arm, bare, given) == ()
    beyond = replace(given, zero=np.array([0, 0, 2.6, 0, 0, 0]))  # q3 is about 1.1
    assert unreachable(arm, bare, beyond) == (2,)
    turned = replace(given, zero=np.array([0, 0, 0, -2.0 * np.pi, 4.0 * np.pi, 0]))
    assert unreachable(arm, bare, turned) == ()


def test_a_limit_may_be_passed_by_the_slack_and_no_more(ur, logs):
    top = float(logs[0].q[:, 2].max())
    arms = [replace(ur.arm, upper=np.where(np.arange(6) == 2, top - over, np.inf)) for over in (0.09, 0.11)]
    # no turn less helps: the lower limit is just below what the joint did
    arms = [replace(arm, lower=np.where(np.arange(6) == 2, -2.0, -np.inf)) for arm in arms]
    assert [unreachable(arm, logs[:1], as_it_is(arm)) for arm in arms] == [(), (2,)]


def test_the_lower_limit_has_the_same_slack(ur, logs):
    low, own = float(logs[0].q[:, 2].min()), np.arange(6) == 2
    high = float(logs[0].q[:, 2].max())
    for over, beyond in ((0.09, ()), (0.11, (2,))):
        arm = replace(ur.arm, lower=np.where(own, low + over, -np.inf), upper=np.where(own, high, np.inf))
        assert unreachable(arm, logs[:1], as_it_is(arm)) == beyond
        sliding = replace(arm, revolute=np.where(own, 0.0, 1.0))
        assert unreachable(sliding, logs[:1], as_it_is(arm)) == beyond
        upper = replace(sliding, lower=np.full(6, -np.inf), upper=np.where(own, high - over, np.inf))
        assert unreachable(upper, logs[:1], as_it_is(arm)) == beyond


def test_without_limits_two_turns_either_way_are_in_reach(ur, logs):
    degrees = [Recording(log.t, np.rad2deg(log.q), log.v) for log in logs]
    assert len(unreachable(ur.arm, degrees, as_it_is(ur.arm))) == 6
    assert unreachable(ur.arm, degrees, named(ur.arm, "all positions in degrees")) == ()


def test_another_unit_that_leaves_a_joint_standing_still_is_out_of_reach(ur, logs):
    assert unreachable(ur.arm, logs, named(ur.arm, "q4 in degrees")) == (3,)
    still = Recording(logs[0].t, logs[0].q * [1, 1, 1, 1e-3, 1, 1], logs[0].v)
    for words in ("the log as it is", "q4 negated"):  # the log says so
        assert unreachable(ur.arm, [still], named(ur.arm, words)) == ()


def test_joints_that_slide_have_no_turns(ur, logs):
    arm = replace(limited(ur.arm, -2.0, 2.5), revolute=np.array([1.0, 1.0, 0.0, 1.0, 1.0, 1.0]))
    away = replace(as_it_is(arm), zero=np.array([0, 0, -2.0 * np.pi, 2.0 * np.pi, 0, 0]))
    assert unreachable(arm, logs, away) == (2,)


@pytest.mark.parametrize("count", [1, 2])
def test_a_clean_log_is_best_as_it_is(ur, logs, count):
    found = compared(prepared(ur, logs[:count], OPTIONS))
    assert {each.words for each in found.same} == SAME
    assert found.unreachable == ()
    assert found.alternatives[0].evidence < 5.0  # e^5 to 1, of a hundred readings
    evidence = [each.evidence for each in found.alternatives]
    assert evidence == sorted(evidence, reverse=True)


def test_exchanged_columns_are_compared_current_by_current(ur, logs):
    order = [0, 4, 2, 3, 1, 5]
    bad = [Recording(log.t, log.q, log.v[:, order], log.name) for log in logs[:1]]
    found = compared(prepared(ur, bad, OPTIONS)).alternatives[0]
    assert [each.words for each in found.readings] == ["columns v2 and v5 exchanged"]
    np.testing.assert_allclose(found.gain[[0, 2, 3, 5]], 0.0, atol=1e-12)  # rounding; the others' currents are theirs
    assert (found.gain[[1, 4]] > 1.0).all()


def test_evidence_counts_the_instants_of_each_column_whatever_joint_it_is_of(ur):
    left, freedom = np.array([0.3, 0.2, 0.5, 0.7, 0.4, 0.6]), np.array([100, 200, 300, 400, 500, 600])
    given = Explanation(as_it_is(ur.arm), left, freedom)
    exchanged = Explanation(named(ur.arm, "columns v2 and v5 exchanged"), 0.5 * left, freedom)
    made = Logs(ur, unknowns_of(ur), unknowns_under_any(ur), (), (), ())
    found = _alternative(made, given, [exchanged])
    # Column 2 is of joint 5 and column 5 of joint 2 where they are exchanged; the fewer instants of both are 200.
    gain = np.log([2.0, 0.2 / 0.2, 2.0, 2.0, 0.4 / 0.1, 2.0])
    np.testing.assert_allclose(found.gain, gain, rtol=1e-12, atol=1e-15)  # rounding
    np.testing.assert_allclose(found.evidence, gain @ [100, 200, 300, 400, 200, 600], rtol=1e-12)


def test_a_reading_of_another_gravity_is_solved_for_all_that_shows_under_any(ur):
    made = Logs(ur, unknowns_of(ur), unknowns_under_any(ur), (), (), ())
    assert made.unknowns_under(named(ur.arm, "q3 negated")) is made.unknowns
    assert made.unknowns_under(named(ur.arm, "gravity along (0, 0, 1) of the base")) is made.aslant
    assert len(made.aslant.arm[0]) > len(made.unknowns.arm[0])  # the first axis is upright


def test_joints_that_were_exchanged_are_told_from_positions_that_were(ur, logs):
    order = [0, 1, 3, 2, 4, 5]
    for words, v_order in (("joints 3 and 4 exchanged", order), ("columns q3 and q4 exchanged", list(range(6)))):
        bad = [Recording(log.t, log.q[:, order], log.v[:, v_order], log.name) for log in logs[:1]]
        best = compared(prepared(ur, bad, OPTIONS)).alternatives
        most = max(best, key=lambda each: float(each.gain.sum()))
        assert [each.words for each in most.readings] == [words]


@pytest.mark.parametrize(("joint", "ratio"), [(4, -63.7)])
def test_the_ratio_of_a_gear_is_found_within_a_per_cent(ur, logs, joint, ratio):
    arm = limited(ur.arm, -6.5, 6.5)
    factor = np.where(np.arange(6) == joint, ratio, 1.0)
    bad = changed(logs, lambda q: factor * q)
    (found,) = motor_side(prepared(replace(ur, arm=arm), bad, OPTIONS))
    np.testing.assert_allclose(1.0 / found.factor[joint], ratio, rtol=0.01)  # noise of 2 % and 800 instants
    np.testing.assert_array_equal(np.delete(found.factor, joint), 1.0)
    assert found.words.startswith(f"q{joint + 1} divided by {1.0 / found.factor[joint]:.4g}")


def test_ratios_are_searched_only_where_one_joint_is_out_of_reach(ur, logs):
    assert motor_side(prepared(ur, logs, OPTIONS)) == ()
    both = changed(logs, lambda q: q * [1, 100, 80, 1, 1, 1])
    assert motor_side(prepared(ur, both, OPTIONS)) == ()
    sliding = replace(limited(ur.arm, -2.0, 2.5), revolute=np.array([1.0, 1.0, 0.0, 1.0, 1.0, 1.0]))
    far = changed(logs, lambda q: q * [1, 1, 7, 1, 1, 1])
    assert unreachable(sliding, far, as_it_is(sliding)) == (2,)
    assert motor_side(prepared(replace(ur, arm=sliding), far, OPTIONS)) == ()
