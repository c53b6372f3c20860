"""Lengths and clocks that are off by a few percent are found by the factor."""

import re
from dataclasses import replace

import numpy as np
import pytest
from ident.checks.comparison import compared, prepared
from ident.explanation import Explanation, explanations, unknowns_of
from ident.instants import calmer, instants
from ident.rates import rate_notes
from ident.readings import as_it_is, readings
from ident.scale_of_lengths import scaled_lengths, searched
from ident.wiring import check_wiring
from known_logs import BRICK, UR_GAIN, UR_MIDDLE, arm_of, known_logs, scara, ur_like

from ident import scale_of_lengths
from ident.errors import OtherLengths
from ident.observation import ObserveOptions
from ident.recording import Recording
from ident.structure import Structure, structure_of

OBSERVING = ObserveOptions()


@pytest.fixture(scope="module")
def ur() -> Structure:
    return structure_of(arm_of(ur_like()))


@pytest.fixture(scope="module")
def logs() -> tuple[Recording, Recording]:
    return known_logs(ur_like(), BRICK, UR_GAIN, np.random.default_rng(21), middle=UR_MIDDLE, noise=0.004)


def longer(structure: Structure, factor: float, joint: int | None = None) -> Structure:
    """The model with lengths that are off, all or that before a joint from 0."""
    which = np.ones(structure.arm.n) if joint is None else np.arange(structure.arm.n) == joint
    stretch = np.where(which > 0, factor, 1.0)
    return structure_of(replace(structure.arm, translation=stretch[:, None] * structure.arm.translation))


def timed(log: Recording, factor: float) -> Recording:
    return Recording(factor * log.t, log.q, log.v, log.name)


def scaled(structure: Structure, logs, most: int = 250) -> list[Explanation]:
    """Lengths that are surely better."""
    seen = [instants(each, most, OBSERVING) for each in logs]
    calm = [instants(each, most, calmer(OBSERVING)) for each in logs]
    return scaled_lengths(structure.arm, unknowns_of(structure), seen, calm)


def words(structure: Structure, logs) -> list[str]:
    """What is found, the best first."""
    return [each.reading.words for each in sorted(scaled(structure, logs), key=lambda each: np.log(each.left).sum())]


def test_a_sound_log_has_no_other_lengths(ur, logs):
    assert words(ur, logs) == []


def test_the_factor_of_all_lengths_is_found_with_the_clock_that_is_the_same(ur, logs):
    # 0.824 of the model's lengths are right, or a clock that counts 1.102 times. Noise errs by 0.01.
    best = words(longer(ur, 17 / 14), logs)[0]
    assert re.fullmatch(r"every length times 0\.8(1|2|3)\d?, or t times 1\.(09|1|10|11)\d?", best), best


def test_a_clock_that_runs_slow_in_all_logs_is_the_square_of_its_factor(ur, logs):
    best = words(ur, [timed(each, 0.5) for each in logs])[0]
    assert re.fullmatch(r"every length times 0\.2[45]\d?, or t times (1\.9[6-9]|2|2\.0[0-4])", best), best


def test_one_length_that_is_off_is_named_alone(ur, logs):
    best = words(longer(ur, 1.15, 3), logs)[0]
    assert re.fullmatch(r"the length from joint 3 to 4 times 0\.8[5-9]\d?", best), best


def test_arms_that_slide_have_no_such_clock_and_arms_without_lengths_nothing_to_scale(logs):
    slide = replace(arm_of(ur_like()), revolute=np.array([1, 1, 0, 1, 1, 1]) > 0)
    assert "or t times" in words(longer(structure_of(arm_of(ur_like())), 1.2), logs)[0]
    assert scaled(structure_of(replace(slide, translation=np.zeros((6, 3)))), logs) == []
    few = [Recording(each.t, each.q[:, :4], each.v[:, :4], each.name) for each in logs]
    assert not any("or t times" in each for each in words(structure_of(arm_of(scara())), few))


def test_lengths_whose_factor_was_searched_take_the_place_of_those_that_were_tried(ur, logs):
    seen = [instants(each, 60, OBSERVING) for each in logs]
    tried = [each for (each, *_) in readings(ur.arm) if (each.stretch != 1.0).any() or each.words == "q3 negated"]
    every = replace(as_it_is(ur.arm), words="all", stretch=np.full(6, 0.93))
    found = explanations(ur.arm, unknowns_of(ur), seen, (every,))
    left = [each.words for each in tried if not searched(each, found)]
    assert "q3 negated" in left
    assert "the length from joint 2 to 3 times 0.8" in left
    assert not any(each.startswith("every length") for each in left)
    assert len(left) == len(tried) - 2
    assert not any(searched(each, []) for each in tried)


def test_a_coarse_encoder_on_the_right_arm_makes_no_other_lengths(ur, logs, monkeypatch):
    rng = np.random.default_rng(23)
    coarse = [Recording(each.t, each.q + rng.normal(0.0, 7e-4, each.q.shape), each.v, each.name) for each in logs]
    assert scaled(ur, coarse) == []
    monkeypatch.setattr(scale_of_lengths, "LASTS", -np.inf)
    assert scaled(ur, coarse)


def test_wrong_lengths_are_refused_and_checked_by_their_factor(ur, logs):
    wrong = longer(ur, 1.3)
    with pytest.raises(OtherLengths, match=r"this one: every length times 0\.7[5-9]\d*, or t times 1\.1[3-6]\d* \("):
        check_wiring(wrong, *logs, OBSERVING)
    named = [each.readings[0].words for each in compared(prepared(wrong, logs, OBSERVING)).alternatives]
    assert named[0].startswith("every length times 0.7")
    assert not any(re.match(r"every length times (0\.8|1\.25)$", each) for each in named)


def test_logs_of_unlike_rates_are_told(logs):
    assert rate_notes(logs) == ()
    assert rate_notes((logs[0], timed(logs[1], 1.015))) == ()
    (note,) = rate_notes((logs[0], logs[1], timed(logs[1], 0.8)))
    assert note.startswith("loaded: sampled at 156.3 Hz, bare at 125 Hz; was it set so")
