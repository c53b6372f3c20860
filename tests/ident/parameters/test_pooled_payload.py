import numpy as np
import pytest
from exact import EXACT, exact_observation, lopsided

from ident.estimation.joint_by_joint.pooled_system import PooledSystem, pooled_system
from ident.estimation.problem import ObservedMotion
from ident.model.parameters import INERTIAL
from ident.numerics.least_squares import row_weights
from ident.parameters.pooled_payload import PayloadEstimate, payload_parameters
from ident.payload.payload import Payload
from ident.support.errors import IdentificationError, PayloadError

GAIN = np.array([0.9401, 0.9619, 1.1148, -0.9146, 2.0, 0.5])
NONE = np.zeros(6)
WEIGHED = Payload(mass=3.3, known="mass")


def system(
    structure, chi_payload: np.ndarray, rng: np.random.Generator, noise: float = 0.0, rows: int = 300
) -> PooledSystem:
    chi = rng.uniform(0.5, 2.0, 84)
    bare, heavy = (
        exact_observation(structure, chi, load, GAIN, rng, noise=noise, rows=rows)
        for load in (np.zeros(10), chi_payload)
    )
    return pooled_system([ObservedMotion(bare, None), ObservedMotion(heavy, WEIGHED)])


def values(estimate: PayloadEstimate) -> np.ndarray:
    return np.array([p.value for p in estimate.parameters])


@pytest.fixture
def chi(payload) -> np.ndarray:
    return lopsided(payload).known_part().chi


@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("known", [(), ("M",), ("M", "MZ", "XX"), INERTIAL])
def test_exact_data_give_the_exact_payload_whatever_is_known(structure, chi, rng, weighted, known):
    given = {name: chi[INERTIAL.index(name)] for name in known}
    rows = system(structure, chi, rng, noise=1e-12)
    found = payload_parameters(rows, GAIN, gain_std=NONE, known=given, weighted=weighted)
    # Noise of 1e-12 of currents that are a thousand times the smallest parameter's share.
    np.testing.assert_allclose(values(found), chi, rtol=0, atol=1e-8)
    assert [p.known for p in found.parameters] == [name in known for name in INERTIAL]
    assert found.unknowns == rows.W.shape[1] + 10 - len(known)


def test_the_error_is_relative_to_all_torque_that_of_known_parameters_included(structure, chi, rng):
    rows = system(structure, chi, rng, noise=0.02)
    given = {name: chi[INERTIAL.index(name)] for name in ("M", "MY")}
    found = payload_parameters(rows, GAIN, gain_std=NONE, known=given, weighted=False)
    torque = GAIN[rows.joint] * rows.V
    np.testing.assert_allclose(found.error_norm, np.linalg.norm(torque - found.torque), rtol=1e-9)
    np.testing.assert_allclose(found.rel_error_norm, found.error_norm / np.linalg.norm(torque), rtol=1e-12)


def test_gains_scaled_by_k_scale_the_payload_by_k(structure, chi, rng):
    rows = system(structure, chi, rng, noise=0.01)
    one, two = (payload_parameters(rows, k * GAIN, gain_std=NONE, known={}, weighted=True) for k in (1.0, 1.2))
    np.testing.assert_allclose(values(two), 1.2 * values(one), rtol=100 * EXACT, atol=1e-12)
    np.testing.assert_allclose(two.rel_error_norm, one.rel_error_norm, rtol=EXACT)


def test_weights_make_sigma_one_and_deviations_those_of_the_draws(structure, chi):
    # 80 draws of ten parameters: the rms z-score has a deviation of 2.5 %, its bound of 8 % is three of them.
    z, sigma = [], []
    for seed in range(80):
        rows = system(structure, chi, np.random.default_rng(seed), noise=0.02, rows=150)
        found = payload_parameters(rows, GAIN, gain_std=NONE, known={}, weighted=True)
        z.append((values(found) - chi) / [p.residual_std for p in found.parameters])
        sigma.append(found.sigma)
    assert abs(np.sqrt(np.mean(np.square(z))) - 1.0) < 0.08
    np.testing.assert_allclose(np.mean(sigma), 1.0, atol=0.01)


def test_uncertainty_of_a_gain_is_the_change_it_causes(structure, chi, rng):
    rows = system(structure, chi, rng, noise=0.01)
    h = np.array([0.0, 0.01, 0.0, 0.0, 0.0, 0.0])
    # Unweighted, the solution is linear in the gains: the difference is exact to rounding.
    before, after = (payload_parameters(rows, g, gain_std=h, known={}, weighted=False) for g in (GAIN, GAIN + h))
    changes = np.abs(values(after) - values(before))
    np.testing.assert_allclose([p.gain_std for p in before.parameters], changes, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(np.sqrt(np.diag(before.covariance)), [p.std for p in before.parameters], rtol=1e-9)
    # Weighted, the solution of the same weights is linear in the gains.
    W, torque = np.hstack((rows.W, rows.W_L)), GAIN[rows.joint] * rows.V
    w = row_weights(W, torque, rows.joint)
    slope = np.linalg.pinv(w[:, None] * W, rcond=1e-12) @ (w * (rows.joint == 1) * rows.V)
    found = payload_parameters(rows, GAIN, gain_std=h, known={}, weighted=True)
    moved = np.abs(0.01 * slope[rows.W.shape[1] :])
    np.testing.assert_allclose([p.gain_std for p in found.parameters], moved, rtol=1e-6, atol=1e-12)


def test_wrong_inputs_are_named(structure, chi, rng):
    rows = system(structure, chi, rng)
    with pytest.raises(PayloadError, match=r"gain: 2 values \[1\.0, 1\.0\]; expected 6 finite numbers, one per joint"):
        payload_parameters(rows, np.ones(2), gain_std=NONE, known={}, weighted=True)
    with pytest.raises(PayloadError, match="gain_std: 3 values"):
        payload_parameters(rows, GAIN, gain_std=np.zeros(3), known={}, weighted=True)
    with pytest.raises(PayloadError, match="payload parameter 'mass' is not one of XX, XY"):
        payload_parameters(rows, GAIN, gain_std=NONE, known={"mass": 7.0}, weighted=True)
    bare = exact_observation(structure, np.ones(84), np.zeros(10), GAIN, rng, noise=0.01, rows=100)
    with pytest.raises(IdentificationError, match="no loaded motion; without one the payload cannot be identified"):
        payload_parameters(pooled_system([ObservedMotion(bare, None)]), GAIN, gain_std=NONE, known={}, weighted=True)


def test_what_is_given_is_certain_and_what_is_found_is_not(structure, chi, rng):
    given = {name: chi[INERTIAL.index(name)] for name in ("M", "YZ")}
    rows = system(structure, chi, rng, noise=0.01)
    found = payload_parameters(rows, GAIN, gain_std=0.01 * np.abs(GAIN), known=given, weighted=True)
    for name in INERTIAL:
        certain = {found[name].residual_std, found[name].gain_std, found[name].std} == {0.0}
        assert certain == (name in given)
        essential = name not in given and found[name].residual_std < 0.1 * abs(found[name].value)
        assert found[name].essential == essential
    assert found["ZZ"].essential
