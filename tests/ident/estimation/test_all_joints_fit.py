"""The search and its linearisation beside the whole problem, solved by scipy without reduction."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from exact import exact_problem, lopsided, shared_columns
from pinocchio_arms import random_arm
from scipy import optimize

from ident.estimation.all_joints import Fit, fit, search, solution
from ident.estimation.blocks import outside
from ident.estimation.estimate import GainSolution
from ident.estimation.intervals import classical, jackknife, time_blocks
from ident.estimation.problem import Columns
from ident.estimation.setting import Model, Setting, Term, setting
from ident.model.arm import arm_from_pinocchio
from ident.model.structure import Structure, structure_of
from ident.payload.payload import Payload
from ident.support.errors import NotIdentifiable

N = 3
TRUE = np.array([0.93, -4.1, 0.37])


@pytest.fixture(scope="module")
def small() -> Structure:
    return structure_of(arm_from_pinocchio(random_arm(np.random.default_rng(4), N, prismatic=0.0)))


@pytest.fixture(scope="module")
def unsure(payload) -> Payload:
    spread = {"mass_std": 0.02, "com_std": (0.001, 0.003, 0.002), "inertia_std": (3e-3, 1e-3, 2e-3, 5e-4, 7e-4, 9e-4)}
    return replace(lopsided(payload), **spread)


@dataclass(frozen=True)
class Case:
    """A problem of three joints with a further column of friction that something is believed of, and of log|h|."""

    ready: Setting
    term: Term
    mean: np.ndarray
    std: np.ndarray

    @property
    def model(self) -> Model:
        return Model.of(self.ready, {"cbrt": self.term})

    def fit(self, start: np.ndarray = 1.0 / TRUE) -> Fit:
        model, found = search(self.model, start, self.mean, self.std)
        return Fit(
            ready=self.ready, model=model, h=found.h, z=found.z, mean=self.mean, log_std=self.std, cost=found.cost
        )


BELIEVED_STD = 7e-4
"""Deviation of the coefficient of a shared column, about that which data leave."""


def case(small: Structure, unsure: Payload, noise: float, *, pull: float = 1.0) -> Case:
    """Beliefs that are off by some 15 and 30 deviations, times `pull`; one shared column is believed to be small."""
    rng = np.random.default_rng(11)
    chi = rng.uniform(0.5, 2.0, 14 * N)
    motions = [(chi, None, None), (chi, unsure, unsure), (chi, unsure, replace(unsure, known="mass"))]
    ready = setting(exact_problem(small, motions, TRUE, rng, noise=noise, rows=60), per_motion=True, prior_std=1.0)
    return Case(
        ready=ready.widened(rng.normal(size=(len(ready.columns.V), 1)), BELIEVED_STD),
        term=Term(np.cbrt(Columns.of(ready.problem.motions).own("Fv")), mean=0.3 * pull, std=0.02),
        mean=np.log((1.0 + 0.07 * pull) / np.abs(TRUE)),
        std=np.array([0.03, 0.4, 0.002]),
    )


@pytest.fixture
def steady(monkeypatch):
    sigma = np.array([0.9, 0.2, 3.1])
    monkeypatch.setattr("ident.estimation.setting.sigma_of", lambda blocks, left, rank: sigma)


def whole(given: Case, sigma: np.ndarray, seed: int) -> optimize.OptimizeResult:
    """Logarithms, shared and own parameters by all rows, beliefs and priors, from a random start."""
    columns, model = given.ready.columns, given.model
    (r, p), f = (A := shared_columns(given.ready)).shape, model.F.shape[1]
    sign, joint, mean, std = np.sign(TRUE), columns.joint, model.mean[:, -1], given.term.std
    F = np.where((joint[:, None] == np.arange(N))[:, :, None], model.F[:, None], 0.0).reshape(r, -1)
    small = np.where(np.arange(N + p + N * f) == N + p - 1, -1.0 / BELIEVED_STD, 0.0)
    belief = np.zeros((N, N + p + N * f))
    belief[np.arange(N), N + p + f * np.arange(1, N + 1) - 1] = -1.0 / std

    def parts(x: np.ndarray, jacobian: bool) -> np.ndarray:
        h, theta = (sign * np.exp(x[:N]))[joint], x[N : N + p]
        torque, weight = A @ theta + given.ready.k, 1.0 / sigma[joint]
        if jacobian:
            by_s = np.where(joint[:, None] == np.arange(N), (-h * torque)[:, None], 0.0)
            rows = np.hstack((by_s, -h[:, None] * A, -F)) * weight[:, None]
            return np.vstack([rows, belief, np.hstack((np.diag(-1.0 / given.std), np.zeros((N, p + N * f)))), small])
        left = (columns.V - h * torque - F @ x[N + p :]) * weight
        return np.concatenate([left, mean / std + belief @ x, (given.mean - x[:N]) / given.std, [small @ x]])

    x0 = np.random.default_rng(seed).normal(size=N + p + N * f) * 0.3
    x0[:N] -= np.log(np.abs(TRUE))
    return optimize.least_squares(
        lambda x: parts(x, False), x0, lambda x: parts(x, True), x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14
    )


@pytest.mark.parametrize("seed", [0, *(pytest.param(each, marks=pytest.mark.slow) for each in (1, 2))])
def test_the_search_ends_where_the_whole_problem_does(small, unsure, seed):
    given = case(small, unsure, 0.02)
    found, r = given.fit(), len(given.ready.columns.V)
    best = whole(given, given.model.sigma, seed)
    p = len(found.theta)
    # scipy stops at relative changes of 1e-14 of the cost, whose root is 1e-7 of the unknowns.
    np.testing.assert_allclose(np.log(np.abs(found.h)), best.x[:N], rtol=0, atol=1e-6)
    np.testing.assert_allclose(np.sign(found.h), np.sign(TRUE))
    np.testing.assert_allclose(found.theta, best.x[N : N + p], rtol=0, atol=1e-5 * np.abs(best.x).max())
    np.testing.assert_allclose(found.phi.ravel(), best.x[N + p :], rtol=0, atol=1e-5)
    np.testing.assert_allclose(found.cost, best.fun @ best.fun, rtol=1e-9)
    np.testing.assert_allclose(found.rows.weight * found.rows.residual, best.fun[:r], rtol=0, atol=1e-5)


def test_unknowns_that_the_rows_do_not_determine_are_refused(small, unsure):
    found = case(small, unsure, 0.02).fit()
    normal = found.normal.copy()
    normal[0, 4] = normal[4, 0] = 1.3 * np.sqrt(normal[0, 0] * normal[4, 4])  # as rounding leaves a singular one
    found.__dict__["normal"] = normal
    with pytest.raises(NotIdentifiable, match="do not determine the gains"):
        _ = found.rows


def test_influence_and_what_unknowns_explain_are_those_of_the_whole_jacobian(small, unsure):
    given = case(small, unsure, 0.02)
    found, r = given.fit(), len(given.ready.columns.V)
    J = -whole(given, given.model.sigma, 0).jac
    p, f = len(found.theta), found.phi.shape[1]
    unit = J / (norms := np.linalg.norm(J, axis=0))
    pseudo, H = np.linalg.pinv(unit, rcond=1e-10) / norms[:, None], unit @ np.linalg.pinv(unit, rcond=1e-10)
    # Both linearise at points that are 1e-6 apart.
    weight, own, logs, shared = found.rows.weight, slice(r, r + N), slice(r + N, r + 2 * N), [r + 2 * N]

    def close(one: np.ndarray, expected: np.ndarray) -> None:
        np.testing.assert_allclose(one, expected, rtol=0, atol=1e-4 * np.abs(expected).max())

    for sensitivity, unknowns in (
        (found.log_h, slice(N)),
        (found.of_theta(), slice(N, N + p)),
        *((found.of_joint(j), slice(N + p + j * f, N + p + (j + 1) * f)) for j in range(N)),
    ):
        close(sensitivity.influence, pseudo[unknowns, :r] * weight)
        close(sensitivity.belief, np.hstack([pseudo[unknowns, each] for each in (own, shared, logs)]))
        close(sensitivity.classical(), classical(found.rows, sensitivity.influence))
        close(sensitivity.jackknife(), jackknife(found.rows, sensitivity.influence))
    Q = found.rows.explained.at(np.arange(r))
    close(Q @ Q.T, H[:r, :r])
    for j in range(N):
        at = found.rows.of(j)
        np.testing.assert_allclose(found.rows.unknowns[j], np.trace(H[at, at]), rtol=1e-5)
    for name, atol in (("joint", 0.0), ("motion", 0.0), ("position", 0.0), ("V", 1e-13 * np.abs(found.rows.V).max())):
        np.testing.assert_allclose(getattr(found.rows, name), getattr(given.ready.columns, name), rtol=0, atol=atol)


def test_predictions_of_blocks_are_those_of_fits_without_them(small, unsure, steady):
    # Residuals in proportion to noise: the fit without a block differs to first order in 1e-4.
    given = case(small, unsure, 1e-4, pull=1e-3)
    found, columns = given.fit(), given.ready.columns
    block = time_blocks(columns.motion, columns.position)
    error = found.model.blocks.layout.rows(found.predicted()[..., None])[:, 0]
    du, _, squares = found.without_blocks
    joint, weight = columns.joint, 1.0 / np.array([0.9, 0.2, 3.1])
    for b in (0, 13, 41):
        np.testing.assert_allclose(
            squares[:, b], np.bincount(joint[block == b], (error * weight[joint])[block == b] ** 2), rtol=1e-6
        )
        far = replace(given, ready=given.ready.with_currents(np.where(block == b, columns.V - error, columns.V)))
        # What the others predict of a block, as its currents, leaves the fit where the others have it.
        moved = far.fit()
        np.testing.assert_allclose(np.log(moved.h / found.h), du[b, :N], rtol=0, atol=1e-2 * np.abs(du[:, :N]).max())
        left = moved.model.blocks.layout.rows(moved.residual[..., None])[block == b, 0]
        np.testing.assert_allclose(left, 0.0, rtol=0, atol=1e-2 * np.abs(error[block == b]).max())


def test_any_start_reaches_the_same_minimum(small, unsure):
    # Columns that are orthonormal at a start ten decades off depend on each other at the end: they are made anew.
    given, rng = replace(case(small, unsure, 0.02), std=np.ones(N)), np.random.default_rng(2)
    best = given.fit()
    far = [np.array([23.0, -4.0, 0.7]), np.array([-21.0, 1.3, 2.0])]
    for off in [*rng.normal(0.0, 1.5, (6, N)), *far]:
        found = given.fit(np.exp(off) / TRUE)
        np.testing.assert_allclose(found.h, best.h, rtol=1e-8)
        np.testing.assert_allclose(found.theta, best.theta, rtol=0, atol=1e-8 * np.abs(best.theta).max())
        np.testing.assert_allclose(found.cost, best.cost, rtol=1e-11)


def test_a_joint_that_the_prior_alone_holds_is_found_in_a_few_steps(monkeypatch):
    # Squares of noise alone grow less than the prior's towards larger gains: with k small, d = log h / h0 ends at
    # d = c exp(d), where the squares are bent by -c exp(d) and the prior by 1; steps by T'T alone shrink by 7 %.
    start, k, c = -0.7, 0.031, 0.367
    W = np.array([[1.3, 0.4, 2.7], [0.0, k, c / (start * k)], [0.0, 0.0, 1.9]])
    blocks = SimpleNamespace(prior=np.zeros((0, 1)), weight=np.ones(1))
    model = SimpleNamespace(eliminated=(None, None, (W.T @ W)[None]), blocks=blocks, sigma=np.ones(1))
    monkeypatch.setattr("ident.estimation.all_joints.MOST_STEPS", 9)
    _, found = search(model, np.array([start]), np.log([-start]), np.ones(1))
    end = optimize.brentq(lambda d: d - c * np.exp(d) + (start * k) ** 2 * np.exp(2.0 * d), 0.0, 1.0)
    np.testing.assert_allclose(found.h, [start * np.exp(end)], rtol=1e-9)


@pytest.mark.parametrize("known", ["com", *(pytest.param(each, marks=pytest.mark.slow) for each in ("all", "mass"))])
def test_the_payload_s_share_is_a_finite_difference_by_each_number_that_is_stated(small, unsure, steady, known):
    rng = np.random.default_rng(3)
    chi, one = rng.uniform(0.5, 2.0, 14 * N), replace(unsure, known=known)
    two = replace(unsure, mass=3.1, com=(0.02, 0.07, -0.04), mass_std=0.05, com_std=(0.004, 0.002, 0.001))
    clean = exact_problem(small, [(chi, None, None), (chi, unsure, one), (chi, two, two)], TRUE, rng, noise=1e-5)

    def fitted(*payloads: Payload) -> GainSolution:
        carried = zip(clean.motions, (None, *payloads), strict=True)
        moved = replace(clean, motions=tuple(replace(each, payload=payload) for each, payload in carried))
        ready = setting(moved, per_motion=False, prior_std=1.0)
        return solution(ready, fit(ready, {}, None), np.zeros((N, 0)))

    def moved(which: int, name: str, k: int, by: float) -> np.ndarray:
        both = [one, two]
        value, std = (np.atleast_1d(getattr(both[which], each)).astype(float) for each in (name, f"{name}_std"))
        value[k] += by * std[k]
        both[which] = replace(both[which], **{name: float(value[0]) if name == "mass" else tuple(value.tolist())})
        return -np.log(np.abs(fitted(*both).inverse))

    found = fitted(one, two).payload
    numbers = [("mass", 0), *(("com", k) for k in range(3)), *(("inertia", k) for k in range(6))]
    each = [(which, *number) for which in (0, 1) for number in numbers]
    expected = np.array([(moved(*number, 0.1) - moved(*number, -0.1)) / 0.2 for number in each]).T
    # A finite difference of a smooth function over a tenth of a deviation; the influence is of first order in 1e-5.
    least = np.abs(expected).max(axis=0).min(where=expected.any(axis=0), initial=1.0)
    np.testing.assert_allclose(found, expected, rtol=3e-3, atol=1e-3 * least)
    unknown = {"all": 0, "com": 6, "mass": 9}[known]
    assert np.count_nonzero(found[:, :10].any(axis=0)) == 10 - unknown


# Columns and their cross products: nothing is lost, and what depends on others is left out


def free_sigma(columns: Columns, F: np.ndarray, A: np.ndarray, joint: int) -> float:
    """What the free least squares of a joint alone leave."""
    own = columns.joint == joint
    W = np.hstack((F, A, *columns.W_L))[own]
    unit = W / np.where((norms := np.linalg.norm(W, axis=0)) > 0.0, norms, 1.0)
    x, _, rank, _ = np.linalg.lstsq(unit, columns.V[own], rcond=1e-8)
    return float(np.linalg.norm(columns.V[own] - unit @ x) / np.sqrt(own.sum() - rank))


def test_the_part_of_a_column_outside_a_basis_is_orthogonal_to_it_even_if_it_is_a_millionth(rng):
    Q = np.linalg.qr(rng.normal(size=(3, 90, 7)))[0]
    within, new = Q @ rng.normal(size=(3, 7, 2)), rng.normal(size=(3, 90, 2))
    left, along = outside(Q, within + 1e-6 * new)  # one pass alone leaves rounding of the whole column
    size = np.linalg.norm(left, axis=1, keepdims=True)
    np.testing.assert_allclose(Q.swapaxes(1, 2) @ left / size, 0.0, atol=1e-14)
    np.testing.assert_allclose(Q @ along + left, within + 1e-6 * new, rtol=0, atol=1e-14)


def test_shared_columns_can_be_appended_one_by_one_and_currents_replaced(small, unsure, rng):
    ready = case(small, unsure, 0.02).ready
    more = rng.normal(size=(len(ready.columns.V), 3)) + 5.0 * shared_columns(ready)[:, :1]
    std = np.array([np.inf, 0.3, 1e-3])
    once = ready.widened(more, std).with_currents(ready.columns.V[::-1].copy())
    each = ready.with_currents(ready.columns.V[::-1].copy())
    for k in range(3):
        each = each.widened(more[:, k : k + 1], std[k])
    anew = replace(each, blocks=each.blocks.at(each.blocks.weight))
    columns = replace(Columns.of(ready.problem.motions), V=once.columns.V)
    F = columns.friction(per_motion=True)[1]
    expected = fit(once, {}, None)
    for one in (once, each, anew):
        blocks = one.blocks
        gram = np.tensordot(blocks.weight**2, blocks.total[:, :-2, :-2], 1) + blocks.prior.T @ blocks.prior
        np.testing.assert_allclose(gram, np.eye(len(gram)), atol=1e-7)  # priors are rows as well
        for j in range(N):  # of the currents that are there now
            np.testing.assert_allclose(one.sigma[j], free_sigma(columns, F, shared_columns(once), j), rtol=1e-8)
        found = fit(one, {}, None)
        np.testing.assert_allclose(found.h, expected.h, rtol=1e-7)
        np.testing.assert_allclose(found.theta, expected.theta, rtol=0, atol=1e-7 * np.abs(expected.theta).max())


def test_the_weight_of_a_joint_is_no_rounding(small, unsure):
    exact = case(small, unsure, 0.0).ready
    for j in range(N):
        least = 1e-6 * np.sqrt(np.mean(exact.columns.V[exact.columns.joint == j] ** 2))
        np.testing.assert_allclose(exact.sigma[j], least, rtol=1e-12)


def test_own_columns_are_one_a_motion_and_drop_what_does_not_move(small, unsure):
    ready = case(small, unsure, 0.02).ready
    columns = Columns.of(ready.problem.motions)
    still = (columns.motion == 1) & (columns.joint == 1)
    moved = replace(columns, W=np.where(still[:, None] & columns.of_parameter("Fc"), 0.0, columns.W))
    names, F = moved.friction(per_motion=True)
    assert names == (*(("Fv", k) for k in range(3)), *(("Fc", k) for k in range(3)), ("off", -1))
    for (name, which), column in zip(names, F.T, strict=True):
        np.testing.assert_array_equal(column, np.where((moved.motion == which) | (which < 0), moved.own(name), 0.0))
    own = type(ready.blocks.own).none(ready.blocks.layout).extended(ready.blocks.layout.padded(F))
    np.testing.assert_array_equal(own.used[1], [name != "Fc" or which != 1 for name, which in names])
    assert own.used[[0, 2]].all()


@pytest.mark.parametrize("twin", ["Fv", "Fc", "off"])
def test_a_column_with_a_prior_never_replaces_an_equal_one_without(small, unsure, twin):
    # A rank decision by pivots would take either of two equal columns, whichever rounding makes the longer one.
    rng = np.random.default_rng(7)
    given = case(small, unsure, 0.02).ready.problem
    ready = setting(given, per_motion=False, prior_std=1.0)
    own = {name: Columns.of(given.motions).own(name) for name in ("Fv", "Fc", "off")}
    for scale in (-0.37, 2.6, 41.0):
        column = scale * own[twin] * (1.0 + 1e-12 * rng.normal(size=len(own[twin])))
        terms = {"twin": Term(column, mean=0.4, std=0.3), "sum": Term(own["off"] - 1.7 * own["Fv"], 0.2, 0.1)}
        model = Model.of(ready, terms | {"new": Term(own["Fv"] ** 3)})
        np.testing.assert_array_equal(model.own.used, N * [[True, True, True, False, False, True]])
        assert not np.isfinite(model.std).any()
