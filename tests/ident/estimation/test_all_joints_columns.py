"""The columns of each joint: what joints share, what is a joint's own, and their reduction to a few rows."""

from dataclasses import replace

import numpy as np
import pytest
from three_joints import case

from ident.estimation.all_joints.columns import joint_columns, shared_parameters
from ident.estimation.all_joints.friction import Term, own_columns
from ident.estimation.all_joints.reduction import base_of, reduced_joint
from ident.estimation.all_joints.torques import fitted_parameters


@pytest.mark.parametrize("prepared", [False, True])
def test_the_reduction_is_orthogonal_and_loses_nothing(small, unsure, rng, prepared):
    given = case(small, unsure, 0.02)
    for each, own in zip(given.columns, given.own, strict=True):
        if prepared:  # and a column of which a part in 1e9 is new
            first = replace(each, shared=each.shared[:, :-1])
            hardly = each.shared[:, :1] + each.own["Fv"][:, None] + 1e-9 * rng.normal(size=(len(each.V), 1))
            base = base_of(first, own_columns(first, {}, per_motion=True))
            each = replace(each, shared=np.hstack((each.shared, hardly)), base=base)
        small_one, f = reduced_joint(each, own), own.F.shape[1]
        W = np.column_stack((own.F, each.shared, each.known, each.V)) / small_one.sigma
        # One believed column, the last of F: a row 1 / std under that column and mean / std under the currents.
        belief = np.zeros(W.shape[1])
        belief[f - 1], belief[-1] = 1.0 / 0.02, 0.3 / 0.02
        R = np.column_stack((small_one.F, small_one.A, small_one.k, small_one.V))
        np.testing.assert_allclose(small_one.Q @ R, np.vstack((W, belief)), atol=1e-12 * np.abs(W).max())
        np.testing.assert_allclose(small_one.Q.T @ small_one.Q, np.eye(int(W.any(axis=0).sum())), atol=1e-13)
        assert len(small_one.basis) == len(each.V)
        np.testing.assert_array_equal(np.tril(small_one.F, -1), 0.0)
        np.testing.assert_array_equal(small_one.F[small_one.inner], 0.0)


def test_the_weight_of_a_joint_is_what_its_own_free_least_squares_leave(small, unsure):
    given = case(small, unsure, 0.02)
    for each, own in zip(given.columns, given.own, strict=True):
        W = np.hstack((own.F, each.shared, *each.payload))
        unit = W / np.where((norms := np.linalg.norm(W, axis=0)) > 0.0, norms, 1.0)
        x, _, rank, _ = np.linalg.lstsq(unit, each.V, rcond=1e-8)
        expected = np.linalg.norm(each.V - unit @ x) / np.sqrt(len(each.V) - rank)
        np.testing.assert_allclose(reduced_joint(each, own).sigma, expected, rtol=1e-9)


def test_a_residual_of_rounding_is_no_weight(small, unsure):
    given = case(small, unsure, 0.0)
    free = tuple(own_columns(each, {}, per_motion=True) for each in given.columns)
    for each, own in zip(given.columns, free, strict=True):
        np.testing.assert_allclose(reduced_joint(each, own).sigma, 1e-9 * np.sqrt(np.mean(each.V**2)), rtol=1e-12)


def test_shared_parameters_hold_what_is_known_and_what_was_found(small, unsure):
    given = case(small, unsure, 0.0)
    shared = shared_parameters(given.problem)
    theta = 1.0 + np.arange(shared.count)
    values = shared.payload_values(theta)
    np.testing.assert_array_equal(values[0], unsure.known_part().chi)
    free = shared.free[1]
    assert 9 not in free  # the mass is known
    assert values[1, 9] == unsure.mass
    np.testing.assert_array_equal(values[1, free], 1.0 + len(shared.arm) + np.arange(len(free)))
    assert not shared.free[0].size


def test_each_mounting_has_its_own_share_of_what_was_found(small, unsure):
    given = case(small, unsure, 0.0)
    loaded = [replace(motion, payload=replace(unsure, known="mass")) for motion in given.problem.motions[1:]]
    problem = replace(given.problem, motions=(given.problem.motions[0], *loaded))
    shared = shared_parameters(problem)
    theta = 1.0 + np.arange(shared.count)
    found = shared.payload_values(theta)
    assert shared.count == len(shared.arm) + 2 * len(shared.free[0])
    np.testing.assert_array_equal(np.concatenate([found[k, shared.free[k]] for k in (0, 1)]), theta[len(shared.arm) :])
    bare, *carried = (fitted_parameters(problem, each, shared, theta) for each in problem.motions)
    added = [(each - bare)[small.payload_columns] for each in carried]  # by equal payloads, which are two
    np.testing.assert_allclose(added, found, rtol=1e-12)
    for k, each in enumerate(joint_columns(problem, shared)):  # the columns of the one are zero where the other is
        mine, count = each.shared[:, len(shared.arm) :], len(shared.free[0])
        assert not mine[each.motion != 1, :count].any(), k
        assert not mine[each.motion != 2, count:].any(), k


def test_own_columns_are_one_a_motion_and_drop_what_does_not_move(small, unsure):
    given = case(small, unsure, 0.02)
    each = given.columns[1]
    still = replace(each, own={**each.own, "Fc": np.where(each.motion == 1, 0.0, each.own["Fc"])})
    found = own_columns(still, {"twin": Term(2.0 * each.own["off"]), "new": Term(each.own["Fv"] ** 3)}, per_motion=True)
    assert found.names == ("Fv", "Fv", "Fv", "Fc", "Fc", "off", "new")
    assert found.motion == (0, 1, 2, 0, 2, -1, -1)
    for k, which in enumerate((0, 1, 2)):
        np.testing.assert_array_equal(found.F[:, k], np.where(each.motion == which, each.own["Fv"], 0.0))
    assert not found.believed.any()
    common = own_columns(still, {}, per_motion=False)
    assert (common.names, common.motion) == (("Fv", "Fc", "off"), (-1, -1, -1))
    np.testing.assert_array_equal(common.F, np.column_stack([still.own[name] for name in common.names]))


@pytest.mark.parametrize("prepared_first", [False, True])
@pytest.mark.parametrize("twin", ["Fv", "Fc", "off"])
def test_a_column_with_a_prior_never_replaces_an_equal_one_without(small, unsure, twin, prepared_first):
    # A rank decision by pivots would take either of two equal columns, whichever rounding makes the longer one.
    rng = np.random.default_rng(7)
    each = case(small, unsure, 0.02).columns[1]
    if prepared_first:
        each = replace(each, base=base_of(each, own_columns(each, {}, per_motion=False)))
    for scale in (-0.37, 2.6, 41.0):
        column = scale * each.own[twin] * (1.0 + 1e-12 * rng.normal(size=len(each.V)))
        terms = {"twin": Term(column, mean=0.4, std=0.3), "sum": Term(each.own["off"] - 1.7 * each.own["Fv"], 0.2, 0.1)}
        found = own_columns(each, terms | {"new": Term(each.own["Fv"] ** 3)}, per_motion=False)
        assert found.names == ("Fv", "Fc", "off", "new")
        assert not found.believed.any()
