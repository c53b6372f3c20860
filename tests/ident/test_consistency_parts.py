"""Parts of the rows: identities against fits of these rows, and halves of motions."""

from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import PLAIN
from ident.consistency.evidence import Evidence
from ident.consistency.halves import check_halves
from ident.consistency.joints import check_joints
from ident.consistency.part import linear_fit, part_of
from linear_solutions import linear_solution

from ident.estimators.nls import all_joints_gains
from ident.problem import Motion, Problem

KEPT = {
    "first half": np.array([True, False, True, False]),
    "second half": np.array([False, True, False, True]),
    "joint 1": np.array([True, True, False, False]),
    "joint 2": np.array([False, False, True, True]),
}


@pytest.mark.parametrize("kept", KEPT.values(), ids=KEPT)
def test_a_part_of_the_rows_gives_what_a_fit_of_them_and_the_beliefs_gives(kept):
    solution, y, left_of, refit = linear_solution(np.random.default_rng(3))
    rows, fit = solution.rows, linear_fit(solution)
    group = 2 * rows.joint + (rows.position >= 18)  # of positions 3 to 32
    changes = part_of(fit, kept, [0, 1]).changes
    # Linear algebra in another order; the condition of the parts is below 1e2.
    np.testing.assert_allclose([changes[k].value for k in (0, 1)], refit(kept[group]) - solution.inverse, rtol=1e-9)
    nudge = np.random.default_rng(4).normal(size=len(y))
    moved = refit(kept[group], y + nudge) - refit(kept[group]) - solution.influence @ nudge
    np.testing.assert_allclose([changes[k].influence @ nudge for k in (0, 1)], moved, rtol=1e-9)
    own = kept[group]
    left = part_of(fit, kept, [0]).residual
    assert not left[~own].any()
    np.testing.assert_allclose(left[own], left_of(own)[own], rtol=1e-9, atol=1e-12)


def test_a_part_that_does_not_show_a_quantity_gives_none():
    solution, *_ = linear_solution(np.random.default_rng(3))
    rows = solution.rows
    # Without beliefs, two rows of joint 1 cannot show 1/g, which hangs on seven unknowns.
    Q = np.linalg.qr(np.random.default_rng(8).normal(size=(len(rows.V), 7)))[0]
    alone = replace(
        solution,
        rows=replace(rows, explained=Q, weight=np.ones(len(rows.V))),
        influence=np.random.default_rng(9).normal(size=(2, 7)) @ Q.T,
    )
    fit = linear_fit(replace(alone, rows=replace(alone.rows, joint=np.array([0, 0] + [1] * 118))))
    assert part_of(fit, np.array([True, True, False, False]), [0, 1]).changes == {}
    assert set(part_of(fit, np.array([False, False, True, True]), [1]).changes) == {1}


def test_an_estimate_that_is_no_least_squares_is_left_alone(clean):
    solution, *_ = linear_solution(np.random.default_rng(3))
    crooked = solution.influence + 1e-3 * np.random.default_rng(5).normal(size=solution.influence.shape)
    assert linear_fit(replace(solution, influence=crooked)) is None
    estimate = replace(
        clean.estimate, solution=replace(clean.estimate.solution, influence=clean.estimate.solution.influence**3)
    )
    other = Evidence(problem=clean.problem, estimate=estimate, drift=True)
    assert check_halves(other) is None
    assert check_joints(other) is None


def half_of(problem: Problem, which: int) -> Problem:
    """The problem of one half of every motion."""
    motions = []
    for motion in problem.motions:
        joints = []
        positions = [joint.position for joint in motion.observation.joints]
        for joint, at in zip(motion.observation.joints, positions, strict=True):
            low, high = min(p.min() for p in positions), max(p.max() for p in positions)
            kept = (2 * at > low + high) == bool(which)
            fields = ("V", "V_rate", "W", "W_L", "t", "position")
            joints.append(replace(joint, **{name: getattr(joint, name)[kept] for name in fields}))
        motions.append(Motion(replace(motion.observation, joints=tuple(joints)), motion.payload))
    return replace(problem, motions=tuple(motions))


def test_halves_are_what_a_search_on_each_half_gives(clean):
    halves = [all_joints_gains(half_of(clean.problem, which), PLAIN).solution.inverse for which in (0, 1)]
    finding = check_halves(clean)
    k = finding.joint
    fit, second = clean.fit, np.arange(6) % 2 == 1
    first_order = [part_of(fit, kept, [0, 1, 2]).changes for kept in (~second, second)]
    std = np.sqrt(np.diag(clean.estimate.covariance))
    for j in range(3):
        apart = first_order[1][j].value - first_order[0][j].value
        # A search weighs rows by the residual of the half alone, and the model is not linear.
        np.testing.assert_allclose(apart, halves[1][j] - halves[0][j], atol=0.3 * std[j])
    apart = first_order[1][k].value - first_order[0][k].value
    plain = first_order[1][k].influence - first_order[0][k].influence
    sigma = np.array([clean.estimate.solution.rows.sigma(j) for j in clean.estimate.solution.rows.joint])
    white = np.sqrt(np.sum((plain * sigma) ** 2))
    # The halves' own fits leave a little less than that of all rows; what lasts may make the deviation larger.
    assert 0.4 * abs(apart) / white < finding.statistic < 1.1 * abs(apart) / white
