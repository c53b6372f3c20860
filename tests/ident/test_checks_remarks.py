"""What a comparison of readings is told as: sure, perhaps, not excluded, or nothing; of made-up comparisons."""

from dataclasses import replace

import numpy as np
import pytest
from ident.checks.arm_remarks import arm_remarks, named_readings, words_of
from ident.checks.comparison import Alternative, Comparison, single_readings
from ident.checks.remark import Grade, Remark
from ident.explanation import Explanation
from ident.readings import Reading, as_it_is
from known_logs import arm_of, ur_like

from ident.arm import Arm

LEFT = np.array([0.04, 0.31, 0.05, 0.2, 0.06, 0.07])
"""Shares that the log as it is leaves of each current."""
BETTER = np.array([0.0, -0.1, 0.2, np.log(4.0), 0.01, -0.02])
"""Of current 4 a quarter is left, and more of that of joint 3 than of joint 1."""


@pytest.fixture(scope="module")
def arm() -> Arm:
    return arm_of(ur_like())


@pytest.fixture(scope="module")
def by_words(arm) -> dict[str, Reading]:
    return {each.words: each for each in single_readings(arm)}


@pytest.fixture
def compared(arm, by_words):
    def made(*alternatives: tuple[str, float], gain=BETTER, left=LEFT, **more) -> Comparison:
        """The alternatives by words, several of them joined by ` = `, and evidence."""
        return Comparison(
            given=Explanation(as_it_is(arm), left, np.full(6, 900)),
            alternatives=tuple(
                Alternative(tuple(by_words[each] for each in words.split(" = ")), gain, evidence, borne_out=True)
                for words, evidence in alternatives
            ),
            **{"unreachable": (), "same": (), **more},
        )

    return made


def told(found: Comparison, topic: str, backward=()) -> list[Remark]:
    return [each for each in arm_remarks(found, backward) if each.topic == topic]


def best(found: Comparison, backward=()) -> Remark:
    (line,) = told(found, "signs, zeros, order, base", backward)
    return line


def test_a_sure_reading_is_wrong_and_says_how_much_less_it_leaves_of_the_current_that_shows_it_most(compared):
    line = best(compared(("q3 negated", 60.0)))
    assert (line.grade, line.joint) == (Grade.WRONG, 3)
    assert line.seen == "q3 negated explains the currents better: unexplained of v4 5 instead of 20 %"


def test_a_reading_with_some_evidence_is_perhaps_so(compared):
    line = best(compared(("q3 negated", 20.5)))
    assert (line.grade, line.joint) == (Grade.WEAK, 3)
    assert line.seen == "perhaps q3 negated: unexplained of v4 5 instead of 20 %, too little to be sure"
    assert told(compared(("q3 negated", 20.5)), "these logs do not tell") == []


def test_of_readings_without_evidence_those_that_have_little_against_them_are_not_excluded(compared):
    found = compared(
        ("q3 negated", 19.5), ("q5 negated", -19.5), ("q2 negated", -20.5), ("every length times 0.8", 3.0)
    )
    assert best(found).grade is Grade.GOOD
    assert best(found).seen.endswith("; unexplained: 4, 31, 5, 20, 6, 7 % of rms")
    (line,) = told(found, "these logs do not tell")
    assert (line.grade, line.seen) == (Grade.WEAK, "q3 negated; q5 negated")
    many = compared(*((f"q{j} negated", -0.7 * j) for j in range(1, 7)))
    (line,) = told(many, "these logs do not tell")
    assert line.seen == "q1 negated; q2 negated; q3 negated; q4 negated; 2 more"


def test_what_explains_the_same_is_told_and_is_no_mistake(compared, by_words):
    found = compared(same=(by_words["q1 plus 90 degrees"], by_words["q6 negated"]))
    assert best(found).grade is Grade.GOOD
    (line,) = told(found, "no motion tells")
    assert (line.grade, line.seen) == (Grade.GOOD, "q1 plus 90 degrees, q6 negated: the same by the kinematics")


def test_a_joint_of_too_few_instants_has_no_share_left(compared):
    found = compared(left=np.where(np.arange(6) == 1, np.inf, LEFT))
    assert best(found).seen.endswith("unexplained: 4, -, 5, 20, 6, 7 % of rms")


def test_where_the_log_as_it_is_cannot_be_any_better_reading_is_named(compared, by_words):
    (line,) = told(compared(unreachable=(1, 4)), "reach")
    assert (line.grade, line.joint, line.seen) == (Grade.WRONG, 1, "q2, q5 are where the model's joints cannot be")
    (line,) = told(compared(unreachable=(4,)), "reach")
    assert line.seen == "q5 is where the model's joints cannot be"
    assert best(compared(("q3 negated", 0.3), unreachable=(4,))).grade is Grade.WRONG
    assert best(compared(("q3 negated", 0.3))).grade is Grade.GOOD
    # What is the same by the kinematics can be: against it, others are as sure as they are anywhere.
    for evidence, words in ((44.0, "q1 plus 180 degrees puts"), (46.0, "q3 negated explains")):
        found = compared(("q3 negated", evidence), unreachable=(4,), same=(by_words["q1 plus 180 degrees"],))
        assert best(found).seen.startswith(words)
        assert told(found, "these logs do not tell") == []


@pytest.mark.parametrize(
    ("evidence", "backward", "sure"), [(12.5, (2,), True), (11.5, (2,), False), (12.5, (1, 3), False)]
)
def test_friction_that_drives_a_joint_is_a_second_witness_for_its_sign(compared, evidence, backward, sure):
    found = compared(("q5 plus 180 degrees = q3 negated", evidence))
    assert (best(found, backward).grade is Grade.WRONG) == sure
    assert bool(named_readings(found, backward)) == sure


def test_of_sure_readings_those_within_a_tie_of_the_best_are_named(compared):
    found = compared(("q3 negated", 70.0), ("q5 negated", 60.0))
    for less, words in ((0.009, "q3 negated or q5 negated explains"), (0.011, "q3 negated explains")):
        first, second = found.alternatives
        second = replace(second, gain=second.gain - less * (np.arange(6) == 4))
        assert best(replace(found, alternatives=(first, second))).seen.startswith(words)


def test_words_begin_with_what_lets_friction_brake_and_leave_out_what_is_beyond_four(by_words):
    five = [by_words[f"q{j} negated"] for j in range(1, 6)]
    assert words_of(five, (3,)) == "q4 negated = q1 negated = q2 negated = q3 negated = 1 more"
    assert words_of(five[:2]) == "q1 negated = q2 negated"
    assert words_of([five[0], by_words["q6 plus 90 degrees"]]) == "q6 plus 90 degrees = q1 negated"
