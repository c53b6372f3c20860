"""How a diagnosis is to be taken: whether it is so, and whether it matters."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from consistency_logs import all_joints, changed, doubted, joint_by_joint, late, logs_of, named
from estimates import gain_estimate
from known_logs import BRICK
from once import computed_once
from real_friction import Truth

from ident.diagnosis.column_faults import couplings, scaled
from ident.diagnosis.diagnose import _effects, _Known, diagnose
from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Effect, Severity, worst_first
from ident.diagnosis.effects import (
    HeldOutEstimate,
    between,
    consequence,
    diagnosis_of,
    of_currents,
    of_ratios,
    severity_of,
)
from ident.diagnosis.evidence import each_added
from ident.diagnosis.hypothesis import Logs
from ident.diagnosis.lacks import beyond_prior
from ident.diagnosis.models import reference_fit
from ident.diagnosis.screening import Screened
from ident.diagnosis.search import (
    Exact,
    Fault,
    FirstOrder,
    added,
    compared,
    faults,
    select_hypothesis,
    survey,
)
from ident.estimation.estimate import GainEstimate
from ident.estimation.intervals import Basis, max_of_classical_and_jackknife
from ident.estimation.problem import Problem
from ident.identification import refused_for_faults, spoilt_joints, without_spoilt
from ident.support.errors import Contradiction, NotIdentifiable


def effect(joint: int, percent: float, deviations: float | None) -> Effect:
    return Effect(joint=joint, percent=percent, deviations=deviations)


def test_severity_follows_from_the_largest_effect():
    for effects, expected in (
        ([(0, 7.0, 0.4), (1, -0.2, -0.49)], Severity.GOOD),
        ([(0, 0.1, 0.4), (1, -0.2, -0.51)], Severity.WEAK),
        ([(0, 0.1, 2.9)], Severity.WEAK),
        ([(0, 0.1, 0.1), (3, 0.2, -3.1)], Severity.WRONG),
        ([(0, 0.9, None)], Severity.WEAK),  # without gains nobody knows that it does not matter
        ([(0, -1.1, None)], Severity.WRONG),
        ([], Severity.WEAK),
    ):
        assert severity_of([effect(*each) for each in effects]) is expected


def test_gains_that_others_contradict_are_off_by_their_ratio():
    now = gain_estimate(2.6, None, 1.7, 1.3, std=0.02, reason="no load")
    right = gain_estimate(2.0, 3.0, 1.7, None, std=0.02, reason="no load")
    found = {each.joint: each for each in between(now, right)}
    # a gain that ought to be refused is no result, nor is a refusal of one that ought to be found
    np.testing.assert_allclose([found[j].percent for j in range(4)], [30.0, 1000.0, 0.0, 1000.0], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found[0].deviations, 0.3 / (now.joints[0].std / 2.6), rtol=1e-9)


def test_an_effect_is_held_against_the_surer_of_both_claims_and_none_that_no_weight_allows():
    def exact(gain: float, rel_std: float) -> GainEstimate:
        (joint,) = (found := gain_estimate(gain, std=gain * rel_std, reason="")).joints
        return replace(found, joints=(replace(joint, payload_rel_std=0.0, model_rel_std=0.0),))

    for mine, theirs, claim in ((0.7, 0.11, 0.11), (0.11, 0.7, 0.11), (1e-9, 1e-9, 1e-3)):
        (found,) = between(exact(2.5025, mine), exact(2.5, theirs))
        np.testing.assert_allclose(found.deviations, 1e-3 / claim, rtol=1e-9)


def test_a_gross_fault_spoils_a_gain_however_much_it_inflates_the_claim(behind, sound):
    # Currents 24 ms late in one log move gain 1 by a tenth, by as much as `ls-2011` then claims of it.
    right, estimate = joint_by_joint(sound.problem).joints[0], joint_by_joint(behind.problem)
    now, found = estimate.joints[0], named(diagnose(behind, estimate, joint_by_joint).diagnoses, "delay")
    assert found.severity is Severity.WRONG
    assert "; gains from these logs are off: joint 1 +" in found.sentence
    moved = {each.joint: each for each in found.effects}[0]
    share = now.value / right.value - 1.0
    np.testing.assert_allclose(moved.percent, 100.0 * share, rtol=0.3)  # the delay found is not quite that put in
    np.testing.assert_allclose(moved.deviations, moved.percent / 100.0 / (right.std / right.value), rtol=0.3)
    assert now.std / now.value > 5.0 * right.std / right.value
    assert share < 3.0 * now.predicted_rel_std


def without_influence(estimate: GainEstimate) -> GainEstimate:
    """The same gains from a method that is not least squares."""
    rows = estimate.solution.rows
    opaque = replace(rows, explained=Basis.of(np.zeros((len(rows.V), 0))))
    return replace(estimate, solution=replace(estimate.solution, rows=opaque))


def refused(problem: Problem) -> GainEstimate:
    raise NotIdentifiable("too little load")


@pytest.mark.parametrize("factor", [1.3, 1.0])
def test_a_fault_that_the_estimate_does_not_bear_out_is_chance_unless_it_cannot_test_it(axes, monkeypatch, factor):
    bare, heavy = logs_of(Truth())
    logs = doubted(axes, [bare, changed(heavy, v=factor * heavy.v)])
    certain = replace(compared(logs, scaled(logs, (1,), (), 1.3)), u=np.linspace(0.9, 1.1, 40))
    monkeypatch.setattr("ident.diagnosis.search._in_full", lambda seen, _: [certain] if seen.logs is logs else [])
    now = all_joints(logs.problem)
    with computed_once():
        said = diagnose(logs, now, all_joints)
        assert [each.name for each in said.diagnoses] == (["current scale"] if factor == 1.3 else [])
        assert bool(said.excluded) == (factor == 1.0)
        opaque = lambda problem: without_influence(all_joints(problem))  # noqa: E731
        every = ((now, None), (now, refused), (now, opaque), (without_influence(now), all_joints))
        for known in every if factor == 1.0 else ():
            assert "current scale" in {each.name for each in diagnose(logs, *known).diagnoses}


def test_of_a_fault_and_its_rivals_the_effect_of_most_deviations_counts_whatever_its_sign():
    found, rival = (Exact(None, np.ones(40), None, None) for _ in range(2))
    told = {found: [effect(0, 4.0, 1.3), effect(2, -7.0, -2.9)], rival: [effect(0, -5.0, -1.7), effect(2, 6.0, 2.1)]}
    known = SimpleNamespace(effects=told.get)
    assert _effects(Fault(None, found, (rival,)), SimpleNamespace(), known) == (told[rival][0], told[found][1])


def test_ratios_of_gains_are_those_to_the_gain_that_the_others_are_surest_beside(sound_survey):
    fit = sound_survey.fit
    zero = next(each for each in sound_survey.directions if each.key == ("zero", (1,), (0, 1)))
    (small,) = added([zero], each_added(sound_survey.logs.fits, [zero.columns]))
    fitted = reference_fit(fit.problem)
    rows, influence = fitted.rows, fitted.log_h.influence
    C = max_of_classical_and_jackknife(rows, influence)
    moved = influence @ np.concatenate([each @ small.value for each in zero.columns])
    ratios = np.eye(3)[:, None] - np.eye(3)  # (3, 3, 3), of the logarithms of two gains
    std = np.sqrt(np.einsum("abj,jk,abk->ab", ratios, C, ratios))
    found = {each.joint: each for each in of_ratios(fit, small)}
    (beside,) = {0, 1, 2} - set(found)
    assert np.median(std[beside]) == pytest.approx(np.median(std, axis=1).min())
    for j, each in found.items():
        np.testing.assert_allclose(each.percent, 100.0 * (moved[j] - moved[beside]), rtol=1e-9)
        np.testing.assert_allclose(each.deviations, (moved[j] - moved[beside]) / std[beside, j], rtol=1e-9)


def test_what_other_columns_explain_of_a_current_is_told_of_the_column_as_it_was_logged():
    def fits(*variance: float) -> SimpleNamespace:
        score = SimpleNamespace(variance=np.array(variance))
        rows = [SimpleNamespace(V=np.array([6.0, -8.0]) * (k + 1.0)) for k in range(3)]  # rms of 7.07 times 1 to 3
        return SimpleNamespace(rows=rows, fits=SimpleNamespace(score=score))

    hypothesis = SimpleNamespace(logs=[SimpleNamespace(v_order=np.array(each)) for each in ([0, 1, 2], [2, 0, 1])])
    found = SimpleNamespace(alternative=SimpleNamespace(hypothesis=hypothesis, logs=(1,)), read=fits(0.4, 1.7, 9.0))
    shares = {each.joint: each.percent for each in of_currents(fits(13.0, 7.0, 31.0), found)}
    # Joint 1 was read from the third column, joint 2 from the first, joint 3 from the second, of which less is left.
    assert list(shares) == [2, 0, 1]
    np.testing.assert_allclose(shares[2], 100.0 * np.sqrt(30.6 / 450.0), rtol=1e-12)
    np.testing.assert_allclose(shares[0], 100.0 * np.sqrt(11.3 / 50.0), rtol=1e-12)
    assert shares[1] == 0.0


def test_what_is_stated_is_contradicted_from_five_deviations_of_both_together():
    given, found = SimpleNamespace(prior_std=np.array([0.03, 0.2])), np.diag([0.0016, 0.3])
    for deviations, beyond in ((-4.9, False), (5.1, True)):
        value = np.array([deviations * 0.05, 0.0])  # of 0.03 stated and 0.04 found
        assert beyond_prior(FirstOrder(given, np.ones(40), value, found)) is beyond


def test_the_consequence_is_told_of_the_gains_that_matter():
    assert consequence([]) == ""
    assert consequence([effect(0, 4.0, 0.3)]) == "; no gain changes noticeably"
    said = consequence([effect(0, 4.04, 1.3), effect(1, -0.2, -0.1), effect(4, -11.0, -7.0)])
    assert said == "; gains from these logs are off: joint 1 +4 %, joint 5 -11 %"
    said = consequence([effect(0, 4.0, 1.3), effect(2, -1000.0, -9.0)])
    assert said == "; the gain of joint 3 from these logs is invalid"
    assert consequence([effect(2, -14.2, -9.0)], "ratios of gains") == "; ratios of gains are off: joint 3 -14 %"
    assert "7.3 % of joint 2's current" in consequence([effect(0, 4.0, None), effect(1, 7.31, None)])


def said(severity: Severity, **more) -> Diagnosis:
    return Diagnosis(**({"name": "zero", "severity": severity, "sentence": "the zero of q2 is off"} | more))


def test_the_worst_stands_first_and_is_that_of_all_and_the_worst_effect_is_the_one_of_most_deviations():
    found = [said(Severity.GOOD), said(Severity.WRONG), said(Severity.WEAK), said(Severity.WRONG, name="delay")]
    assert [(each.severity, each.name) for each in worst_first(found)] == [
        (Severity.WRONG, "zero"), (Severity.WRONG, "delay"), (Severity.WEAK, "zero"), (Severity.GOOD, "zero"),
    ]  # fmt: skip
    assert Diagnosed(diagnoses=tuple(found)).severity is Severity.WRONG
    assert Diagnosed().severity is Severity.GOOD
    assert len(Diagnosed(diagnoses=tuple(found)).findings) == 3
    effects = (effect(0, 40.0, 0.7), effect(1, -3.0, -2.2), effect(2, 1.0, 0.1))
    assert said(Severity.WEAK, effects=effects).worst.joint == 1
    assert said(Severity.WEAK, effects=(effect(0, 0.4, None), effect(1, -3.0, None))).worst.joint == 1


def test_gains_that_something_wrong_spoils_are_refused_for_the_worst_fault_and_the_others_are_kept():
    effects = (effect(0, -138.2, -90.0), effect(1, 6.04, 4.0))
    words = f"v1 is negated{consequence(effects)}"
    worst_one = said(Severity.WRONG, sentence=words, effects=effects, cause="v1 is negated")
    other = said(Severity.WRONG, effects=(effect(1, 2.0, 3.5), effect(2, 1000.0, 100.0), effect(3, 1.0, 2.9)))
    found = gain_estimate(2.6, 1.7, None, 1.3, std=0.02, reason="no load")
    kept = without_spoilt(found, [said(Severity.WEAK, joints=(3,)), worst_one, other]).joints
    assert [each.reason for each in kept[:3]] == [
        "the gain is off by -138 %: v1 is negated",
        "the gain is off by +6 %: v1 is negated",
        "the gain is invalid: the zero of q2 is off",  # refused by itself as well, for what the fault makes of it
    ]
    assert kept[3] == found.joints[3]
    assert kept[0].predicted_rel_std == found.joints[0].predicted_rel_std
    less = replace(other, effects=(effect(0, -1000.0, -100.0),))
    assert without_spoilt(found, [less]).joints[0].reason == "the gain is invalid: the zero of q2 is off"
    named_alone = without_spoilt(found, [said(Severity.WRONG, joints=(2,))]).joints
    assert named_alone[2].reason == "no load"
    assert refused_for_faults([worst_one, other, said(Severity.WEAK, joints=(3,))]) == (0, 1, 2)


def test_something_wrong_without_effects_spoils_the_joints_that_it_names_and_where_none_is_left_all_is_refused():
    assert spoilt_joints(said(Severity.WRONG, joints=(2,))) == (2,)
    assert spoilt_joints(said(Severity.WRONG, joints=(2,), effects=(effect(0, 9.0, 3.1), effect(1, 2.0, 0.7)))) == (0,)
    # misread logs: all gains, though none is off by much
    assert spoilt_joints(said(Severity.WRONG, joints=(2,), effects=(effect(0, 2.0, 0.7), effect(1, 1.0, 0.3)))) == (
        0,
        1,
    )
    gains = gain_estimate(2.6, 1.7, 1.3, std=0.02, reason="no load")
    assert without_spoilt(gains, [said(Severity.WEAK, joints=(0, 1, 2))]).joints == gains.joints
    wrong = [said(Severity.WRONG, joints=(0, 1)), said(Severity.WRONG, joints=(2,), name="delay")]
    for times, more in ((1, "1 more$"), (2, "3 more: logs of another robot\\?$")):
        with pytest.raises(Contradiction, match=f"the zero of q2 is off; rx90 check lists {more}"):
            without_spoilt(gains, wrong * times)


def test_a_fault_without_a_size_is_wrong_however_little_it_changes(sound_survey):
    logs = sound_survey.logs
    small = [Effect(joint=0, percent=0.8, deviations=0.7)]
    for alternative, severity in (
        (next(iter(couplings(logs))), Severity.WRONG),
        (scaled(logs, (1,), (), 1.01), Severity.WEAK),
    ):
        found = diagnosis_of(Exact(alternative, np.ones(3), logs, logs.fits.score), (), logs.names, small)
        assert found.severity is severity


def test_the_next_best_fault_is_taken_where_the_estimate_contradicts_the_best(sound_survey, monkeypatch):
    logs = sound_survey.logs
    best, next_best = (
        replace(compared(logs, scaled(logs, (1,), joints, factor)), u=np.linspace(0.9, 1.1, 40) * gain)
        for joints, factor, gain in (((), 1.3, 3.0), ((2,), 1.2, 1.0))
    )
    monkeypatch.setattr("ident.diagnosis.search._in_full", lambda seen, _: [next_best, best] * (seen is sound_survey))
    assert next(faults(sound_survey)).best is best
    assert next(faults(sound_survey, lambda each: each is not best)).best is next_best
    assert not any(isinstance(each.best, Exact) for each in faults(sound_survey, lambda _: False))


def test_a_fault_that_changes_no_gain_noticeably_is_left_to_what_the_estimate_lacks(behind):
    seen, estimate = survey(behind), all_joints(behind.problem)
    best = next(faults(seen)).best.alternative
    small, *others = sorted(
        (each for each in seen.small if not each.alternative.term), key=lambda each: each.alternative.key != best.key
    )
    small = replace(small, value=np.array([best.value]) / small.alternative.scale)

    def left(of_small, gross=()) -> list[object]:
        fresh = replace(seen, small=of_small, gross=gross, exact={})
        return [each.best.alternative.key for each in faults(fresh, harmless=lambda each: each is small)]

    for gross in ((), (Screened(best, 40.0),)):
        assert best.key not in left((small,), gross)
    assert left((small, replace(others[0], u=small.u)))[0] == best.key
    known = _Known(HeldOutEstimate(behind.problem, estimate))
    assert not known.harmless(small)
    smaller = replace(small, value=0.01 * small.value)
    assert known.harmless(smaller)
    assert not known.harmless(replace(smaller, alternative=replace(small.alternative, largest=0.0)))
    assert not _Known(HeldOutEstimate(behind.problem, without_influence(estimate))).harmless(smaller)


@pytest.fixture(scope="module")
def behind(axes) -> Logs:
    """Logs of which one has late currents."""
    bare, heavy = logs_of(Truth())
    return doubted(axes, [bare, late(heavy, 3)])


def test_beside_a_fault_that_is_read_in_a_payload_that_is_not_as_stated_is_told(axes):
    turned = replace(BRICK, com=(-BRICK.com[0], BRICK.com[1], -BRICK.com[2]))
    logs = doubted(axes, [late(each, 3) for each in logs_of(Truth())], (None, turned))
    told = {each.name: each for each in diagnose(logs, all_joints(logs.problem), all_joints).diagnoses}
    assert set(told) == {"delay", "payload"}
    assert (told["payload"].severity, told["payload"].logs) == (Severity.WRONG, ("loaded",))


def test_joints_that_the_logs_show_to_yield_are_not_doubted_beside_stiff_ones(axes, sound, monkeypatch):
    seen, yielding = [], doubted(axes, logs_of(Truth(compliance=(2e-3, 1.4e-3, 2e-3))))
    monkeypatch.setattr("ident.diagnosis.diagnose.lacks_of", lambda *_, stiff: seen.append(stiff) or [])
    for logs in (sound, yielding):
        estimate = all_joints(logs.problem)
        diagnose(logs, replace(estimate, solution=replace(estimate.solution, stiff=estimate.solution)))
    assert [each is None for each in seen] == [False, True]


def test_a_current_that_friction_shows_to_be_negated_is_wrong_with_what_that_does_to_the_gains(
    sound, sound_estimate, monkeypatch
):
    monkeypatch.setattr("ident.diagnosis.diagnose.opposed", lambda problem, joints: [(2, 1)])
    found = named(diagnose(sound, sound_estimate, all_joints).diagnoses, "current sign")
    assert (found.severity, found.joints, found.logs, found.z) == (Severity.WRONG, (2,), ("loaded",), None)
    assert found.sentence.startswith("v3 is negated in loaded alone")
    assert {each.joint: each.spoils for each in found.effects}[2]


def shown(family: str, parameters: int, gain: float, logs: tuple[int, ...] = (0, 1), wave: float = 1.0):
    """An alternative whose gain differs between blocks by a wave: of two with one wave the difference is sure."""
    u = gain / 40.0 + wave * np.linspace(-1.0, 1.0, 40)
    own = SimpleNamespace(family=family, parameters=parameters, key=(family, (), logs))
    return SimpleNamespace(alternative=own, gain=gain, u=u)


def test_of_alternatives_that_predict_as_well_rare_ones_come_last():
    lengths, delay = shown("lengths", 1, 91.0), shown("delay", 1, 85.0, wave=-1.0)
    zero, base = shown("zero", 1, 87.0, wave=2.0), shown("base", 2, 88.0, wave=-2.0)
    assert select_hypothesis([delay, lengths]) == (delay, (lengths,))
    assert select_hypothesis([lengths]) == (lengths, ())
    assert select_hypothesis([lengths, shown("delay", 1, 85.0)]) == (lengths, ())  # a sure difference is no tie
    assert select_hypothesis([zero, base, delay]) == (base, (zero, delay))  # of other families what predicts best


def test_more_sizes_are_believed_where_they_predict_surely_better_than_one_and_are_no_rival_of_it():
    one, more = shown("delay", 1, 85.0, (1,), wave=0.0), shown("delay", 6, 103.0, (1,))
    assert select_hypothesis([one, more]) == (one, ())  # 3.79 is a standard error
    more = shown("delay", 6, 105.0, (1,))
    for others in ([one], [], [shown("delay", 1, 85.0, (0,), wave=0.0)]):  # the last is of another log
        assert select_hypothesis([*others, more]) == (more, ())
    one, of_others = shown("delay", 1, 85.0, (1,)), shown("delay", 1, 83.0, wave=3.0)
    more = shown("delay", 6, 84.0, (1,), -1.0)
    assert select_hypothesis([one, more, of_others]) == (one, (of_others,))
