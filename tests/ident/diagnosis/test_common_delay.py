"""A delay that is common to all logs and joints is measured and undone on request, and nothing else is."""

import re
from dataclasses import replace

import numpy as np
import pytest
import scipy
from consistency_logs import LOOSE, changed, doubted, identified, logs_of, named
from known_logs import BRICK, mounted
from real_friction import Truth

import ident.diagnosis.diagnose as measuring
from ident.diagnosis.diagnose import common_delay
from ident.diagnosis.diagnosis import Severity
from ident.diagnosis.limits import exclusions, undetected_sizes
from ident.diagnosis.search import faults, survey
from ident.identification import check
from ident.observation.observation import ObserveOptions, observe
from ident.preparation import DOUBTED, SIMULATED, prepare
from ident.recordings.recording import Recording

pytestmark = pytest.mark.usefixtures("_computed_once")

AUTO = replace(DOUBTED, undelay=True)


def shifted(log: Recording, delay: float) -> Recording:
    """Currents that are logged late by a time [s], by splines, as no code under test shifts them."""
    spline = scipy.interpolate.CubicSpline(log.t, log.v)
    return changed(log, v=spline(np.clip(log.t - delay, log.t[0], log.t[-1])))


@pytest.fixture(scope="module")
def pair() -> list[Recording]:
    return logs_of(Truth())


@pytest.fixture(scope="module")
def behind(pair) -> list[Recording]:
    return [shifted(log, 7.3e-3) for log in pair]


@pytest.mark.parametrize(("delay", "way"), [(7.3e-3, "late"), pytest.param(-11.9e-3, "early", marks=pytest.mark.slow)])
def test_a_common_delay_is_undone_and_the_gains_are_those_of_sound_logs(axes, pair, delay, way):
    sound = identified(axes, pair, policy=SIMULATED).estimate
    spoilt = [shifted(log, delay) for log in pair]
    corrected = identified(axes, spoilt, policy=AUTO)
    said = named(corrected.found.diagnoses, "delay")
    assert (said.severity, said.unit) == (Severity.WEAK, "ms")
    assert 0.1 < said.std < 1.5
    assert abs(said.value - 1e3 * delay) < 3.0 * said.std
    assert said.z > 5.0
    assert said.sentence == f"the currents are logged {abs(said.value):.1f} ± {said.std:.1f} ms {way}: corrected"
    np.testing.assert_allclose(corrected.observing.current_delay, -1e-3 * said.value, rtol=1e-12)
    for mine, right in zip(corrected.estimate.joints, sound.joints, strict=True):
        assert abs(mine.value - right.value) < right.std  # the same noise: what differs is the delay left
    told = named(measuring.diagnose(doubted(axes, spoilt)).diagnoses, "delay")  # without asking it is named
    assert told.advice.endswith("--current-delay auto")
    assert told.std == pytest.approx(said.std, rel=0.5)  # before and after it is undone


def test_a_sound_pair_is_not_changed_and_the_answer_says_what_it_excludes(axes, pair):
    plain, asked = identified(axes, pair, policy=DOUBTED), identified(axes, pair, policy=AUTO)
    assert [each.value for each in asked.estimate.joints] == [each.value for each in plain.estimate.joints]
    assert asked.observing == ObserveOptions()
    (said,) = [each for each in asked.found.reported if each not in plain.found.reported]
    assert said.severity is Severity.GOOD
    seen = survey(doubted(axes, pair))
    of_all, of_one = [each for each in exclusions(seen, undetected_sizes(seen)) if each.family == "delay"]
    assert (of_all.joints, bool(of_one.joints)) == ((), True)
    assert said.sentence.endswith(f"delays beyond {of_all.limit:.2g} ms are excluded")


def test_a_delay_is_undone_beside_the_one_that_is_stated(axes, pair):
    # A reference that acts 6 ms after its stamp, logged 7.3 ms late beside: in all it acts 1.3 ms before.
    motions = mounted(*(shifted(log, 1.3e-3) for log in pair), BRICK)
    prepared = prepare(motions, axes, observing=ObserveOptions(current_delay=6e-3), gains=LOOSE, policy=AUTO)
    said = named(prepared.diagnoses, "delay")
    assert abs(said.value - 7.3) < 3.0 * said.std
    np.testing.assert_allclose(prepared.observing.current_delay, 6e-3 - 1e-3 * said.value, rtol=1e-9)


def test_a_check_undoes_the_same_delay_if_it_is_asked(axes, behind, monkeypatch):
    monkeypatch.setattr("ident.identification.DEFAULT", "ls-2011")  # quick
    asked = {"observing": ObserveOptions(), "gains": LOOSE, "loaded": [False, True], "payload": BRICK}
    checked = check(behind, axes, undelay=True, **asked)
    delay, _ = common_delay(doubted(axes, behind))
    np.testing.assert_allclose(named(checked.found.findings, "delay").value, 1e3 * delay, rtol=1e-9)
    np.testing.assert_allclose(checked.observing.current_delay, -delay, rtol=1e-9)
    plain = check(behind, axes, **asked)
    assert plain.observing == ObserveOptions()
    assert [each.advice for each in plain.found.findings if each.name == "delay"] != [None]


def test_what_comes_before_a_common_delay_is_named_and_nothing_is_corrected(axes, pair):
    delay, said = common_delay(doubted(axes, [pair[0], shifted(pair[1], 24e-3)]))
    assert (delay, said.value, said.severity) == (0.0, None, Severity.WEAK)
    assert said.sentence.startswith("delay not corrected, because another fault is more significant: ")
    assert re.search("ms later than the positions .* in loaded alone", said.sentence)


def test_a_delay_that_something_else_may_be_is_not_corrected(axes, behind, monkeypatch):
    def tied(seen):
        (first, *_) = faults(seen)
        zero = replace(first.best.alternative, words="the zero of q2 is off by 3 degrees")
        yield first._replace(rivals=(first.model.small[0], replace(first.best, alternative=zero)))

    monkeypatch.setattr(measuring, "faults", tied)
    delay, said = common_delay(doubted(axes, behind))
    assert delay == 0.0
    assert said.sentence.endswith("cannot distinguish from: delay or the zero of q2 is off by 3 degrees")


def test_samples_that_are_spoilt_are_left_out_where_a_delay_is_undone_too(axes, behind):
    v = behind[1].v.copy()
    v[700:1150, 1] = v[700, 1]
    prepared = prepare(mounted(behind[0], changed(behind[1], v=v), BRICK), axes, gains=LOOSE, policy=AUTO)
    assert prepared.observing.current_delay < 0.0
    part = prepared.parts[1]
    assert part.spoilt[700:1150, 1].all()
    expected = observe(part.recording, axes, prepared.observing, part.spoilt).joints[1]
    whole = observe(part.recording, axes, prepared.observing).joints[1]
    assert len(expected.position) < len(whole.position) - 50
    for seen in (part.observation, prepared.problem.motions[1].observation):
        np.testing.assert_array_equal(seen.joints[1].position, expected.position)
