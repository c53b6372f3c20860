"""When one reading of a log is surely better than another: gains, their evidence, ties."""

from dataclasses import replace

import numpy as np
import pytest
from ident.evidence import (
    BETTER,
    EVIDENCE,
    LENGTH_EVIDENCE,
    NOTHING,
    TIE,
    among_best,
    convincing,
    evidence_of,
    gain_over,
)
from ident.readings import as_it_is


def test_a_gain_is_the_logarithm_of_what_was_left_over_what_is_left():
    own, left = np.array([0.3, 0.2, 0.7]), np.array([0.1, 0.5, 0.7 / np.e])
    np.testing.assert_allclose(gain_over(own, left), [np.log(3.0), -np.log(2.5), 1.0], rtol=1e-14)  # some roundings


def test_a_joint_that_either_reading_has_too_few_instants_of_gains_nothing():
    own, left = np.array([np.inf, 0.4, np.inf, 0.2]), np.array([0.1, np.inf, np.inf, 0.3])
    np.testing.assert_allclose(gain_over(own, left), [0.0, 0.0, 0.0, np.log(2.0 / 3.0)], rtol=1e-14, atol=0)


def test_what_is_left_of_exact_data_is_no_gain_over_less():
    own, left = np.array([0.5, 0.3, 3.0]) * NOTHING, np.array([0.1, 7.0, 0.2]) * NOTHING
    np.testing.assert_allclose(gain_over(own, left), [0.0, -np.log(7.0), np.log(3.0)], rtol=1e-12, atol=0)


def test_evidence_counts_each_current_with_the_fewer_instants_of_both_readings():
    gain, own, other = np.array([0.2, -0.03, 0.5]), np.array([700, 90, 11]), np.array([400, 1000, 13])
    expected = 0.2 * 400 - 0.03 * 90 + 0.5 * 11
    np.testing.assert_allclose(evidence_of(gain, own, other), expected, rtol=1e-14)
    np.testing.assert_allclose(evidence_of(gain, other, own), expected, rtol=1e-14)


@pytest.mark.parametrize(("stretch", "least"), [((1.0, 1.0, 1.0), EVIDENCE), ((1.0, 0.8, 1.0), LENGTH_EVIDENCE)])
def test_a_reading_convinces_by_gain_and_by_evidence_of_which_another_length_takes_less(arm, stretch, least):
    reading = replace(as_it_is(arm), stretch=np.array(stretch))
    enough, little = np.array([0.8, -0.3, 0.6]) * BETTER, np.array([0.8, -0.3, 0.4]) * BETTER  # 1.1 and 0.9 in sum
    assert convincing(enough, 1.01 * least, reading)
    assert not convincing(enough, 0.99 * least, reading)
    assert not convincing(little, 1.01 * least, reading)


def test_readings_within_a_tie_of_the_best_sum_are_among_the_best():
    best = np.array([0.4, -0.1])
    gains = [best - [0.6 * TIE, 0.5 * TIE], best - [-0.3 * TIE, 1.2 * TIE], best, np.array([0.1, 0.1])]
    assert among_best(gains).tolist() == [False, True, True, False]
    assert among_best([-best, -2.0 * best]).tolist() == [True, False]
    assert among_best([]).tolist() == []
