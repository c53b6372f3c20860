"""The search and its linearisation beside the whole problem, solved by scipy without reduction."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from exact import GAIN, exact_problem, lopsided
from scipy import optimize
from three_joints import BELIEVED_STD, TRUE, Case, N, case

from ident.estimation.all_joints.friction import own_columns
from ident.estimation.all_joints.reduction import ReducedJoint, reduced_joint
from ident.estimation.all_joints.search import Prior, search
from ident.estimation.all_joints.solution import fit_with, setting, solution
from ident.payload.payload import Payload


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


@pytest.mark.parametrize("seed", range(3))
def test_the_search_ends_where_the_whole_problem_does(small, unsure, seed):
    given = case(small, unsure, 0.02)
    fit = given.fit()
    sigma = [reduced_joint(each, own).sigma for each, own in zip(given.columns, given.own, strict=True)]
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


def test_influence_and_what_unknowns_explain_are_those_of_the_whole_jacobian(small, unsure):
    given = case(small, unsure, 0.02)
    fit = given.fit()
    sigma = [reduced_joint(each, own).sigma for each, own in zip(given.columns, given.own, strict=True)]
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
def test_the_influence_of_a_row_is_a_finite_difference(small, unsure, steady, joint, row):
    given = case(small, unsure, 1e-4, pull=1e-3)
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


def test_what_is_believed_moves_the_gains_by_its_deviations(small, unsure, steady):
    given = case(small, unsure, 1e-4, pull=1e-3)
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


def test_random_starts_reach_the_same_minimum(small, unsure):
    given, rng = case(small, unsure, 0.02), np.random.default_rng(2)
    joints = [reduced_joint(each, F) for each, F in zip(given.columns, given.own, strict=True)]
    prior = replace(given.prior, std=np.full(N, 1.0))
    best = search(joints, 1.0 / TRUE, prior)
    for _ in range(20):
        found = search(joints, np.exp(rng.normal(0.0, 1.5, N)) / TRUE, prior)
        np.testing.assert_allclose(found.h, best.h, rtol=1e-9)  # steps of 1e-11 are the last
        np.testing.assert_allclose(found.cost, best.cost, rtol=1e-12)


def test_a_start_ten_decades_off_reaches_the_same_minimum(small, unsure):
    # Columns that are orthonormal at such a start depend on each other at the end: they are made anew on the way.
    given = case(small, unsure, 0.02)
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
def test_the_payload_s_share_is_a_finite_difference_by_each_number_that_is_stated(small, unsure, steady, known):
    rng = np.random.default_rng(3)
    chi = rng.uniform(0.5, 2.0, 14 * N)
    one = replace(unsure, known=known)
    two = replace(unsure, mass=3.1, com=(0.02, 0.07, -0.04), mass_std=0.05, com_std=(0.004, 0.002, 0.001))
    clean = exact_problem(small, [(chi, None, None), (chi, unsure, one), (chi, two, two)], TRUE, rng, noise=1e-5)

    def log_gains(first: Payload, second: Payload) -> np.ndarray:
        motions = (
            clean.motions[0],
            replace(clean.motions[1], payload=first),
            replace(clean.motions[2], payload=second),
        )
        ready = setting(replace(clean, motions=motions), per_motion=False, prior_std=1.0)
        return -np.log(np.abs(fit_with(ready, [{}] * N, (), None).fit.found.h))

    ready = setting(clean, per_motion=False, prior_std=1.0)
    found = solution(ready, fit_with(ready, [{}] * N, (), None), np.zeros((N, 0))).payload
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
