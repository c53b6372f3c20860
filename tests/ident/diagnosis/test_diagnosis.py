"""How a diagnosis is to be taken: whether it is so, and whether it matters."""

from dataclasses import replace

import numpy as np
import pytest
from estimates import gain_estimate

from ident.diagnosis.diagnose import _between, _consequence, severity_of
from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Effect, Severity, worst, worst_first
from ident.errors import Contradiction
from ident.estimate import IdentifiedGain, RefusedGain
from ident.identification import refusal_of, spoilt_joints, without_spoilt


def effect(joint: int, percent: float, deviations: float | None) -> Effect:
    return Effect(joint=joint, percent=percent, deviations=deviations)


@pytest.mark.parametrize(
    ("effects", "expected"),
    [
        ([(0, 7.0, 0.4), (1, -0.2, -0.49)], Severity.GOOD),
        ([(0, 0.1, 0.4), (1, -0.2, -0.51)], Severity.WEAK),
        ([(0, 0.1, 2.9)], Severity.WEAK),
        ([(0, 0.1, 0.1), (3, 0.2, -3.1)], Severity.WRONG),
        ([(0, 0.9, None)], Severity.WEAK),  # without gains nobody knows that it does not matter
        ([(0, -1.1, None)], Severity.WRONG),
        ([], Severity.WEAK),
    ],
)
def test_severity_follows_from_the_largest_effect(effects, expected):
    assert severity_of([effect(*each) for each in effects]) is expected


def test_gains_that_others_contradict_are_off_by_their_ratio():
    now = gain_estimate(2.6, None, 1.7, 1.3, std=0.02, reason="no load")
    right = gain_estimate(2.0, 3.0, 1.7, None, std=0.02, reason="no load")
    found = {each.joint: each for each in _between(now, right)}
    assert sorted(found) == [0, 1, 2, 3]
    np.testing.assert_allclose(found[0].percent, 30.0, rtol=1e-9)
    claimed = now.joints[0].total_std / 2.6
    assert claimed > now.joints[0].predicted_rel_std
    np.testing.assert_allclose(found[0].deviations, 0.3 / claimed, rtol=1e-9)
    np.testing.assert_allclose(found[1].percent, 100.0, rtol=1e-9)  # one that would be found otherwise is lost
    np.testing.assert_allclose(found[2].percent, 0.0, atol=1e-9)
    np.testing.assert_allclose(found[3].percent, 1000.0, rtol=1e-9)  # a gain that ought to be refused is no result


def test_the_consequence_is_told_of_the_gains_that_matter():
    assert _consequence([]) == ""
    assert _consequence([effect(0, 4.0, 0.3)]) == "; no gain is moved noticeably"
    said = _consequence([effect(0, 4.04, 1.3), effect(1, -0.2, -0.1), effect(4, -11.0, -7.0)])
    assert said == "; gains are off: joint 1 +4 %, joint 5 -11 %"
    assert _consequence([effect(0, 4.0, 1.3), effect(2, -140.0, -9.0)]) == "; the gain of joint 3 is no result"
    assert "7.3 % of joint 2's current" in _consequence([effect(0, 4.0, None), effect(1, 7.31, None)])


def said(severity: Severity, **more) -> Diagnosis:
    return Diagnosis(**({"name": "zero", "severity": severity, "sentence": "the zero of q2 is off"} | more))


def test_the_worst_stands_first_and_is_that_of_all():
    found = [said(Severity.GOOD), said(Severity.WRONG), said(Severity.WEAK), said(Severity.WRONG, name="delay")]
    assert [(each.severity, each.name) for each in worst_first(found)] == [
        (Severity.WRONG, "zero"), (Severity.WRONG, "delay"), (Severity.WEAK, "zero"), (Severity.GOOD, "zero"),
    ]  # fmt: skip
    assert worst(found) is Severity.WRONG
    assert worst([]) is Severity.GOOD
    assert len(Diagnosed(diagnoses=tuple(found)).doubts) == 3


def test_the_worst_effect_is_the_one_of_most_deviations():
    found = said(Severity.WEAK, effects=(effect(0, 40.0, 0.7), effect(1, -3.0, -2.2), effect(2, 1.0, 0.1)))
    assert found.worst.joint == 1
    assert said(Severity.WEAK, effects=(effect(0, 0.4, None), effect(1, -3.0, None))).worst.joint == 1


# What follows for the gains

GAINS = gain_estimate(2.6, 1.7, 1.3, std=0.02, reason="no load")


def test_gains_that_something_wrong_spoils_are_refused_and_the_others_are_kept():
    wrong = said(
        Severity.WRONG,
        effects=(effect(0, 9.0, 4.1), effect(1, 1.0, 2.9), effect(2, -8.0, -3.3)),
        advice="use it",
    )
    kept = without_spoilt(GAINS, [said(Severity.WEAK, joints=(1,)), wrong])
    assert [isinstance(each, IdentifiedGain) for each in kept.joints] == [False, True, False]
    assert kept.joints[1] == GAINS.joints[1]
    assert isinstance(kept.joints[0], RefusedGain)
    assert kept.joints[0].reason == "the zero of q2 is off"
    assert kept.joints[0].predicted_rel_std == GAINS.joints[0].predicted_rel_std


def test_something_wrong_without_effects_spoils_the_joints_that_it_names():
    assert spoilt_joints(said(Severity.WRONG, joints=(2,))) == (2,)
    assert spoilt_joints(said(Severity.WRONG, joints=(2,), effects=(effect(0, 9.0, 3.1),))) == (0,)
    assert without_spoilt(GAINS, [said(Severity.WEAK, joints=(0, 1, 2))]).joints == GAINS.joints


def test_where_no_gain_is_left_all_of_it_is_refused():
    with pytest.raises(Contradiction, match="the zero of q2 is off; 1 more with rx90 check"):
        without_spoilt(GAINS, [said(Severity.WRONG, joints=(0, 1)), said(Severity.WRONG, joints=(2,), name="delay")])


def test_a_refusal_names_two_rivals_at_most():
    rivals = ("a delay", "another order", "a clock")
    assert (
        refusal_of([replace(said(Severity.WRONG), rivals=rivals)])
        == "the zero of q2 is off (or a delay or another order)"
    )
