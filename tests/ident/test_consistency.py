"""What an estimate says against itself: faults that are found, and silence."""

from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import LOOSE, evidence_of, joint_by_joint, logs_of, problem_of, with_current
from ident.consistency import CHECKS, UNCHECKED, findings
from ident.consistency.bare import bare_drifts, check_bare
from ident.consistency.curves import check_position, check_speed, residual_curve
from ident.consistency.halves import check_halves
from ident.consistency.joints import check_joints
from ident.consistency.whiteness import check_whiteness, neighbours
from known_logs import BRICK
from real_friction import GAIN, Truth, real_logs

from ident.all_joints.friction import Term
from ident.all_joints.solution import fit_with, setting
from ident.rows import Rows

# Silence


@pytest.mark.parametrize("check", CHECKS.values(), ids=CHECKS)
def test_clean_recordings_give_no_word(check, chosen):
    finding = check(chosen)
    assert finding is None or not finding.failed, finding


def test_tests_that_are_not_asked_for_are_not_made(clean):
    assert findings(clean, UNCHECKED) == ()
    made = [each.check for each in findings(clean)]
    assert made == [name for name in CHECKS if name != "bare"]  # there is but one bare motion


def test_a_method_that_solves_each_joint_alone_has_no_joints_to_compare(clean):
    assert check_joints(joint_by_joint(clean.problem)) is None


# Faults


@pytest.mark.parametrize(("factor", "word"), [(1.03, "smaller"), (0.97, "larger")])
def test_a_current_that_grows_in_the_second_half_of_the_motions_is_a_smaller_gain_there(axes, factor, word):
    logs = [with_current(log, 1, lambda v, t, q, dq: np.where(t > 0.5, factor * v, v)) for log in logs_of(Truth())]
    finding = check_halves(evidence_of(problem_of(axes, logs)))
    assert finding.failed
    assert finding.joint == 1
    assert finding.statistic > finding.threshold
    change = float(finding.sentence.split("a gain ")[1].split(" %")[0])
    assert f"% {word} than the first" in finding.sentence
    np.testing.assert_allclose(change, 3.0, atol=1.0)  # other joints' halves pull at the gain


def test_a_joint_whose_payload_torque_is_wrong_says_something_else_than_all_joints(axes):
    wrong = replace(BRICK, com=(0.07, -0.05, 0.03), com_std=(0.001,) * 3)
    finding = check_joints(evidence_of(problem_of(axes, logs_of(Truth()), (None, wrong))))
    assert finding.failed
    assert "its own currents alone give a gain" in finding.sentence
    known = replace(wrong, com_std=(0.1,) * 3)  # stated to be that uncertain, it is no contradiction
    assert not check_joints(evidence_of(problem_of(axes, logs_of(Truth()), (None, known)))).failed


def test_friction_that_changes_between_bare_motions_is_named_with_its_size(axes):
    before, after = Truth(), replace(Truth(), Fc=(11.0, 9.0, 5.0), off=(1.0, -2.0, 1.3))
    payloads = (None, BRICK, None)
    logs = [*logs_of(before), *real_logs(after, (None,), np.random.default_rng(9))]
    problem = problem_of(axes, logs, payloads)
    finding = check_bare(evidence_of(problem))
    assert finding.failed
    said = {(each.joint, each.what): each for j in range(3) for each in bare_drifts(problem, j, [0, 2], drift=True)}
    coulomb, offset = said[1, "Coulomb friction changed"], said[2, "the offset changed"]
    assert coulomb.z < -finding.threshold  # of a drive wired backwards the currents are turned
    assert offset.z > finding.threshold
    rms = [
        np.sqrt(np.mean(np.concatenate([problem.motions[m].observation.joints[j].V for m in (0, 2)]) ** 2))
        for j in (1, 2)
    ]
    # Five deviations; sign(dq) is cleared of reversals and its rms in a row a little below 1.
    np.testing.assert_allclose(coulomb.share, 1.0 / GAIN[1] / rms[0], rtol=0.05 + 5.0 / abs(coulomb.z))
    np.testing.assert_allclose(offset.share, 0.6 / GAIN[2] / rms[1], rtol=0.05 + 5.0 / abs(offset.z))
    assert coulomb.harmless
    assert not offset.harmless
    assert "joint 2: Coulomb friction" in finding.sentence
    assert "in motion 3" in finding.sentence
    assert finding.sentence.endswith("warm the drives up before recording")
    unchanged = problem_of(axes, [*logs_of(before), *real_logs(before, (None,), np.random.default_rng(9))], payloads)
    assert not check_bare(evidence_of(unchanged)).failed


def test_a_bare_motion_with_more_left_of_it_is_named(axes):
    logs = [*logs_of(Truth()), *real_logs(Truth(), (None,), np.random.default_rng(9), noise=0.02)]
    finding = check_bare(evidence_of(problem_of(axes, logs, (None, BRICK, None))))
    assert finding.failed
    assert "what the model leaves changed by +" in finding.sentence


def test_a_current_that_follows_the_position_is_found_on_its_joint(axes):
    logs = [
        with_current(log, 2, lambda v, t, q, dq: v + 0.03 * np.std(v) * np.sin(5.0 * q)) for log in logs_of(Truth())
    ]
    evidence = evidence_of(problem_of(axes, logs))
    finding = check_position(evidence)
    assert finding.failed
    assert finding.joint == 2
    assert "depends on the joint's own position: joint 3" in finding.sentence


def test_friction_of_another_shape_is_found_on_its_joint(axes):
    def stribeck(v, t, q, dq):
        return v + 0.15 * np.std(v) * np.sign(dq) * np.exp(-((dq / (0.3 * np.std(dq))) ** 2))

    finding = check_speed(evidence_of(problem_of(axes, [with_current(log, 2, stribeck) for log in logs_of(Truth())])))
    assert finding.failed
    assert finding.joint == 2
    assert "depends on the joint's own speed: joint 3" in finding.sentence


def test_a_curve_moves_the_gain_by_what_a_fit_with_its_columns_gives(clean):
    def columns(q, dq):
        return np.column_stack((np.sin(2.0 * q), np.cos(3.0 * q)))

    curve, joint = residual_curve(clean, 1, columns), 1
    ready = setting(clean.problem, per_motion=True, prior_std=1.0)
    rows = clean.estimate.solution.rows
    own = rows.of(joint)
    added = columns(*clean.states(joint))
    terms = [{} for _ in range(3)]
    terms[joint] = {"first": Term(added[:, 0]), "second": Term(added[:, 1])}
    fitted = fit_with(ready, terms, (), fit_with(ready, [{} for _ in range(3)], (), None)).fit
    moved = clean.estimate.solution.inverse[joint] / fitted.found.h[joint] - 1.0
    # First order, and weights from another residual.
    np.testing.assert_allclose(curve.moved, moved, rtol=0.1, atol=1e-5)
    left = [np.sum((rows.weight * each)[own] ** 2) for each in (rows.residual, fitted.rows.residual)]
    np.testing.assert_allclose(curve.share, 1.0 - left[1] / left[0], rtol=0.15, atol=1e-3)


def test_residuals_that_last_are_told_where_they_matter(axes):
    rng = np.random.default_rng(6)

    def lasting(v, t, q, dq):
        noise = np.convolve(rng.normal(size=len(v) + 160), np.ones(160) / 160.0**0.5, "valid")[: len(v)]
        return v + 0.04 * np.std(v) * noise

    logs = [with_current(log, 1, lasting) for log in logs_of(Truth())]
    evidence = evidence_of(problem_of(axes, logs))
    finding = check_whiteness(evidence)
    assert finding.failed
    assert finding.joint == 1
    assert "allows for them" in finding.sentence
    plain = replace(evidence.problem, options=replace(LOOSE, uncertainty="classical"))
    unaware = check_whiteness(evidence_of(plain))
    assert unaware.failed
    assert "larger than the one claimed" in unaware.sentence


def test_the_correlation_of_neighbours_is_that_of_rows_that_follow_each_other():
    left = np.array([1.0, 2.0, -3.0, 5.0, 7.0, -2.0])
    rows = Rows(
        V=left, residual=left, joint=np.array([0, 0, 0, 0, 0, 1]), motion=np.array([0, 0, 0, 1, 1, 1]),
        position=np.array([4, 5, 7, 0, 1, 2]), row_period=0.05, unknowns={0: 1, 1: 0}, weight=np.ones(6),
        explained=np.zeros((6, 0)),
    )  # fmt: skip
    # Pairs (1, 2) and (5, 7); -3 follows after a gap, 5 begins a motion.
    np.testing.assert_allclose(neighbours(rows, 0), 37.0 / np.sqrt(26.0 * 53.0), rtol=1e-12)
