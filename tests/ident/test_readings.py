"""Other readings of a log: each undoes one mistake."""

from dataclasses import replace

import numpy as np
import pytest
from ident.readings import WEIGHTLESS, Reading, readings
from known_logs import arm_of, ur_like

from ident.arm import Arm

LOG = np.array([0.3, -1.2, 1.1, -0.4, 0.7, 0.2])


@pytest.fixture(scope="module")
def arm() -> Arm:
    return arm_of(ur_like())


def by_words(arm: Arm) -> dict[str, Reading]:
    every = [reading for family in readings(arm) for reading in family]
    named = {reading.words: reading for reading in every}
    assert len(named) == len(every)
    return named


def read(reading: Reading) -> np.ndarray:
    return reading.factor * LOG[reading.q_order] + reading.zero


def test_the_first_reading_is_the_log_as_it_is(arm):
    first = next(readings(arm))[0]
    np.testing.assert_array_equal(read(first), LOG)
    np.testing.assert_array_equal(first.v_order, np.arange(6))
    np.testing.assert_array_equal(first.stretch, np.ones(6))
    assert first.gravity is arm.gravity


def test_readings_of_one_mistake_are_all_there_once(arm):
    # 6 (2 signs x 4 zeros - 1), 15 pairs three ways, 26 directions but its own, 2 factors (all, 5 lengths), no weight
    assert len(by_words(arm)) == 1 + 6 * 7 + 3 * 15 + 25 + 2 * 6 + 1
    assert not by_words(arm)[WEIGHTLESS].gravity.any()
    assert WEIGHTLESS not in by_words(replace(arm, gravity=np.zeros(3)))


def test_signs_and_zeros_of_one_joint_are_read_as_their_words_say(arm):
    named = by_words(arm)
    for words, third in (
        ("q3 negated", -1.1),
        ("q3 plus 90 degrees", 1.1 + np.pi / 2),
        ("q3 negated plus 90 degrees", -1.1 + np.pi / 2),
        ("q3 negated plus 270 degrees", -1.1 + 3 * np.pi / 2),
    ):
        # Two roundings of numbers below 10.
        np.testing.assert_allclose(read(named[words]), [0.3, -1.2, third, -0.4, 0.7, 0.2], rtol=1e-14)


def test_exchanged_columns_are_read_from_each_other_s_place(arm):
    named = by_words(arm)
    other = [0.3, 0.7, 1.1, -0.4, -1.2, 0.2]
    for words, q, v in (
        ("columns q2 and q5 exchanged", other, [0, 1, 2, 3, 4, 5]),
        ("columns v2 and v5 exchanged", list(LOG), [0, 4, 2, 3, 1, 5]),
        ("joints 2 and 5 exchanged", other, [0, 4, 2, 3, 1, 5]),
    ):
        np.testing.assert_array_equal(read(named[words]), q)
        np.testing.assert_array_equal(named[words].v_order, v)


def test_readings_of_a_family_are_of_the_same_states(arm):
    for family in readings(arm):
        for reading in family:
            np.testing.assert_array_equal(read(reading), read(family[0]))
            assert reading.gravity is family[0].gravity


def test_a_turned_base_keeps_the_size_of_gravity_and_never_repeats_the_model_s(arm):
    turned = {words: reading.gravity for words, reading in by_words(arm).items() if words.startswith("gravity")}
    assert "gravity along (0, 0, -1) of the base" not in turned
    np.testing.assert_allclose([np.linalg.norm(g) for g in turned.values()], 9.81, rtol=1e-14)  # rounding
    along = turned["gravity along (0, 1, -1) of the base"]
    np.testing.assert_allclose(along, [0.0, 9.81 / np.sqrt(2), -9.81 / np.sqrt(2)], rtol=1e-14)
    weightless = by_words(replace(arm, gravity=np.zeros(3)))
    assert not any(words.startswith("gravity") for words in weightless)


def test_lengths_that_are_there_are_stretched_and_those_before_the_first_joint_are_not(arm):
    named = by_words(arm)
    np.testing.assert_array_equal(named["every length times 0.8"].stretch, 0.8 * np.ones(6))
    np.testing.assert_array_equal(named["the length from joint 3 to 4 times 1.25"].stretch, [1, 1, 1, 1.25, 1, 1])
    assert "the length from joint 0 to 1 times 1.25" not in named
    short = np.array(arm.translation)
    short[2] = 0.0
    assert "the length from joint 2 to 3 times 1.25" not in by_words(replace(arm, translation=short))


def test_a_sliding_joint_has_a_sign_and_no_turns(arm):
    sliding = by_words(replace(arm, revolute=np.arange(6) != 3))
    assert [words for words in sliding if words.startswith("q4")] == ["q4 negated"]
