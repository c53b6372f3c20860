"""The columns of all joints and their cross products: nothing is lost, and what depends on others is left out."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from exact import exact_problem
from three_joints import TRUE, N, case

from ident.estimation.all_joints import fit
from ident.estimation.intervals import time_blocks
from ident.estimation.rows import Columns
from ident.estimation.setting import Model, Term, setting


def free_sigma(columns: Columns, F: np.ndarray, A: np.ndarray, joint: int) -> float:
    """What the free least squares of a joint alone leave."""
    own = columns.joint == joint
    W = np.hstack((F, A, *columns.W_L))[own]
    unit = W / np.where((norms := np.linalg.norm(W, axis=0)) > 0.0, norms, 1.0)
    x, _, rank, _ = np.linalg.lstsq(unit, columns.V[own], rcond=1e-8)
    return float(np.linalg.norm(columns.V[own] - unit @ x) / np.sqrt(own.sum() - rank))


def test_shared_columns_can_be_appended_one_by_one_and_currents_replaced(small, unsure, rng):
    ready = case(small, unsure, 0.02).ready
    more = rng.normal(size=(len(ready.columns.V), 3)) + 5.0 * ready.A[:, :1]
    std = np.array([np.inf, 0.3, 1e-3])
    once = ready.widened(more, std).with_currents(ready.columns.V[::-1].copy())
    each = ready.with_currents(ready.columns.V[::-1].copy())
    for k in range(3):
        each = each.widened(more[:, k : k + 1], std[k])
    anew = replace(each, blocks=each.blocks.at(each.blocks.weight))
    F = once.columns.friction(per_motion=True)[1]
    expected = fit(once, {}, None)
    for one in (once, each, anew):
        blocks = one.blocks
        gram = np.tensordot(blocks.weight**2, blocks.total[:, :-2, :-2], 1) + blocks.prior.T @ blocks.prior
        np.testing.assert_allclose(gram, np.eye(len(gram)), atol=1e-7)  # priors are rows as well
        for j in range(N):  # of the currents that are there now
            np.testing.assert_allclose(one.sigma[j], free_sigma(once.columns, F, once.A, j), rtol=1e-8)
        found = fit(one, {}, None)
        np.testing.assert_allclose(found.h, expected.h, rtol=1e-7)
        np.testing.assert_allclose(found.theta, expected.theta, rtol=0, atol=1e-7 * np.abs(expected.theta).max())


def test_the_weight_of_a_joint_is_what_its_own_free_least_squares_leave_but_no_rounding(small, unsure):
    given, exact = case(small, unsure, 0.02), case(small, unsure, 0.0).ready
    for j in range(N):
        left = free_sigma(given.ready.columns, given.model.F, given.ready.A, j)
        np.testing.assert_allclose(given.model.sigma[j], left, rtol=1e-9)
        least = 1e-6 * np.sqrt(np.mean(exact.columns.V[exact.columns.joint == j] ** 2))
        np.testing.assert_allclose(exact.sigma[j], least, rtol=1e-12)


def test_each_row_is_that_of_its_joint_and_motion_with_the_payload_that_it_carries(small, unsure, rng):
    motions = [(rng.uniform(0.5, 2.0, 14 * N), each, each) for each in (None, unsure, replace(unsure, known="mass"))]
    problem = exact_problem(small, motions, TRUE, rng, rows=20)
    given = []
    for m in problem.motions:
        own = tuple(replace(each, weight=rng.uniform(size=20)) for each in m.observation.joints)
        given.append(replace(m, observation=replace(m.observation, joints=own)))
    rows = Columns.of(given, [0, 2])
    for j, (k, motion) in product((0, 2), enumerate(given)):
        at, own = (rows.joint == j) & (rows.motion == k), motion.observation.joints[j]
        for name in ("V", "t", "weight", "position"):
            np.testing.assert_array_equal(getattr(rows, name)[at], getattr(own, name))
        np.testing.assert_array_equal(rows.carried[at], own.W_L if k else 0.0)
        assert (rows.loaded[at] == (k > 0)).all()


def test_own_columns_are_one_a_motion_and_drop_what_does_not_move(small, unsure):
    ready = case(small, unsure, 0.02).ready
    columns = ready.columns
    still = (columns.motion == 1) & (columns.joint == 1)
    moved = replace(columns, W=np.where(still[:, None] & columns.of_parameter("Fc"), 0.0, columns.W))
    names, F = moved.friction(per_motion=True)
    assert [name for name, _ in names] == ["Fv"] * 3 + ["Fc"] * 3 + ["off"]
    assert [which for _, which in names] == [0, 1, 2, 0, 1, 2, -1]
    for (name, which), column in zip(names, F.T, strict=True):
        np.testing.assert_array_equal(column, np.where((moved.motion == which) | (which < 0), moved.own(name), 0.0))
    own = type(ready.blocks.own).none(ready.blocks.layout).extended(ready.blocks.layout.padded(F))
    np.testing.assert_array_equal(own.used[1], [name != "Fc" or which != 1 for name, which in names])
    assert own.used[[0, 2]].all()
    common, F = columns.friction(per_motion=False)
    assert common == (("Fv", -1), ("Fc", -1), ("off", -1))
    np.testing.assert_array_equal(F, np.column_stack([columns.own(name) for name in ("Fv", "Fc", "off")]))


@pytest.mark.parametrize("twin", ["Fv", "Fc", "off"])
def test_a_column_with_a_prior_never_replaces_an_equal_one_without(small, unsure, twin):
    # A rank decision by pivots would take either of two equal columns, whichever rounding makes the longer one.
    rng = np.random.default_rng(7)
    given = case(small, unsure, 0.02).ready.problem
    ready = setting(given, per_motion=False, prior_std=1.0)
    own = {name: ready.columns.own(name) for name in ("Fv", "Fc", "off")}
    for scale in (-0.37, 2.6, 41.0):
        column = scale * own[twin] * (1.0 + 1e-12 * rng.normal(size=len(own[twin])))
        terms = {"twin": Term(column, mean=0.4, std=0.3), "sum": Term(own["off"] - 1.7 * own["Fv"], 0.2, 0.1)}
        model = Model.of(ready, terms | {"new": Term(own["Fv"] ** 3)})
        np.testing.assert_array_equal(model.own.used, N * [[True, True, True, False, False, True]])
        assert not np.isfinite(model.std).any()


def test_time_blocks_have_equal_lengths_of_each_motion_and_no_empty_one_has_a_number():
    motion = np.array([0] * 9 + [1] * 5 + [0] * 3)
    position = np.array([3, 4, 5, 9, 10, 11, 12, 21, 22, 0, 4, 5, 6, 9, 3, 12, 22])
    # Of motion 0 the rows 3 to 22 are four times five, of which the third has none; of motion 1 ten.
    expected = [0, 0, 0, 1, 1, 1, 1, 2, 2, 3, 4, 5, 5, 6, 0, 1, 2]
    np.testing.assert_array_equal(time_blocks(motion, position, 4), expected)
