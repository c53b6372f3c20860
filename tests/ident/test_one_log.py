"""Currents and positions that one of two logs counts otherwise are refused by name; sound logs are not."""

import re
from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import logs_of, problem_of
from ident.checks import between_logs
from ident.checks.check import Checked, check
from ident.checks.comparison import Alternative, single_readings
from ident.checks.remark import Grade
from ident.consistency.finding import Finding
from ident.consistency.joints import TORN, TORN_Z, torn
from ident.evidence import BETTER, EVIDENCE, gain_over
from ident.odd_gains import FAR, sign_notes, size_notes
from ident.one_log import Counting, check_scales, check_units, countings, scale_notes
from ident.one_log_readings import one_log_explanations
from ident.own_torque import Scale
from ident.wiring import check_wiring
from known_logs import BRICK
from real_friction import Truth, real_logs

from ident.errors import Contradiction, OtherLengths
from ident.identification import identify
from ident.observation import ObserveOptions
from ident.options import GainOptions
from ident.recording import Recording
from ident.structure import Structure

NAMES = ("one.csv", "two.csv")
SOUND = [
    Scale(joint=0, value=1.02, std=0.03, evidence=0.3, friction=0.97),
    Scale(joint=1, value=0.96, std=0.05, evidence=0.4, friction=1.02),
    Scale(joint=2, value=1.21, std=0.27, evidence=9.0, friction=1.01),
]


@pytest.fixture(scope="module")
def logs() -> list[Recording]:
    return logs_of(Truth())


def times(log: Recording, factor: float | np.ndarray, joint: int | None = None) -> Recording:
    v = log.v.copy()
    v[:, slice(None) if joint is None else joint] *= factor
    return Recording(log.t, log.q, v, log.name)


def counted(axes: Structure, logs: list[Recording]) -> list[Counting]:
    return countings(problem_of(axes, logs), NAMES)


def said(*scales: Scale) -> list[Counting]:
    return [Counting(first="one.csv", second="two.csv", scales=tuple(scales))]


# The statistic


@pytest.mark.parametrize("factor", [1.0, 1.35, -0.7, 740.0])
def test_the_scale_of_a_current_is_found_by_the_arms_own_torque_and_by_friction(axes, logs, factor):
    (found,) = counted(axes, [logs[0], times(logs[1], factor, 1)])
    assert (found.first, found.second) == NAMES
    assert [each.joint for each in found.scales] == [0, 1, 2]
    own = found.scales[1]
    # 4.5 deviations: once in 150 000 for a normal one. Friction of one arm differs by noise, a few per cent.
    assert abs(own.value - factor) < 4.5 * own.std
    assert own.std < 0.2 * abs(factor)
    assert own.friction is not None
    np.testing.assert_allclose(own.friction, factor, rtol=0.1)


def test_the_first_log_in_thousandths_is_the_second_a_thousand_times(axes, logs):
    (found,) = counted(axes, [times(logs[0], 1e-3, 2), logs[1]])
    np.testing.assert_allclose(found.scales[2].value, 1e3, rtol=0.3)  # its deviation is under a tenth


# Refusals


def test_sound_logs_are_not_refused(axes, logs):
    found = counted(axes, logs)
    check_units(found)
    check_scales(found)
    assert scale_notes(found) == ()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda log: times(log, 1e-3, 1), r"two.csv: v2 counts 0\.0\d+ times those of one.csv"),
        (lambda log: times(log, 1e3), "v1 counts .* times, v2 counts .* times, v3 counts"),
        (lambda log: times(log, -1.0), "v1, v2, v3 have the other sign than in one.csv"),
    ],
)
def test_another_unit_and_other_signs_are_refused_before_any_other_reading(axes, logs, change, words):
    with pytest.raises(Contradiction, match=words):
        check_units(counted(axes, [logs[0], change(logs[1])]))


def test_one_current_of_another_sign_is_left_to_the_readings_and_refused_after_them(axes, logs):
    found = counted(axes, [logs[0], times(logs[1], -1.0, 2)])
    check_units(found)
    with pytest.raises(Contradiction, match=r"two\.csv: v3 has the other sign than in one.csv"):
        check_scales(found)


def test_all_currents_a_fifth_larger_in_one_log_are_refused(axes, logs):
    with pytest.raises(Contradiction, match=r"two.csv: all currents count 1\.[12]\d? times those of one.csv"):
        check_scales(counted(axes, [logs[0], times(logs[1], 1.2)]))


def test_positions_and_currents_of_one_log_are_named_with_it(axes, logs):
    one, two = (Recording(log.t, log.q, log.v, name) for log, name in zip(logs, NAMES, strict=True))
    turned = one.q.copy()
    turned[:, 2] = -turned[:, 2]
    with pytest.raises(Contradiction, match=r"q3 negated[a-z0-9. ]* in one.csv alone"):
        check_wiring(axes, Recording(one.t, turned, one.v, one.name), two, ObserveOptions())
    with pytest.raises(Contradiction, match=r"v2 negated in (one\.csv|two\.csv|one of the logs) alone"):
        check_wiring(axes, one, times(two, -1.0, 1), ObserveOptions())


def exchanged(x: np.ndarray) -> np.ndarray:
    return x[:, [0, 2, 1]]


@pytest.mark.parametrize(
    ("place", "change", "words"),
    [
        (0, lambda log: Recording(1.25 * log.t, log.q, log.v, log.name), r"t times 0\.8"),
        (1, lambda log: Recording(log.t, log.q, exchanged(log.v), log.name), "columns v2 and v3 exchanged"),
        (0, lambda log: Recording(log.t, exchanged(log.q), log.v, log.name), "columns q2 and q3 exchanged"),
        (1, lambda log: Recording(log.t, exchanged(log.q), exchanged(log.v), log.name), "joints 2 and 3 exchanged"),
    ],
)
def test_a_clock_or_an_order_of_one_log_is_named_with_it(axes, logs, place, change, words):
    named = [Recording(log.t, log.q, log.v, name) for log, name in zip(logs, NAMES, strict=True)]
    named[place] = change(named[place])
    with pytest.raises(Contradiction, match=rf"this one: {words} in {re.escape(NAMES[place])} alone \("):
        check_wiring(axes, *named, ObserveOptions())


def test_an_identification_looks_at_units_before_other_readings(axes, logs):
    with pytest.raises(Contradiction, match=r"v1 counts .* times, v2 counts"):
        identify(logs[0], times(logs[1], 1e-3), axes, BRICK, method="ls-2011")


def test_another_length_is_named_only_where_no_log_counts_a_current_otherwise(axes, logs):
    def longer(*_: object) -> None:
        raise OtherLengths("a length")

    with pytest.raises(Contradiction, match="all currents count"):
        identify(logs[0], times(logs[1], 1.2), axes, BRICK, method="ls-2011", wiring=longer)
    with pytest.raises(OtherLengths):
        identify(*logs, axes, BRICK, method="ls-2011", wiring=longer)


@pytest.mark.parametrize(
    ("pick", "words"),
    [
        (lambda one, two: (one, one), "hold the same motion"),
        (lambda one, two: (one, times(two, 1e-3, 1)), "v2 counts 0.00"),
        (lambda one, two: (two, one), "negative mass|swapped"),
    ],
)
def test_a_check_refuses_what_an_identification_refuses(axes, logs, pick, words):
    found = check(
        pick(*logs), axes, observing=ObserveOptions(), gains=GainOptions(), loaded=(False, True), payload=BRICK
    )
    wrong = [each.seen for each in found.remarks if each.grade is Grade.WRONG]
    assert any(re.search(words, each) for each in wrong), wrong


def test_a_check_asks_one_log_alone_where_no_reading_of_both_lets_them_agree(axes, logs, monkeypatch):
    def asked(*read: Recording) -> Checked:
        return check(read, axes, observing=ObserveOptions(), gains=GainOptions())

    monkeypatch.setattr("ident.checks.between_logs.one_log_explanations", lambda *_: 1 / 0)
    turned = [Recording(log.t, log.q * [1, 1, -1], log.v, log.name) for log in logs]
    assert any("q3 negated" in named for named in asked(*turned).named)
    both = Recording(turned[0].t, turned[0].q * [1, -1, 1], turned[0].v, "both")
    for pair in ((turned[0], logs[1]), (both, turned[1])):
        with pytest.raises(ZeroDivisionError):
            asked(*pair)


def test_what_is_surely_better_with_the_lengths_as_drawn_is_asked_whether_it_lets_logs_agree(axes):
    drawn = next(each for each in single_readings(axes.arm) if each.words == "q2 negated")
    longer = replace(drawn, stretch=np.array([0.8, 1.25, 0.8]))
    gain = np.array([0.7 * BETTER, 0.5 * BETTER, 0.1 * BETTER])
    for reading, factor, evidence, expected in (
        (drawn, 1.1, 1.1 * EVIDENCE, True),
        (drawn, 0.7, 1.1 * EVIDENCE, False),
        (drawn, 1.1, 0.9 * EVIDENCE, False),
        (longer, 1.1, 1.1 * EVIDENCE, False),
    ):
        assert between_logs._ordinary(Alternative((reading,), factor * gain, evidence, borne_out=True)) == expected


# Judgement of what was found


def test_own_torque_and_friction_must_say_the_same_amount_of_one_joint():
    own = Scale(joint=1, value=1.28, std=0.068, evidence=150.0, friction=1.27)
    with pytest.raises(Contradiction, match=r"v2 counts 1\.28 times .* alike"):
        check_scales(said(SOUND[0], own, SOUND[2]))
    for other in (
        replace(own, friction=1.03),  # friction did not change: the arm's torque has another reason
        replace(own, friction=0.72),
        replace(own, std=0.09),  # 3.1 deviations
        replace(own, friction=None),
        replace(own, value=1.1, std=0.028, friction=1.05),  # friction between weeks differs by as much
    ):
        check_scales(said(SOUND[0], other, SOUND[2]))


def test_friction_of_all_joints_that_changes_alone_is_no_other_scale():
    check_scales(said(*(replace(each, friction=0.7) for each in SOUND)))
    check_units(said(*(replace(each, friction=0.7) for each in SOUND)))
    check_scales(said(*(replace(each, value=1.21, std=0.04, friction=0.83) for each in SOUND)))


def test_a_large_factor_takes_friction_as_well():
    far = Scale(joint=2, value=4.1, std=0.9, evidence=31.0, friction=4.3)
    with pytest.raises(Contradiction, match=r"v3 counts 4\.1 times"):
        check_units(said(*SOUND[:2], far))
    small = replace(far, value=0.23, friction=0.21)
    for slight in (small, replace(small, friction=0.0)):
        with pytest.raises(Contradiction, match=r"v3 counts 0\.23 times"):
            check_units(said(*SOUND[:2], slight))
    for other in (replace(far, friction=1.2), replace(far, evidence=19.0), replace(far, value=2.9)):
        check_units(said(*SOUND[:2], other))


def test_a_joint_whose_friction_alone_changed_gets_a_note_if_its_own_torque_agrees():
    odd = Scale(joint=1, value=1.09, std=0.05, evidence=2.0, friction=1.1)
    quiet = [replace(each, friction=f) for each, f in zip((SOUND[0], SOUND[2]), (0.995, 1.004), strict=True)]
    (note,) = scale_notes(said(quiet[0], odd, quiet[1]))
    assert "friction of joint 2 alone is 1.1 times that in one.csv" in note
    assert scale_notes(said(quiet[0], replace(odd, value=0.91), quiet[1])) == ()
    assert scale_notes(said(quiet[0], replace(odd, friction=1.05), quiet[1])) == ()
    assert scale_notes(said(quiet[0], replace(odd, value=0.82, std=0.115), quiet[1])) == ()
    warm = [replace(each, friction=1.1) for each in quiet]
    assert scale_notes(said(warm[0], odd, warm[1])) == ()


def test_a_joint_whose_own_torque_is_too_faint_to_tell_gets_a_note_if_its_friction_changed_much():
    quiet = [replace(each, friction=f) for each, f in zip(SOUND[:2], (0.995, 1.004), strict=True)]
    faint = Scale(joint=2, value=0.88, std=0.24, evidence=1.0, friction=1.24)
    (note,) = scale_notes(said(*quiet, faint))
    assert "friction of joint 3 alone is 1.24 times" in note
    assert "of v3 is too faint to tell" in note
    assert scale_notes(said(*quiet, replace(faint, friction=1.2))) == ()
    assert scale_notes(said(*quiet, replace(faint, value=0.97, std=0.05))) == ()  # for no other scale, and sure of it
    assert scale_notes(said(*(replace(each, friction=1.24) for each in quiet), faint)) == ()


def test_a_sure_scale_takes_a_friction_that_drifted_by_less_than_half_of_what_is_worth_a_refusal():
    sure = Scale(joint=1, value=0.908, std=0.004, evidence=60.0, friction=0.88)
    others = (SOUND[0], SOUND[2])
    with pytest.raises(Contradiction, match=r"two\.csv: v2 counts 0\.908 times those of one\.csv"):
        check_scales(said(*others, sure))
    check_scales(said(*others, replace(sure, friction=0.87)))  # 0.038 off
    check_scales(said(*others, replace(sure, friction=0.95)))
    check_scales(said(*others, replace(sure, value=0.99, friction=0.92, std=0.003)))


def test_joints_that_contradict_each_other_far_beyond_accident_give_no_gain():
    finding = Finding(
        check="joints", joint=2, statistic=TORN_Z + 0.4, threshold=3.9, measure="", sentence="", change=-TORN - 0.3
    )
    reason = torn([replace(finding, check="halves"), finding])
    assert reason is not None
    assert "joint 3" in reason
    for other in (
        replace(finding, statistic=TORN_Z - 0.1),
        replace(finding, change=TORN - 0.1),
        replace(finding, check="halves"),
        replace(finding, change=None),
    ):
        assert torn([other]) is None


def test_a_negative_gain_and_one_of_another_unit_get_a_note():
    (note,) = sign_notes({0: 13.2, 3: -7.1})
    assert note.startswith("joint 4: identified, but negative: v4 counts against q4")
    gains = {0: 13.2, 1: 9.7 / FAR / 1.4, 2: -9.7}
    (note,) = size_notes(gains)
    assert note.startswith("joint 2: ")
    (note,) = size_notes({**gains, 1: 11.4 * FAR * 1.2})
    assert note.startswith("joint 2: ")
    assert size_notes({0: 13.2, 1: 11.4 / FAR * 1.2}) == ()
    assert size_notes({4: 5e-6}) == ()


@pytest.mark.parametrize("zero", [0.0, 3.0])
def test_joints_that_yield_are_no_zero_of_one_log_and_a_zero_still_is_one(axes, monkeypatch, zero):
    soft = Truth(compliance=(6e-4, 6e-4, 6e-4) if not zero else (0.0, 0.0, 0.0))
    bare, loaded = real_logs(soft, (None, BRICK), np.random.default_rng(2), noise=0.002)
    turned = Recording(loaded.t, loaded.q + np.deg2rad([0.0, zero, 0.0]), loaded.v, loaded.name)
    better = list[str]()

    def looked_at(arm, unknowns, motions, recordings, given):
        found = one_log_explanations(arm, unknowns, motions, recordings, given)
        better.extend(each.reading.words for each in found if gain_over(given.left, each.left).sum() > 0.03)
        return []

    monkeypatch.setattr("ident.wiring.one_log_explanations", looked_at)
    check_wiring(axes, bare, turned, ObserveOptions())
    if zero:
        assert any(each.startswith("q2 minus") and each.endswith("loaded alone") for each in better)
    else:
        assert better == []  # its zero imitates a little of what every reading leaves
