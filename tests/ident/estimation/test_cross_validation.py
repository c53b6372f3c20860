"""Parts of motions predicted from the others, beside fits that are really made without them."""

from dataclasses import replace

import numpy as np
import pytest
from exact import GAIN, TRUSTING, exact_problem, lopsided, values

from ident.estimation.cross_validation import cross_validated
from ident.estimation.estimators import ls_2011
from ident.estimation.problem import ObservedMotion, Problem


@pytest.fixture
def problem(structure, payload, rng) -> Problem:
    heavy, chi = lopsided(payload), rng.uniform(0.5, 2.0, 84)
    motions = [(chi, None, None), (chi, heavy, heavy)]
    return exact_problem(structure, motions, GAIN, rng, noise=0.03, rows=200, options=TRUSTING)


def without(problem: Problem, motion: int, first: int, last: int) -> Problem:
    """The problem without some rows of one motion."""
    motions = list(problem.motions)
    joints = tuple(
        replace(
            each,
            **{
                name: np.delete(getattr(each, name), slice(first, last), 0) for name in ("V", "W", "W_L", "t", "weight")
            },
            position=np.delete(each.position, slice(first, last)),
        )
        for each in motions[motion].observation.joints
    )
    motions[motion] = ObservedMotion(replace(motions[motion].observation, joints=joints), motions[motion].payload)
    return replace(problem, motions=tuple(motions))


def gains(problem: Problem):
    return ls_2011.joint_by_joint_gains(problem, ls_2011.JointByJointOptions())


def test_gains_change_as_in_a_fit_without_the_part(problem):
    estimate = gains(problem)
    found = cross_validated(estimate, 4)
    changes = np.array([each.gain_change for each in found])  # (joints, parts)
    assert changes.shape == (6, 8)
    for part in range(8):
        motion, k = divmod(part, 4)
        fresh = values(gains(without(problem, motion, 50 * k, 50 * (k + 1))))
        inverse = values(estimate) / fresh - 1.0  # relative change of 1/g, which is linear in the rows
        np.testing.assert_allclose(changes[:, part], -inverse, rtol=1e-6, atol=1e-10)


def test_the_error_is_that_of_a_prediction_from_the_other_parts(problem):
    estimate = gains(problem)
    found = cross_validated(estimate, 4)
    rows = estimate.solution.rows
    assert [each.joint for each in found] == list(range(6))
    for each in found:
        own = rows.of(each.joint)
        fitted = np.linalg.norm(rows.residual[own]) / np.linalg.norm(rows.V[own])
        np.testing.assert_allclose(each.fitted, fitted, rtol=1e-12)  # two sums of some 400 squares
        # Noise of 3 % of rms; 50 of 400 rows left out of some 40 unknowns' fit make it some 10 % worse, never better.
        assert each.fitted < each.share < 1.5 * each.fitted
        np.testing.assert_allclose(each.share, 0.03, rtol=0.35)


def test_a_refused_joint_has_no_change_of_gain(structure, payload, rng):
    chi = rng.uniform(0.5, 2.0, 84)
    problem = exact_problem(structure, [(chi, None, None), (chi, payload, payload)], GAIN, rng, noise=0.03)
    estimate = gains(replace(problem, options=replace(TRUSTING, max_rel_std=0.02)))
    assert not estimate.identifiable.all()
    for each in cross_validated(estimate):
        assert len(each.gain_change) == (10 if estimate.identifiable[each.joint] else 0)
