"""What an estimate lacks: faults that yielding joints take up, payloads that are not as stated, what is unexplained."""

import re
from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import PLAIN, all_joints, doubted, joint_by_joint, logs_of, problem_of
from known_logs import BRICK
from real_friction import Truth

from ident.diagnosis import estimate_evidence, terms
from ident.diagnosis.diagnosis import Severity, two_digits
from ident.diagnosis.estimate_evidence import (
    _unexplained,
    claimed,
    consequence,
    diagnosis_of,
    imitated,
    lacks_of,
    shown_beside,
    stated,
)
from ident.diagnosis.evidence import z_of
from ident.diagnosis.fitted_currents import reference
from ident.diagnosis.search import survey
from ident.diagnosis.terms import payload_errors
from ident.estimation.estimators.nls import all_joints_gains
from ident.estimation.joint_by_joint import joint_rows


@pytest.fixture(scope="module")
def logs(axes):
    return logs_of(Truth(), seed=2)


def yielding(problem):
    """An estimate whose joints yield, as if data had chosen so, beside the one whose joints do not."""
    soft, stiff = (all_joints_gains(problem, replace(PLAIN, compliance=each)) for each in (True, False))
    return replace(soft, solution=replace(soft.solution, stiff=stiff.solution)), stiff


def elastic(axes, logs):
    seen = doubted(axes, logs)
    return next(terms.elasticity(reference(seen.problem), seen))


def test_a_fault_that_yielding_joints_take_up_is_found_beside_joints_that_do_not_yield(axes, logs):
    sound = all_joints(problem_of(axes, logs))
    off = (0.0, -0.006, 0.011)
    problem = problem_of(axes, logs, (None, replace(BRICK, com=tuple(np.add(BRICK.com, off)))))
    estimate, stiff = yielding(problem)
    base = stated(problem, estimate)
    (centre, *_) = payload_errors(problem, estimate)
    (found,) = imitated(base, base.solution.stiff, (), [centre, elastic(axes, logs)])
    assert found.best.direction is centre
    np.testing.assert_allclose(found.best.z, z_of(stated(problem, stiff).each_added([centre])[0].u), rtol=1e-9)
    assert found.best.z > z_of(base.each_added([centre])[0].u) + 1.0
    for each in found.base.effects(found.base.stacked(centre.columns) @ found.best.found.value):
        now, before = (x.joints[each.joint] for x in (estimate, sound))
        error = 100.0 * (now.value / before.value - 1.0)  # of joint 2, a third of it is what yielding joints changed
        np.testing.assert_allclose(each.percent, error, rtol=0.1)
        np.testing.assert_allclose(each.deviations, 0.01 * each.percent / claimed(now), rtol=1e-9)


def test_what_the_model_lacks_refuses_a_gain_that_it_moves_beyond_the_limit_of_gains(axes):
    logs = logs_of(Truth(compliance=(1.2e-3, 0.9e-3, 1.1e-3)), seed=2)
    problem = problem_of(axes, logs)
    (lack,) = shown_beside(stated(problem, all_joints(problem)), [elastic(axes, logs)])
    moved = sorted(abs(each.percent) for each in diagnosis_of(lack, ("a", "b")).effects if each.spoils)
    for factor, severity in ((0.9, Severity.WRONG), (1.1, Severity.WEAK)):
        options = replace(problem.options, max_rel_std=factor * moved[-1] / 100.0)
        limited = replace(lack, base=replace(lack.base, problem=replace(problem, options=options)))
        assert diagnosis_of(limited, ("a", "b")).severity is severity
    assert len(moved) > 1
    assert moved[-1] > 1.3 * moved[0]


def test_what_is_unexplained_beside_a_term_that_the_model_lacks_refuses_no_gain(axes, monkeypatch):
    logs = logs_of(Truth(compliance=(1.2e-3, 0.9e-3, 1.1e-3)), seed=2)
    problem, seen = problem_of(axes, logs), doubted(axes, logs)
    strict = replace(problem, options=replace(problem.options, max_rel_std=1e-3))
    base = replace(stated(problem, all_joints(problem)), problem=strict)
    monkeypatch.setattr(estimate_evidence, "_leaves", lambda *_: True)
    found = list(lacks_of(base, [elastic(axes, logs)], seen.names, seen.model, stiff=None))
    assert [(each.name, each.severity) for each in found] == [
        (terms.ELASTICITY, Severity.WRONG),
        ("unexplained", Severity.WEAK),
    ]


@pytest.mark.parametrize(
    ("compliance", "off"), [(1.2e-3, (0.0, 0.0, 0.0)), (5e-4, (0.0, -0.0065, 0.0125))], ids=["explain it all", "a tie"]
)
def test_what_yielding_joints_explain_as_well_is_no_fault(axes, compliance, off):
    logs = logs_of(Truth(compliance=(compliance, 0.7 * compliance, compliance)), seed=2)
    problem = problem_of(axes, logs, (None, replace(BRICK, com=tuple(np.add(BRICK.com, off)))))
    estimate, stiff = yielding(problem)
    (centre, *_) = payload_errors(problem, estimate)
    assert [each.best.direction for each in shown_beside(stated(problem, stiff), [centre])] == [
        centre
    ]  # alone it is believed
    assert not list(imitated(stated(problem, estimate), estimate.solution.stiff, (), [centre, elastic(axes, logs)]))
    assert not list(imitated(stated(problem, stiff), None, (), [centre]))  # nothing was chosen that could imitate it


def test_softer_joints_than_their_first_order_describes_are_no_fault_where_the_estimate_yields_enough(axes):
    logs = logs_of(Truth(compliance=(4e-3, 2.8e-3, 3.6e-3)), seed=2)
    problem = problem_of(axes, logs, (None, replace(BRICK, com=tuple(np.add(BRICK.com, (0.0, -0.0065, 0.0125))))))
    estimate, stiff = yielding(problem)
    (centre, *_) = payload_errors(problem, estimate)
    assert not list(imitated(stated(problem, estimate), estimate.solution.stiff, (), [centre]))
    assert list(imitated(stated(problem, stiff), stiff.solution, (), [centre]))  # an estimate that does not yield


def test_a_payload_that_moves_in_its_mount_is_told_from_one_that_is_elsewhere(axes, logs):
    """Its centre moves evenly during the loaded motion; currents are linear in the payload's first moment."""
    moved = replace(BRICK, com=tuple(np.add(BRICK.com, (0.05, 0.05, -0.05))))
    late = logs_of(Truth(), seed=2, payloads=(None, moved))[1]
    share = np.linspace(0.0, 1.0, len(late.t))[:, None]
    creeping = [logs[0], replace(logs[1], v=(1.0 - share) * logs[1].v + share * late.v)]
    for pair, name in ((creeping, "payload shift"), ([logs[0], late], "payload centre")):
        problem = problem_of(axes, pair)
        base = stated(problem, all_joints(problem))
        lack = next(shown_beside(base, list(payload_errors(problem, base.estimate))))
        assert lack.best.family == name
        assert lack.best.what.logs == (1,)
        if name == "payload shift":
            size, std = lack.best.found.value[-3:], np.sqrt(np.diag(lack.best.found.covariance))[-3:]
            assert (np.abs(size - (0.05, 0.05, -0.05)) < 3.0 * std).all()
            assert (std[[0, 2]] < 0.005).all()  # the second axis is hardly moved by these joints
            told = [float(x) for x in re.findall(r"[+-]\d+(?:\.\d+)?", diagnosis_of(lack, ("a", "b")).cause)]
            np.testing.assert_allclose(told, 1e3 * size, rtol=0.05)  # two digits


def test_a_shift_in_one_of_two_loaded_logs_grows_there_alone(axes, logs):
    problem = problem_of(axes, [*logs, logs[1]], (None, BRICK, BRICK))
    estimate = all_joints(problem)
    shifts = [each for each in payload_errors(problem, estimate) if each.family == "payload shift"]
    assert [each.logs for each in shifts] == [(1,), (2,)]
    for each in shifts:
        for j, columns in enumerate(each.columns):
            rows, (mean, growth) = joint_rows(problem, j), np.hsplit(columns, 2)
            own = rows.motion == each.logs[0]
            assert not growth[~own].any()
            share = rows.position[own] / rows.position[own].max() - 0.5
            np.testing.assert_allclose(growth[own], share[:, None] * mean[own], rtol=1e-12)


TURNED = (-BRICK.com[0], BRICK.com[1], -BRICK.com[2])


@pytest.mark.parametrize(
    ("com", "name"), [(np.add(BRICK.com, (0.0, -0.007, 0.012)), "payload centre"), (TURNED, "payload")]
)
def test_a_payload_that_is_not_as_stated_moves_the_gains_by_what_its_mass_alone_gives(axes, logs, com, name):
    sound = all_joints(problem_of(axes, logs)).solution.inverse
    problem = problem_of(axes, logs, (None, replace(BRICK, com=tuple(com))))
    estimate = all_joints(problem)
    seen = survey(doubted(axes, logs))
    (said,) = lacks_of(stated(problem, estimate), seen.directions, ("a", "b"), seen.logs.model, all_joints, stiff=None)
    assert (said.name, said.severity) == (name, Severity.WRONG)
    assert said.z > 5.0
    assert said.sentence == f"{said.cause}{consequence(said.effects)}"
    moved = 100.0 * (sound / estimate.solution.inverse - 1.0)
    of = {each.joint: each.percent for each in said.effects}
    for j in (1, 2):
        assert abs(moved[j]) > 2.0
        np.testing.assert_allclose(of[j], moved[j], rtol=0.1)
    # The logs alone, whatever is stated, show nothing; and of a sound payload nothing is said.
    assert not list(
        lacks_of(
            stated(problem_of(axes, logs), all_joints(problem_of(axes, logs))),
            seen.directions,
            ("a", "b"),
            seen.logs.model,
            all_joints,
            stiff=None,
        )
    )


def test_what_nothing_describes_is_told_of_the_joint_of_which_most_is_left_and_beside_faults_spoils_every_gain(axes):
    logs = [logs_of(Truth())[0], logs_of(Truth(Fc=(11.0, 10.5, 5.0)))[1]]
    problem = problem_of(axes, logs)
    estimate = all_joints_gains(problem, replace(PLAIN, friction_per_motion=False))
    base, free = stated(problem, estimate), doubted(axes, logs).model
    (said,) = lacks_of(base, (), ("a", "b"), free, stiff=None)
    assert (said.name, said.severity, said.joints) == ("unexplained", Severity.WEAK, (1,))
    times = np.sqrt(base.by_joint.variance[1] / free.fits.score.variance[1])
    assert times > 1.5
    np.testing.assert_allclose(said.value, times, rtol=1e-9)
    assert f"the residual of joint 2 is {two_digits(times)} times as large" in said.sentence
    (beside,) = _unexplained(base, free, beside_faults=True)
    assert (beside.severity, beside.joints) == (Severity.WRONG, (0, 1, 2))
    score = replace(base.by_joint, squares=base.by_joint.squares / 1.03**2)  # what a log shows by its length alone
    (slight,) = _unexplained(base, replace(free, fits=replace(free.fits, score=score)), beside_faults=False)
    assert "is 3 % larger than in a fit" in slight.sentence
    assert not list(lacks_of(base, (), ("a", "b"), stiff=None))
    right = stated(problem, all_joints(problem))  # friction of each log its own
    assert not list(lacks_of(right, (), ("a", "b"), free, stiff=None))


def test_what_is_larger_than_the_first_order_holds_for_is_not_said_of_an_estimate(axes, logs):
    problem = problem_of(axes, logs, (None, replace(BRICK, com=tuple(np.add(BRICK.com, (0.0, -0.021, 0.033))))))
    base = stated(problem, joint_by_joint(problem))
    (centre, *_) = payload_errors(problem, base.estimate)
    size = np.abs(base.each_added([centre])[0].value).max()

    def said(largest: float) -> list[str]:
        term = replace(centre, family="spring", largest=largest)
        found = lacks_of(
            replace(base, problem=replace(problem, motions=problem.motions[:1])), [term], ["a", "b"], stiff=None
        )
        return [each.name for each in found]

    assert said(1.02 * size) == ["spring"]
    assert said(0.98 * size) == []
