"""The reduction, the search and its linearisation beside the whole problem, solved by scipy without any of them."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from exact import GAIN, exact_problem, lopsided
from pinocchio_arms import random_arm
from scipy import optimize

from ident.estimation.all_joints.columns import JointColumns, joint_columns, shared_parameters
from ident.estimation.all_joints.fit import AllJointsFit, fitted
from ident.estimation.all_joints.friction import OwnColumns, Term, own_columns
from ident.estimation.all_joints.reduction import ReducedJoint, base_of, own_sigma, reduced_joint
from ident.estimation.all_joints.search import Prior, search
from ident.estimation.all_joints.solution import fit_with, setting, solution, widened
from ident.estimation.problem import Problem
from ident.model.arm import arm_from_pinocchio
from ident.model.structure import Structure, structure_of
from ident.payload.payload import Payload

N = 3
TRUE = np.array([0.93, -4.1, 0.37])


@dataclass(frozen=True)
class Case:
    """A problem of three joints with a further column of friction that something is believed of."""

    problem: Problem
    columns: tuple[JointColumns, ...]
    own: tuple[OwnColumns, ...]
    prior: Prior

    def moved(self, joint: int, row: int, by: float) -> "Case":
        """The same with another current in one row."""
        each = self.columns[joint]
        V = each.V.copy()
        V[row] += by
        return replace(self, columns=tuple(replace(each, V=V) if j == joint else c for j, c in enumerate(self.columns)))

    def believing(self, joint: int, by: float) -> "Case":
        """The same with another belief about the further column of a joint, by some deviations."""
        each = self.own[joint]
        mean = np.where(each.believed, each.mean + by * np.where(each.believed, each.std, 0.0), each.mean)
        own = tuple(replace(each, mean=mean) if j == joint else F for j, F in enumerate(self.own))
        return replace(self, own=own)

    def fit(self) -> AllJointsFit:
        joints = [reduced_joint(each, F) for each, F in zip(self.columns, self.own, strict=True)]
        return fitted(self.columns, joints, search(joints, 1.0 / TRUE, self.prior), self.prior, 0.05)


BELIEVED_STD = 7e-4
"""Deviation of the coefficient of a shared column, about that which data leave."""


@pytest.fixture(scope="module")
def small() -> Structure:
    return structure_of(arm_from_pinocchio(random_arm(np.random.default_rng(4), N, prismatic=0.0)))


@pytest.fixture(scope="module")
def heavy(payload) -> Payload:
    spread = {"mass_std": 0.02, "com_std": (0.001, 0.003, 0.002), "inertia_std": (3e-3, 1e-3, 2e-3, 5e-4, 7e-4, 9e-4)}
    return replace(lopsided(payload), **spread)


def case(small: Structure, heavy: Payload, noise: float, *, pull: float = 1.0) -> Case:
    """Beliefs that are off by some 15 and 30 deviations, times `pull`; one shared column is believed to be small."""
    rng = np.random.default_rng(11)
    chi = rng.uniform(0.5, 2.0, 14 * N)
    motions = [(chi, None, None), (chi, heavy, heavy), (chi, heavy, replace(heavy, known="mass"))]
    problem = exact_problem(small, motions, TRUE, rng, noise=noise, rows=60)
    shared = shared_parameters(problem)
    columns = joint_columns(problem, shared)
    bent = [Term(np.cbrt(each.own["Fv"]), mean=0.3 * pull, std=0.02) for each in columns]
    own = tuple(own_columns(each, {"cbrt": term}, per_motion=True) for each, term in zip(columns, bent, strict=True))
    shared_std = np.append(np.full(columns[0].shared.shape[1], np.inf), BELIEVED_STD)
    columns = widened(columns, [rng.normal(size=(len(each.V), 1)) for each in columns])
    prior = Prior(mean=np.log((1.0 + 0.07 * pull) / np.abs(TRUE)), std=np.array([0.03, 0.4, 0.002]), shared=shared_std)
    return Case(problem, columns, own, prior)


@pytest.fixture
def steady(monkeypatch):
    sigma = np.array([0.9, 0.2, 3.1])
    monkeypatch.setattr("ident.estimation.all_joints.reduction.left_alone", lambda joint, turned: sigma[joint.joint])


@dataclass(frozen=True)
class Whole:
    """Logarithms, shared and own parameters that scipy finds, and the Jacobian of all residuals there."""

    s: np.ndarray
    x: np.ndarray
    J: np.ndarray
    residual: np.ndarray


def whole(given: Case, sigma: list[float], seed: int) -> Whole:
    """All unknowns on all rows, beliefs and priors, by scipy's trust regions, from a random start."""
    p, f = given.columns[0].shared.shape[1], [each.F.shape[1] for each in given.own]
    at = n_and(p, f)
    sign = np.sign(TRUE)

    def parts(x: np.ndarray, jacobian: bool) -> np.ndarray:
        h, theta, found = sign * np.exp(x[:N]), x[N : N + p], []
        for j, (each, own) in enumerate(zip(given.columns, given.own, strict=True)):
            phi, torque = x[at[j] : at[j + 1]], each.shared @ theta + each.known
            if jacobian:
                rows = np.zeros((len(each.V), len(x)))
                rows[:, j], rows[:, N : N + p] = -h[j] * torque, -h[j] * each.shared
                rows[:, at[j] : at[j + 1]] = -own.F
                belief = np.zeros((int(own.believed.sum()), len(x)))
                belief[np.arange(len(belief)), at[j] + np.flatnonzero(own.believed)] = -1.0 / own.std[own.believed]
                found += [rows / sigma[j], belief]
            else:
                found += [(each.V - h[j] * torque - own.F @ phi) / sigma[j]]
                found += [((own.mean - phi) / own.std)[own.believed]]
        small = np.where(np.arange(len(x)) == N + p - 1, -1.0 / BELIEVED_STD, 0.0)
        if jacobian:
            return np.vstack([*found, np.hstack((np.diag(-1.0 / given.prior.std), np.zeros((N, len(x) - N)))), small])
        return np.concatenate([*found, (given.prior.mean - x[:N]) / given.prior.std, [small @ x]])

    x0 = np.random.default_rng(seed).normal(size=at[-1]) * 0.3
    x0[:N] -= np.log(np.abs(TRUE))
    best = optimize.least_squares(
        lambda x: parts(x, False), x0, lambda x: parts(x, True), x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14
    )
    return Whole(best.x[:N], best.x, -parts(best.x, True), parts(best.x, False))


def n_and(p: int, f: list[int]) -> np.ndarray:
    return N + p + np.cumsum([0, *f])


def data_rows(given: Case) -> tuple[np.ndarray, np.ndarray]:
    """Which of the rows of `whole` are currents, and which are beliefs about own columns; the last are the priors."""
    counts = [[len(each.V), int(own.believed.sum())] for each, own in zip(given.columns, given.own, strict=True)]
    kind = np.concatenate([np.repeat([0, 1], count) for count in counts])
    return np.flatnonzero(kind == 0), np.flatnonzero(kind == 1)


@pytest.mark.parametrize("prepared", [False, True])
def test_the_reduction_is_orthogonal_and_loses_nothing(small, heavy, rng, prepared):
    given = case(small, heavy, 0.02)
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


def test_the_weight_of_a_joint_is_what_its_own_free_least_squares_leave(small, heavy):
    given = case(small, heavy, 0.02)
    for each, own in zip(given.columns, given.own, strict=True):
        W = np.hstack((own.F, each.shared, *each.payload))
        unit = W / np.where((norms := np.linalg.norm(W, axis=0)) > 0.0, norms, 1.0)
        x, _, rank, _ = np.linalg.lstsq(unit, each.V, rcond=1e-8)
        expected = np.linalg.norm(each.V - unit @ x) / np.sqrt(len(each.V) - rank)
        np.testing.assert_allclose(own_sigma(each, own), expected, rtol=1e-9)


def test_a_residual_of_rounding_is_no_weight(small, heavy):
    given = case(small, heavy, 0.0)
    free = tuple(own_columns(each, {}, per_motion=True) for each in given.columns)
    for each, own in zip(given.columns, free, strict=True):
        np.testing.assert_allclose(own_sigma(each, own), 1e-9 * np.sqrt(np.mean(each.V**2)), rtol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_the_search_ends_where_the_whole_problem_does(small, heavy, seed):
    given = case(small, heavy, 0.02)
    fit = given.fit()
    sigma = [own_sigma(each, own) for each, own in zip(given.columns, given.own, strict=True)]
    best = whole(given, sigma, seed)
    p, at = given.columns[0].shared.shape[1], n_and(fit.found.theta.size, [each.F.shape[1] for each in given.own])
    # scipy stops at relative changes of 1e-14 of the cost, whose root is 1e-7 of the unknowns.
    np.testing.assert_allclose(np.log(np.abs(fit.found.h)), best.s, rtol=0, atol=1e-6)
    np.testing.assert_allclose(np.sign(fit.found.h), np.sign(TRUE))
    np.testing.assert_allclose(fit.found.theta, best.x[N : N + p], rtol=0, atol=1e-5 * np.abs(best.x).max())
    for j, phi in enumerate(fit.phi):
        np.testing.assert_allclose(phi, best.x[at[j] : at[j + 1]], rtol=0, atol=1e-5)
    np.testing.assert_allclose(fit.found.cost, best.residual @ best.residual, rtol=1e-9)
    current, _ = data_rows(given)
    np.testing.assert_allclose(fit.rows.weight * fit.rows.residual, best.residual[current], rtol=0, atol=1e-5)


def test_influence_and_what_unknowns_explain_are_those_of_the_whole_jacobian(small, heavy):
    given = case(small, heavy, 0.02)
    fit = given.fit()
    sigma = [own_sigma(each, own) for each, own in zip(given.columns, given.own, strict=True)]
    best = whole(given, sigma, 0)
    current, belief = data_rows(given)
    unit = best.J / (norms := np.linalg.norm(best.J, axis=0))
    pseudo, H = np.linalg.pinv(unit, rcond=1e-10) / norms[:, None], unit @ np.linalg.pinv(unit, rcond=1e-10)
    at = n_and(fit.found.theta.size, [each.F.shape[1] for each in given.own])
    # Both linearise at points that are 1e-6 apart.
    weight = fit.rows.weight

    def close(found: np.ndarray, expected: np.ndarray) -> None:
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-4 * np.abs(expected).max())

    close(fit.log_influence, pseudo[:N, current] * weight)
    for j, influence in enumerate(fit.phi_influence):
        close(influence, pseudo[at[j] : at[j + 1], current] * weight)
    close(fit.log_belief, pseudo[:N, [*belief, *range(len(best.J) - N - 1, len(best.J))]])
    close(fit.rows.explained @ fit.rows.explained.T, H[np.ix_(current, current)])
    for j in range(N):
        own = fit.rows.of(j)
        np.testing.assert_allclose(fit.rows.unknowns[j], np.trace(H[np.ix_(current, current)][own, own]), rtol=1e-5)
    np.testing.assert_array_equal(fit.rows.V, np.concatenate([each.V for each in given.columns]))
    np.testing.assert_array_equal(fit.rows.joint, np.repeat(np.arange(N), 180))
    np.testing.assert_array_equal(fit.rows.motion, np.tile(np.repeat([0, 1, 2], 60), 3))
    np.testing.assert_array_equal(fit.rows.position, np.tile(np.arange(60), 9))


@pytest.mark.parametrize(("joint", "row"), [(0, 3), (0, 170), (1, 61), (2, 119), (2, 120)])
def test_the_influence_of_a_row_is_a_finite_difference(small, heavy, steady, joint, row):
    given = case(small, heavy, 1e-4, pull=1e-3)
    fit = given.fit()
    h = 1e-4 * np.sqrt(np.mean(given.columns[joint].V ** 2))
    below, above = (given.moved(joint, row, by).fit() for by in (-h, h))
    at = 180 * joint + row
    # Gauss and Newton leave out what is in proportion to the residual, 1e-4, and to the pull of what is believed.
    slope = np.log(above.found.h / below.found.h) / (2.0 * h)
    np.testing.assert_allclose(slope, fit.log_influence[:, at], rtol=0, atol=1e-2 * np.abs(fit.log_influence).max())
    for k in range(N):
        slope, found = (above.phi[k] - below.phi[k]) / (2.0 * h), fit.phi_influence[k]
        np.testing.assert_allclose(slope, found[:, at], rtol=0, atol=1e-2 * np.abs(found).max())


def test_what_is_believed_moves_the_gains_by_its_deviations(small, heavy, steady):
    given = case(small, heavy, 1e-4, pull=1e-3)
    fit, step = given.fit(), 0.1  # the search ends at steps of 1e-11, the least change looked for here is 1e-8
    assert fit.log_belief.shape == (N, 2 * N + 1)  # a further column and a logarithm a joint, and a shared column
    for j in range(N):
        ends = [given.believing(j, by).fit().found.h for by in (-step, step)]
        slope = np.log(ends[1] / ends[0]) / (2.0 * step)
        np.testing.assert_allclose(slope, fit.log_belief[:, j], rtol=0, atol=1e-2 * np.abs(fit.log_belief[:, j]).max())
        moved = np.where(np.arange(N) == j, step * given.prior.std, 0.0)
        ends = [replace(given, prior=replace(given.prior, mean=given.prior.mean + by * moved)).fit() for by in (-1, 1)]
        slope = np.log(ends[1].found.h / ends[0].found.h) / (2.0 * step)
        column = fit.log_belief[:, N + j]
        np.testing.assert_allclose(slope, column, rtol=0, atol=1e-2 * np.abs(column).max())


def test_random_starts_reach_the_same_minimum(small, heavy):
    given, rng = case(small, heavy, 0.02), np.random.default_rng(2)
    joints = [reduced_joint(each, F) for each, F in zip(given.columns, given.own, strict=True)]
    prior = replace(given.prior, std=np.full(N, 1.0))
    best = search(joints, 1.0 / TRUE, prior)
    for _ in range(20):
        found = search(joints, np.exp(rng.normal(0.0, 1.5, N)) / TRUE, prior)
        np.testing.assert_allclose(found.h, best.h, rtol=1e-9)  # steps of 1e-11 are the last
        np.testing.assert_allclose(found.cost, best.cost, rtol=1e-12)


def test_a_start_ten_decades_off_reaches_the_same_minimum(small, heavy):
    # Columns that are orthonormal at such a start depend on each other at the end: they are made anew on the way.
    given = case(small, heavy, 0.02)
    joints = [reduced_joint(each, F) for each, F in zip(given.columns, given.own, strict=True)]
    prior = replace(given.prior, std=np.full(N, 1.0))
    best = search(joints, 1.0 / TRUE, prior)
    for off in ([23.0, -4.0, 0.7], [-21.0, 1.3, 2.0]):
        found = search(joints, np.exp(np.array(off)) / TRUE, prior)
        np.testing.assert_allclose(found.h, best.h, rtol=1e-9)
        np.testing.assert_allclose(found.theta, best.theta, rtol=0, atol=1e-8 * np.abs(best.theta).max())


def test_random_starts_reach_the_same_minimum_on_six_joints(structure, payload):
    rng = np.random.default_rng(5)
    chi, heavy = rng.uniform(0.5, 2.0, 84), lopsided(payload)
    problem = exact_problem(structure, [(chi, None, None), (chi, heavy, heavy)], GAIN, rng, noise=0.02)
    ready = setting(problem, per_motion=True, prior_std=1.0)
    own = [own_columns(each, {}, per_motion=True) for each in ready.columns]
    joints = [reduced_joint(each, F) for each, F in zip(ready.columns, own, strict=True)]
    prior = Prior(mean=-np.log(np.abs(GAIN)), std=np.ones(6), shared=ready.shared_std)
    ends = [search(joints, np.exp(rng.normal(0.0, 1.5, 6)) / GAIN, prior) for _ in range(4)]
    for found in ends[1:]:
        np.testing.assert_allclose(found.h, ends[0].h, rtol=1e-9)


def test_a_joint_that_the_prior_alone_holds_is_found_in_a_few_steps():
    # Squares of noise alone grow less than the prior's towards larger gains: with k small, d = log h / h0 ends at
    # d = c exp(d), where the squares are bent by -c exp(d) and the prior by 1; steps by T'T alone shrink by 7 %.
    start, k, c = -0.7, 0.031, 0.367
    rows = ReducedJoint(
        basis=np.eye(3), turn=np.eye(3), beliefs=np.zeros((0, 3)), F=np.zeros((3, 0)), sigma=0.3,
        A=np.array([[1.3], [0.0], [0.0]]), k=np.array([0.4, k, 0.0]), V=np.array([2.7, c / (start * k), 1.9]),
    )  # fmt: skip
    prior = Prior(mean=np.log([-start]), std=np.ones(1), shared=np.full(1, np.inf))
    found = search([rows], np.array([start]), prior)
    end = optimize.brentq(lambda d: d - c * np.exp(d) + (start * k) ** 2 * np.exp(2.0 * d), 0.0, 1.0)
    np.testing.assert_allclose(found.h, [start * np.exp(end)], rtol=1e-9)
    assert found.steps < 10


@pytest.mark.parametrize("known", ["all", "com", "mass"])
def test_the_payload_s_share_is_a_finite_difference_by_each_number_that_is_stated(small, heavy, steady, known):
    rng = np.random.default_rng(3)
    chi = rng.uniform(0.5, 2.0, 14 * N)
    one = replace(heavy, known=known)
    two = replace(heavy, mass=3.1, com=(0.02, 0.07, -0.04), mass_std=0.05, com_std=(0.004, 0.002, 0.001))
    clean = exact_problem(small, [(chi, None, None), (chi, heavy, one), (chi, two, two)], TRUE, rng, noise=1e-5)

    def log_gains(first: Payload, second: Payload) -> np.ndarray:
        motions = (
            clean.motions[0],
            replace(clean.motions[1], payload=first),
            replace(clean.motions[2], payload=second),
        )
        ready = setting(replace(clean, motions=motions), per_motion=False, prior_std=1.0)
        return -np.log(np.abs(fit_with(ready, [{}] * N, (), None).fit.found.h))

    ready = setting(clean, per_motion=False, prior_std=1.0)
    found = solution(ready, fit_with(ready, [{}] * N, (), None), np.zeros((N, 0)), np.zeros(N)).payload
    expected = []
    for which, stated in enumerate((one, two)):
        for name, count in (("mass", 1), ("com", 3), ("inertia", 6)):
            for k in range(count):
                std = np.atleast_1d(getattr(stated, f"{name}_std"))[k]
                ends = []
                for sign in (-1.0, 1.0):
                    value = np.atleast_1d(np.array(getattr(stated, name), dtype=float))
                    value[k] += 0.1 * sign * std
                    moved = replace(stated, **{name: float(value[0]) if count == 1 else tuple(value.tolist())})
                    ends.append(log_gains(*((moved, two) if which == 0 else (one, moved))))
                expected.append((ends[1] - ends[0]) / 0.2)
    if known == "mass":  # its one column is the last
        expected[:10] = [*expected[1:10], expected[0]]
    expected = np.array(expected).T
    # A finite difference of a smooth function over a tenth of a deviation; the influence is of first order in 1e-5.
    np.testing.assert_allclose(
        found,
        expected,
        rtol=2e-3,
        atol=1e-3 * np.abs(expected).max(axis=0).min(where=expected.any(axis=0), initial=1.0),
    )
    unknown = {"all": 0, "com": 6, "mass": 9}[known]
    assert np.count_nonzero(found[:, :10].any(axis=0)) == 10 - unknown


def test_shared_parameters_hold_what_is_known_and_what_was_found(small, heavy):
    given = case(small, heavy, 0.0)
    shared = shared_parameters(given.problem)
    theta = 1.0 + np.arange(shared.count)
    values = shared.payload_values(theta)
    np.testing.assert_array_equal(values[0], heavy.known_part().chi)
    free = shared.free[1]
    assert 9 not in free  # the mass is known
    assert values[1, 9] == heavy.mass
    np.testing.assert_array_equal(values[1, free], 1.0 + len(shared.arm) + np.arange(len(free)))
    assert not shared.free[0].size


def test_each_mounting_has_its_own_share_of_what_was_found(small, heavy):
    given = case(small, heavy, 0.0)
    loaded = [replace(motion, payload=replace(heavy, known="mass")) for motion in given.problem.motions[1:]]
    problem = replace(given.problem, motions=(given.problem.motions[0], *loaded))
    shared = shared_parameters(problem)
    theta = 1.0 + np.arange(shared.count)
    found = shared.payload_values(theta)
    assert shared.count == len(shared.arm) + 2 * len(shared.free[0])
    np.testing.assert_array_equal(np.concatenate([found[k, shared.free[k]] for k in (0, 1)]), theta[len(shared.arm) :])
    for k, each in enumerate(joint_columns(problem, shared)):  # the columns of the one are zero where the other is
        mine, count = each.shared[:, len(shared.arm) :], len(shared.free[0])
        assert not mine[each.motion != 1, :count].any(), k
        assert not mine[each.motion != 2, count:].any(), k


def test_own_columns_are_one_a_motion_and_drop_what_does_not_move(small, heavy):
    given = case(small, heavy, 0.02)
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
def test_a_column_with_a_prior_never_replaces_an_equal_one_without(small, heavy, twin, prepared_first):
    # A rank decision by pivots would take either of two equal columns, whichever rounding makes the longer one.
    rng = np.random.default_rng(7)
    each = case(small, heavy, 0.02).columns[1]
    if prepared_first:
        each = replace(each, base=base_of(each, own_columns(each, {}, per_motion=False)))
    for scale in (-0.37, 2.6, 41.0):
        column = scale * each.own[twin] * (1.0 + 1e-12 * rng.normal(size=len(each.V)))
        terms = {"twin": Term(column, mean=0.4, std=0.3), "sum": Term(each.own["off"] - 1.7 * each.own["Fv"], 0.2, 0.1)}
        found = own_columns(each, terms | {"new": Term(each.own["Fv"] ** 3)}, per_motion=False)
        assert found.names == ("Fv", "Fc", "off", "new")
        assert not found.believed.any()
