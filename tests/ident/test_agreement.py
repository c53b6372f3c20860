"""Two motions of one arm agree about the arm, whatever is mounted; logs of different units or signs do not."""

from dataclasses import replace

import numpy as np
import pytest
from exact import EXACT, GAIN, exact_pair
from ident.agreement import MOST, SURE_F, Disagreement, agreed, disagreement, disagreement_notes, disagreements

from ident.estimate import IdentifiedGain, RefusedGain
from ident.estimators import ESTIMATORS
from ident.gain_system import joint_rows
from ident.observation import Observation
from ident.options import GainOptions
from ident.payload import Payload
from ident.problem import Problem, pair


def problem_of(structure, heavy, factors: dict[int, float], noise: float = 0.01, *, bare: bool = False) -> Problem:
    """A pair of motions in which one, the loaded one unless `bare`, logs some joints' currents times a factor."""
    motions = list(exact_pair(structure, heavy, GAIN, np.random.default_rng(11), noise=noise, rows=400))
    k = 0 if bare else 1
    motions[k] = scaled(motions[k], factors)
    return pair(*motions, heavy, GainOptions(max_rel_std=0.5))


def scaled(observation: Observation, factors: dict[int, float]) -> Observation:
    joints = tuple(replace(joint, V=factors.get(j, 1.0) * joint.V) for j, joint in enumerate(observation.joints))
    return replace(observation, joints=joints)


def estimate_of(problem: Problem, method: str = "ls-2011"):
    return ESTIMATORS[method].estimate(problem, ESTIMATORS[method].options())


def test_motions_of_one_arm_agree(structure, heavy):
    problem = problem_of(structure, heavy, {})
    estimate = estimate_of(problem)
    assert disagreements(problem, estimate) == ()
    assert agreed(estimate, ()).joints == estimate.joints


def test_what_is_explained_is_what_a_fit_of_each_motion_alone_explains_more(structure, heavy):
    problem = problem_of(structure, heavy, {2: 1.2})
    rows = joint_rows(problem, 2)
    found = disagreement(problem, rows)
    one = np.hstack((rows.W, rows.W_L[0]))
    two = np.hstack((one, rows.W * rows.loaded[:, None]))
    left, ranks = [], []
    for W in (one, two):
        unit = W / np.maximum(np.linalg.norm(W, axis=0), 1e-300)
        x, _, rank, _ = np.linalg.lstsq(unit, rows.V, rcond=1e-9)
        left.append(float(np.sum((rows.V - unit @ x) ** 2)))
        ranks.append(int(rank))
    more, added, freedom = left[0] - left[1], ranks[1] - ranks[0], len(rows.V) - ranks[1]
    # Differences of sums of squares, through normal columns: some six digits.
    np.testing.assert_allclose(found.share, np.sqrt(more) / np.linalg.norm(rows.V), rtol=1e-6)
    np.testing.assert_allclose(found.F, more / added / (left[1] / freedom), rtol=1e-6)


@pytest.mark.parametrize("bare", [False, True])
@pytest.mark.parametrize("factor", [-1.0, 1.5, 0.6])
def test_a_joint_whose_logs_differ_in_sign_or_unit_is_refused_and_no_other(structure, heavy, factor, bare):
    problem = problem_of(structure, heavy, {1: factor}, bare=bare)
    estimate = estimate_of(problem)
    assert isinstance(estimate.joints[1], IdentifiedGain)
    found = disagreements(problem, estimate)
    assert [each.joint for each in found] == [1]
    after = agreed(estimate, found)
    refused = after.joints[1]
    assert isinstance(refused, RefusedGain)
    assert refused.reason.startswith("the bare and the loaded motion disagree about the arm itself by ")
    assert [after.joints[j] == estimate.joints[j] for j in range(6)] == [True, False, True, True, True, True]
    assert disagreement_notes(found) == ()


def test_a_small_difference_is_said_and_the_gain_is_kept(structure, heavy):
    problem = problem_of(structure, heavy, {0: 1.06, 4: 1.06}, noise=0.001)
    estimate = estimate_of(problem)
    found = disagreements(problem, estimate)
    assert [each.joint for each in found] == [0, 4]
    assert all(each.share < MOST and each.F > SURE_F for each in found)
    assert agreed(estimate, found).joints == estimate.joints
    notes = disagreement_notes(found)
    assert [note[:8] for note in notes] == ["joint 1:", "joint 5:"]
    assert all(note.endswith("The deviations do not contain it") for note in notes)


def test_gains_that_rest_on_a_refused_joint_s_rows_are_refused_with_it(structure, heavy):
    motions = exact_pair(structure, heavy, GAIN, np.random.default_rng(11), noise=0.001, rows=400)
    light = Payload(mass=heavy.mass, known="mass")
    problem = pair(motions[0], scaled(motions[1], {2: 1.7}), light, GainOptions(max_rel_std=0.5))
    estimate = estimate_of(problem, "sequential-2011")
    assert estimate.identifiable[[0, 1, 2, 4]].all()
    after = agreed(estimate, [each for each in disagreements(problem, estimate) if each.joint == 2])
    assert list(after.identifiable[:3]) == [True, True, False]
    assert not after.identifiable[3:].any()  # their moments come from joints 1 to 3
    assert after.joints[4].reason.startswith("it rests on joint 3: the bare and the loaded motion disagree")


def test_a_friction_that_is_another_in_the_loaded_motion_is_a_disagreement(structure, heavy):
    bare, loaded = exact_pair(structure, heavy, GAIN, np.random.default_rng(11), rows=400)
    column = [structure.base.names[c] for c in loaded.joints[3].columns].index("Fc4")
    joints = list(loaded.joints)
    extra = 0.5 * np.sqrt(np.mean(joints[3].V ** 2)) * joints[3].W[:, column]
    joints[3] = replace(joints[3], V=joints[3].V + extra)
    problem = pair(bare, replace(loaded, joints=tuple(joints)), heavy, GainOptions())
    # Nothing else is wrong: all that the common fit leaves is explained, to rounding.
    assert disagreement(problem, joint_rows(problem, 3)).F > 1.0 / EXACT
    assert disagreement(problem, joint_rows(problem, 2)).share < EXACT


@pytest.mark.parametrize(
    ("share", "F", "sure"), [(0.011, 51.0, True), (0.009, 1e4, False), (0.3, 49.0, False), (0.009, 49.0, False)]
)
def test_a_difference_counts_if_it_is_no_accident_and_large_enough(share, F, sure):
    assert Disagreement(joint=2, share=share, F=F).sure is sure
