"""What consistency tests compute: sums over stretches, differences, curves, hidden effects; each written out again."""

from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import evidence_of, logs_of, problem_of
from ident.consistency import bare, joints
from ident.consistency.curves import residual_curve
from ident.consistency.difference import difference_std, judged_difference
from ident.consistency.hidden import hidden_effect
from ident.consistency.part import part_of
from ident.consistency.stretches import stretches
from known_logs import BRICK
from linear_solutions import MadeUp, linear_evidence, linear_solution
from real_friction import Truth
from scipy import stats

from ident.rows import Rows


@pytest.fixture
def evidence() -> MadeUp:
    return linear_evidence(linear_solution(np.random.default_rng(3))[0], np.random.default_rng(5))


def sigma_of(evidence: MadeUp, residual: np.ndarray) -> np.ndarray:
    """Deviation of the residual of each row's joint; 60 rows of each, 3 and 4 unknowns."""
    return np.repeat([np.linalg.norm(residual[:60]) / np.sqrt(57.0), np.linalg.norm(residual[60:]) / np.sqrt(56.0)], 60)


def squared_sums(rows: Rows, terms: np.ndarray) -> float:
    """Squares of the sums over twenty stretches of either motion, whose positions are 3 to 32."""
    sums: dict[tuple[int, int], np.ndarray] = {}
    for motion, position, term in zip(rows.motion, rows.position, terms, strict=True):
        at = int(motion), 2 * (int(position) - 3) // 3
        sums[at] = sums.get(at, 0.0) + term
    assert len(sums) == 2 * 20
    return float(sum(np.sum(each**2) for each in sums.values()))


def test_stretches_are_twentieths_of_each_motion_from_its_first_row_to_its_last(rng):
    motion, position = np.repeat([2, 5], [40, 20]), np.concatenate((7 + np.arange(40), 113 + np.arange(20)))
    terms = rng.normal(size=(60, 3))
    mixed = rng.permutation(60)  # of several joints, one after the other
    expected = np.concatenate((terms[:40].reshape(20, 2, 3).sum(axis=1), terms[40:]))
    found = stretches(terms[mixed], motion[mixed], position[mixed])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)  # sums of two


@pytest.mark.parametrize("lasting", [False, True])
def test_a_difference_has_the_larger_deviation_of_unrelated_and_of_lasting_errors_and_that_of_the_payload(
    evidence, rng, lasting
):
    rows = evidence.estimate.solution.rows
    influence = rng.uniform(0.3, 0.9, len(rows.V))
    turning = np.where(rows.position % 2 == 1, 1.0, -1.0)  # cancels within a stretch, or nearly
    residual = rng.uniform(0.5, 0.7, len(rows.V)) * (1.0 if lasting else turning) * np.repeat([1.0, 2.7], 60)
    white = np.linalg.norm(influence * sigma_of(evidence, residual))
    summed = np.sqrt(squared_sums(rows, influence * residual) / (1.0 - 7.0 / 120.0))
    assert (summed > 1.05 * white) == lasting
    assert summed > 1.05 * white or white > 1.05 * summed
    stated = influence @ evidence.stated
    expected = np.sqrt(max(white, summed) ** 2 + stated @ stated)
    np.testing.assert_allclose(difference_std(evidence, influence, residual), expected, rtol=1e-12)  # rounding


@pytest.mark.parametrize(("change", "words"), [(-0.71, "0.71 % smaller than that"), (2.3, "2.3 % larger than that")])
def test_the_joint_whose_gains_differ_most_is_told_with_the_size_and_the_side_of_its_change(change, words):
    words_of, claimed = ("this gives", "than that"), {1: 0.002, 4: 0.003}
    found = judged_difference("x", {1: 4.1, 4: 9.3}, {1: -change, 4: change}, words_of, "why", claimed=claimed)
    assert (found.check, found.joint, found.statistic) == ("x", 4, 9.3)
    assert str(found.sentence).startswith(f"joint 5: this gives a gain {words}, by 9.3 standard deviations")
    assert str(found.sentence).endswith("; why")
    below = {1: 0.99 * found.threshold, 4: 1.3}
    assert not judged_difference("x", below, {1: change, 4: 3.1}, words_of, "why", claimed=claimed).failed
    assert judged_difference("x", {}, {}, words_of, "why", claimed={}) is None


def test_a_sure_difference_of_less_than_half_of_what_is_claimed_of_the_gain_is_not_told():
    def told(change: dict[int, float]):
        return judged_difference("x", {1: 4.1, 4: 9.3}, change, ("a", "b"), "why", claimed={1: 0.002, 4: 0.003})

    found = told({1: 0.09, 4: -0.14})
    assert not found.failed
    assert (found.joint, found.statistic) == (4, 9.3)
    assert told({1: 0.09, 4: -0.16}).joint == 4
    assert told({1: 0.11, 4: -0.14}).joint == 1
    assert told({1: 0.11, 4: -0.14}).sentence.startswith("joint 2: a a gain 0.11 % larger b, by 4.1 standard")


def curves(q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    return np.column_stack((np.sin(2.0 * q), dq, q * dq))


def with_residual(evidence: MadeUp, residual: np.ndarray) -> MadeUp:
    solution = evidence.estimate.solution
    rows = replace(solution.rows, residual=residual)
    return replace(evidence, estimate=replace(evidence.estimate, solution=replace(solution, rows=rows)))


@pytest.mark.parametrize("lasting", [False, True])
def test_a_curve_explains_the_share_that_its_columns_beside_all_others_explain(evidence, lasting):
    if lasting:
        residual = evidence.estimate.solution.rows.residual
        evidence = with_residual(evidence, residual + 2.0 * np.sin(evidence.estimate.solution.rows.position / 4.0))
        evidence = replace(evidence, position=np.sin(evidence.estimate.solution.rows.position / 4.0 + 0.2))
    solution, own = evidence.estimate.solution, slice(60, 120)
    rows, w = solution.rows, 3.1
    Q, e = rows.explained[own], w * rows.residual[own]
    P = w * curves(evidence.position[own], evidence.speed[own])
    left = P - Q @ (Q.T @ P)
    size = P.T @ P - (Q.T @ P).T @ (Q.T @ P)
    of_rows = rows.explained.T @ (rows.weight * rows.residual)  # what beliefs pull by
    S = P.T @ e - (Q.T @ P).T @ of_rows
    variance = w**2 * float(rows.residual[own] @ rows.residual[own]) / 56.0
    root = np.linalg.inv(np.linalg.cholesky(size))
    sums = np.zeros((120, 3))
    sums[own] = (left @ root.T) * e[:, None]
    both = squared_sums(rows, sums)
    assert (both > 3.0 * 1.2 * variance) == lasting
    explained = float(S @ np.linalg.solve(size, S))
    found = residual_curve(evidence, 1, curves)
    # Sums in another order; columns of a condition below ten.
    np.testing.assert_allclose(found.share, explained / float(e @ e), rtol=1e-9)
    np.testing.assert_allclose(found.chi_square, explained / max(variance, both / 3.0), rtol=1e-9)
    assert found.freedom == 3
    moved = (solution.influence[1, own] / w) @ P @ np.linalg.solve(size, S) / solution.inverse[1]
    np.testing.assert_allclose(found.moved, moved, rtol=1e-9)


@pytest.mark.parametrize("lasting", [False, True])
def test_what_is_seen_of_an_effect_is_the_part_of_it_in_what_is_left(evidence, rng, lasting):
    solution = evidence.estimate.solution
    added = rng.normal(size=120)
    slow = added * np.sin(solution.rows.position / 2.5)  # as if there were more of it for a while, and then less
    evidence = with_residual(evidence, 0.3 * added + 0.1 * rng.normal(size=120) + lasting * slow)
    rows, sigma = evidence.estimate.solution.rows, sigma_of(evidence, evidence.estimate.solution.rows.residual)
    w, Q = rows.weight, rows.explained
    left = (w * added - Q @ (Q.T @ (w * added))) / w  # in drive units again
    seen = np.sum(left * rows.residual / sigma**2) / np.sum(left**2 / sigma**2)
    white = 1.0 / np.sum(left**2 / sigma**2)
    summed = white**2 * squared_sums(rows, (left / sigma**2 * (rows.residual - seen * left))[:, None])
    assert (summed > 1.2 * white) == lasting
    found = hidden_effect(evidence, added)
    np.testing.assert_allclose(found.seen, seen, rtol=1e-9)  # sums in another order
    np.testing.assert_allclose(found.std, np.sqrt(max(white, summed)), rtol=1e-9)
    moved = -(solution.influence @ added) / solution.inverse  # of a gain, which is 1/x
    np.testing.assert_allclose([found.moved[0], found.moved[1]], moved, rtol=1e-12)


@pytest.mark.parametrize(("factor", "told"), [(1.25, False), (1.35, True), (1.0 / 1.25, False), (1.0 / 1.35, True)])
def test_what_is_left_of_a_later_motion_is_louder_or_quieter_by_the_ratio_of_its_deviation(factor, told):
    residual = np.concatenate((0.4 * (-1.0) ** np.arange(70), factor * 0.4 * (-1.0) ** np.arange(90)))
    rows = Rows(
        V=residual, residual=residual, joint=np.full(160, 2), motion=np.repeat([1, 3], [70, 90]),
        position=np.arange(160), row_period=0.05, unknowns={2: 16.0}, weight=np.ones(160), explained=np.zeros((160, 0)),
    )  # fmt: skip
    found = bare._louder(rows, 2, 1, 3, 0.9)
    np.testing.assert_allclose(found.share, factor - 1.0, rtol=1e-12)
    assert (found.joint, found.motion, found.told) == (2, 3, told)
    # Half of the rows, less unknowns, count: 31.5 and 40.5; F of the later motion's over that of the first.
    chance = stats.f.cdf(factor**2, 40.5, 31.5)
    np.testing.assert_allclose(stats.norm.sf(found.z), min(chance, 1.0 - chance), rtol=1e-9)


def test_each_joint_alone_is_held_against_all_with_what_the_model_grants_its_gain(evidence, monkeypatch):
    solution = evidence.estimate.solution
    granted = np.array([[0.3, -0.4], [0.05, 0.12]])
    evidence = replace(
        evidence, estimate=replace(evidence.estimate, solution=replace(solution, model=granted))
    )  # of norms 0.5 and 0.13
    told = dict[str, dict[int, float]]()
    monkeypatch.setattr(
        joints, "judged_difference", lambda check, z, change, *words, claimed: told.update(z=z, change=change)
    )
    joints.check_joints(evidence)
    groups = {j: np.repeat([j == 0, j == 1], 2) for j in (0, 1)}
    parts = {j: part_of(evidence.fit, groups[j], [j]) for j in (0, 1)}
    residual = parts[0].residual + parts[1].residual  # each zero on the other's rows
    for j, size in ((0, 0.5), (1, 0.13)):
        alone = parts[j].changes[j]
        relative = alone.value / solution.inverse[j]
        std = difference_std(evidence, alone.influence, residual) / abs(solution.inverse[j])
        np.testing.assert_allclose(told["z"][j], abs(relative) / np.hypot(std, size), rtol=1e-12)  # rounding
        np.testing.assert_allclose(told["change"][j], -100.0 * relative, rtol=1e-12)  # of a gain, which is 1/x


def test_states_of_rows_are_those_at_the_middle_of_their_filters(axes):
    logs = logs_of(Truth())
    evidence = evidence_of(problem_of(axes, logs))
    rows = evidence.estimate.solution.rows
    for joint in range(3):
        q, dq = evidence.states(joint)
        own, first = rows.of(joint), 0
        for motion, log in enumerate(logs):
            observed = evidence.problem.motions[motion].observation.joints[joint]
            here = rows.position[own][rows.motion[own] == motion]
            t = observed.t[np.searchsorted(observed.position, here)]
            part = slice(first, first := first + len(t))
            # Filtered positions beside logged ones: motions of 1 rad below 1 Hz; a filter is half a second long.
            np.testing.assert_allclose(q[part], np.interp(t, log.t, log.q[:, joint]), rtol=0, atol=3e-3)
            rate = np.gradient(log.q[:, joint], log.t)
            np.testing.assert_allclose(dq[part], np.interp(t, log.t, rate), rtol=0, atol=0.05)
        assert first == len(q) == len(dq)


def test_what_is_stated_of_a_payload_changes_currents_by_the_torque_of_its_deviation(axes):
    unsure = replace(BRICK, mass_std=0.0, com_std=(0.0, 0.002, 0.0))
    evidence = evidence_of(problem_of(axes, logs_of(Truth()), (None, unsure)))
    rows, x = evidence.estimate.solution.rows, evidence.estimate.solution.inverse
    moved = replace(BRICK, com=tuple(np.add(BRICK.com, (0.0, 0.002, 0.0))))
    change = moved.known_part().chi - BRICK.known_part().chi
    expected = np.zeros(len(rows.V))
    for joint in range(3):
        observed = evidence.problem.motions[1].observation.joints[joint]
        own = np.flatnonzero((rows.joint == joint) & (rows.motion == 1))
        at = np.searchsorted(observed.position, rows.position[own])
        expected[own] = x[joint] * (observed.W_L[at] @ change)
    assert x[1] < 0.0
    found = evidence.stated
    seen = np.flatnonzero(found.any(axis=0))
    assert len(seen) == 1
    # To first order; the inertia of a brick whose centre is 5 cm away changes by the square of 2 mm as well.
    np.testing.assert_allclose(found[:, seen[0]], expected, rtol=0, atol=0.03 * np.abs(expected).max())
