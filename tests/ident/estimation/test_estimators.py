"""The contract that every entry of ESTIMATORS keeps."""

import re
from collections.abc import Callable
from dataclasses import FrozenInstanceError, fields, is_dataclass, replace
from functools import cache

import numpy as np
import pytest
from exact import EXACT, GAIN, estimated, exact_observation, exact_pair, lopsided, values

from ident.estimation.estimate import GainEstimate, GainSolution, IdentifiedGain, RefusedGain
from ident.estimation.estimators import ESTIMATORS, estimator
from ident.estimation.intervals import UNCERTAINTIES
from ident.estimation.problem import GainOptions, pair
from ident.observation.observation import JointObservation, Observation
from ident.payload.payload import Payload
from ident.support.errors import OptionError

pytestmark = pytest.mark.parametrize("method", ESTIMATORS)
# A search ends where its last step does; the deviations follow from a factorisation at that point.
SETTLED = {"nls": 1e-7}
LOOSE = GainOptions(noise_floor=1e-12, max_rel_std=10.0)


@pytest.fixture(scope="module", autouse=True)
def _instruments_of_random_states():
    """Rows of random states have no motion behind them to take instruments from: any columns that go with theirs do."""

    def bent(x: np.ndarray) -> np.ndarray:
        return x + 0.3 * np.sin(3.0 * x)

    def along(joint: JointObservation) -> JointObservation:
        return replace(joint, W=bent(joint.W), W_L=bent(joint.W_L))

    def instruments(problem):
        motions = (replace(m, observation=each(m.observation, along)) for m in problem.motions)
        return replace(problem, motions=tuple(motions)), 0.2

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("ident.estimation.estimators.iv.instruments", instruments)
        yield


@pytest.fixture(scope="module")
def heavy(payload) -> Payload:
    return replace(lopsided(payload), mass_std=0.03)


@pytest.fixture(scope="module")
def noisy(structure, heavy) -> tuple[Observation, Observation]:
    return exact_pair(structure, heavy, GAIN, np.random.default_rng(3), noise=0.003, rows=120)


@pytest.fixture(scope="module")
def found(noisy, heavy) -> Callable[[str], GainEstimate]:
    """What each method finds in the noisy data, estimated once."""
    return cache(lambda method: estimated(method, *noisy, heavy, LOOSE))


@pytest.fixture
def steady_weights(monkeypatch):
    """Weights that do not move with a joint's residual: their own derivative is no part of the influence."""
    monkeypatch.setattr(
        "ident.estimation.estimators.sequential_2011.row_weights",
        lambda W, Y, groups: np.array([1.3, 0.7, 2.1])[groups],
    )
    sigma = np.array([0.02, 0.05, 0.03, 0.01, 0.001, 0.3])
    monkeypatch.setattr("ident.estimation.setting.sigma_of", lambda blocks, left, rank: sigma)


def changed(observation: Observation, joints: dict[int, JointObservation]) -> Observation:
    return replace(observation, joints=tuple(joints.get(j, joint) for j, joint in enumerate(observation.joints)))


def each(observation: Observation, change) -> Observation:
    return changed(observation, {j: change(joint) for j, joint in enumerate(observation.joints)})


def stds(estimate: GainEstimate) -> np.ndarray:
    return np.array([joint.residual_std if isinstance(joint, IdentifiedGain) else np.nan for joint in estimate.joints])


def test_its_options_are_a_frozen_dataclass_and_other_options_and_names_are_refused(method, noisy, heavy):
    options = ESTIMATORS[method].options()
    assert is_dataclass(options)
    for each in fields(options):
        with pytest.raises(FrozenInstanceError):
            setattr(options, each.name, None)
    with pytest.raises(OptionError, match="options are str; this estimator accepts"):
        ESTIMATORS[method].estimate(pair(*noisy, heavy, LOOSE), "nothing")
    with pytest.raises(OptionError, match=f"unknown method 'x{method}'; did you mean '{method}'.; known: .*{method}"):
        estimator("x" + method)


def test_exact_data_give_exact_gains(method, structure, heavy, rng):
    estimate = estimated(method, *exact_pair(structure, heavy, GAIN, rng), heavy)
    np.testing.assert_allclose(values(estimate), GAIN, rtol=100 * EXACT)  # up to two solutions in a row
    assert estimate.method == method


def test_a_payload_that_is_not_there_gives_no_gain(method, structure, heavy, rng):
    chi, load = rng.uniform(0.5, 2.0, 84), np.zeros(10)
    bare = [exact_observation(structure, chi, load, GAIN, rng, noise=0.02, rows=150) for _ in range(2)]
    estimate = estimated(method, *bare, heavy, GainOptions())
    assert all(isinstance(joint, RefusedGain) for joint in estimate.joints)


def test_the_same_data_give_the_same_digits(method, noisy, heavy, found):
    first, second = found(method), estimated(method, *noisy, heavy, LOOSE)
    np.testing.assert_array_equal(values(first), values(second))
    np.testing.assert_array_equal(first.covariance, second.covariance)


def test_mass_times_k_is_gains_times_k(method, noisy, heavy, found):
    k = 3.7
    inertia, spread = tuple(k * i for i in heavy.inertia), k * heavy.mass_std
    heavier = replace(heavy, mass=k * heavy.mass, inertia=inertia, mass_std=spread)
    before, after = found(method), estimated(method, *noisy, heavier, LOOSE)
    np.testing.assert_allclose(values(after), k * values(before), rtol=SETTLED.get(method, 1e3 * EXACT))
    np.testing.assert_allclose(stds(after), k * stds(before), rtol=SETTLED.get(method, 1e3 * EXACT))


def test_currents_times_k_are_gains_over_k_of_each_joint(method, noisy, heavy, found):
    k = np.array([-23.0, 0.013, 1.7, -0.4, 1e3, 5.1])
    scaled = (changed(o, {j: replace(one, V=k[j] * one.V) for j, one in enumerate(o.joints)}) for o in noisy)
    before, after = found(method), estimated(method, *scaled, heavy, LOOSE)
    np.testing.assert_allclose(values(after), values(before) / k, rtol=SETTLED.get(method, 1e3 * EXACT))
    np.testing.assert_allclose(stds(after), stds(before) / np.abs(k), rtol=SETTLED.get(method, 1e3 * EXACT))


@pytest.mark.parametrize(
    ("joint", "loaded"), [(2, 0), *(pytest.param(*each, marks=pytest.mark.slow) for each in ((0, 1), (4, 1)))]
)
def test_the_influence_is_the_derivative_by_the_currents(method, structure, heavy, steady_weights, joint, loaded):
    noisy = exact_pair(structure, heavy, GAIN, np.random.default_rng(3), noise=1e-5, rows=120)
    solution = estimated(method, *noisy, heavy, LOOSE).solution
    rows, row, part = solution.rows, 17, noisy[loaded].joints[joint]
    h = 1e-5 * float(np.sqrt(np.mean(part.V**2)))

    def moved(by: float) -> GainSolution:
        motions = list(noisy)
        motions[loaded] = changed(noisy[loaded], {joint: replace(part, V=part.V + by * (np.arange(120) == row))})
        return estimated(method, *motions, heavy, LOOSE).solution

    above, below = moved(h), moved(-h)
    derivative, of_friction = ((getattr(above, x) - getattr(below, x)) / (2.0 * h) for x in ("inverse", "friction"))
    at = rows.of(joint).start + np.flatnonzero((rows.motion == loaded)[rows.of(joint)])[row]
    # Central differences of a smooth function: 1e-10 relative, rounding 1e-11 / 1e-5; the influence is of first order,
    # what it leaves out is of the size of the noise, 1e-5, times a condition number below 100.
    scale = np.abs(solution.influence).max(axis=1)
    np.testing.assert_allclose(derivative / scale, solution.influence[:, at] / scale, atol=1e-3)
    assert np.abs(solution.influence[joint, at]) > 0.0
    for own in (np.arange(6) == joint, np.arange(6) != joint):  # in proportion to rounding of so small a part
        friction = solution.friction_influence[own][..., at]
        np.testing.assert_allclose(of_friction[own], friction, rtol=0, atol=0.03 * np.abs(friction).max())


def test_deviations_follow_from_influence_and_residual_by_the_uncertainty_that_is_asked_for(method, noisy, heavy):
    for name, uncertainty in UNCERTAINTIES.items():
        estimate = estimated(method, *noisy, heavy, replace(LOOSE, uncertainty=name))
        solution = estimate.solution
        covariance = uncertainty(solution.rows, solution.influence)
        np.testing.assert_allclose(estimate.covariance, covariance, rtol=1e-12)
        np.testing.assert_allclose(stds(estimate), np.sqrt(np.diag(covariance)) * values(estimate) ** 2, rtol=1e-12)


def test_rows_hold_the_currents_and_what_the_fit_leaves_of_their_noise_and_loaded_ones_the_load(
    method, structure, heavy, noisy, found
):
    exact = exact_pair(structure, heavy, GAIN, np.random.default_rng(3), rows=120)
    rows, loads, known = found(method).solution.rows, found(method).solution.load_rms, heavy.known_part()
    for joint in range(6):
        own = rows.of(joint)
        load = noisy[1].joints[joint].W_L @ (known.chi * known.mask)
        if method != "sequential-2011":  # which knows the mass alone
            np.testing.assert_allclose(loads[joint], np.sqrt(np.mean(load**2)), rtol=1e-9)
        for motion in (0, 1):
            given, clean = (each[motion].joints[joint].V for each in (noisy, exact))
            where = np.flatnonzero(rows.motion[own] == motion) + own.start
            np.testing.assert_allclose(rows.V[where], given, rtol=1e-14)
            # A fit of up to 50 unknowns to 240 rows takes up to a half of the noise's square on one motion, and adds
            # less than a fifth to it, at the cost of the other.
            left = np.linalg.norm(rows.residual[where]) / np.linalg.norm(given - clean)
            assert 0.7 < left < 1.1


def test_a_gain_without_prediction_below_the_limit_is_refused_with_the_prediction(method, noisy, heavy, found):
    loose = found(method)
    worst = int(np.argmax([joint.predicted_rel_std for joint in loose.joints]))
    limit = loose.joints[worst].predicted_rel_std
    at = estimated(method, *noisy, heavy, replace(LOOSE, max_rel_std=limit))
    below = estimated(method, *noisy, heavy, replace(LOOSE, max_rel_std=limit * (1.0 - 1e-12)))
    assert isinstance(at.joints[worst], IdentifiedGain)
    refused = below.joints[worst]
    assert isinstance(refused, RefusedGain)
    assert refused.predicted_rel_std == limit
    said = rf"predicted standard deviation {100.0 * limit:.3g} % of the gain exceeds.* N m rms on this joint"
    assert re.search(said, refused.reason)


def test_the_stated_uncertainty_of_the_mass_reaches_every_gain(method, noisy, heavy, found):
    sure = replace(heavy, mass_std=0.0)
    estimate = found(method)
    before, moved = (estimated(method, *noisy, replace(sure, mass=heavy.mass + by), LOOSE) for by in (0.0, 1e-4))
    # A finite difference of a smooth function; the limits are those of a share of 1e-5 in the mass.
    derivative = (values(moved) / values(before) - 1.0) / 1e-4
    shares = [joint.payload_rel_std for joint in estimate.joints]
    np.testing.assert_allclose(shares, np.abs(derivative) * 0.03, rtol=2e-3)
    for joint in estimate.joints:
        parts = joint.residual_std**2 + joint.payload_std**2 + joint.model_std**2
        np.testing.assert_allclose(joint.std**2, parts, rtol=1e-12)
        np.testing.assert_allclose(joint.payload_std, joint.payload_rel_std * abs(joint.value), rtol=1e-12)


def test_sigma_counts_the_unknowns_of_every_joint(method, found):
    estimate = found(method)
    rows = estimate.solution.rows
    unknowns = sum(rows.unknowns.values())
    assert unknowns > (63 if method == "nls" else 70)  # 58 parameters of the arm and 6 gains; joint by joint, more
    np.testing.assert_allclose(estimate.sigma, np.linalg.norm(rows.residual) / np.sqrt(len(rows.V) - unknowns))
    np.testing.assert_allclose(estimate.rel_error_norm, np.linalg.norm(rows.residual) / np.linalg.norm(rows.V))
