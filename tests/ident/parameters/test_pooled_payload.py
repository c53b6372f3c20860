"""The paper's own least squares of a payload: exact rows, draws, and gains that are uncertain."""

import numpy as np
import pytest
from exact import exact_observation, lopsided

from ident.estimation.problem import ObservedMotion
from ident.estimation.rows import Columns
from ident.numerics.least_squares import row_weights
from ident.parameters.payload import PaperEstimate, payload_as_in_paper
from ident.payload.payload import Payload

GAIN = np.array([0.9401, 0.9619, 1.1148, -0.9146, 2.0, 0.5])
NONE = np.zeros(6)
WEIGHED = Payload(mass=3.3, known="mass")


def system(
    structure, chi_payload: np.ndarray, rng: np.random.Generator, noise: float = 0.0, rows: int = 300
) -> Columns:
    chi = rng.uniform(0.5, 2.0, 84)
    bare, heavy = (
        exact_observation(structure, chi, load, GAIN, rng, noise=noise, rows=rows)
        for load in (np.zeros(10), chi_payload)
    )
    return Columns.of([ObservedMotion(bare, None), ObservedMotion(heavy, WEIGHED)])


def values(estimate: PaperEstimate) -> np.ndarray:
    return np.array([p.value for p in estimate.parameters])


@pytest.fixture
def chi(payload) -> np.ndarray:
    return lopsided(payload).known_part().chi


def test_exact_data_give_the_exact_payload(structure, chi, rng):
    rows = system(structure, chi, rng, noise=1e-12)
    found = payload_as_in_paper(rows, GAIN, NONE)
    # Noise of 1e-12 of currents that are a thousand times the smallest parameter's share.
    np.testing.assert_allclose(values(found), chi, rtol=0, atol=1e-8)
    assert found.unknowns == rows.W.shape[1] + 10


@pytest.mark.parametrize("draws", [30, pytest.param(80, marks=pytest.mark.slow)])
def test_weights_make_sigma_one_and_deviations_those_of_the_draws(structure, chi, draws):
    # Ten parameters: of 80 draws the rms z-score has a deviation of 2.5 %, of which the bound is three; of 30, of 4 %.
    z, sigma = [], []
    for seed in range(draws):
        rows = system(structure, chi, np.random.default_rng(seed), noise=0.02, rows=60)
        found = payload_as_in_paper(rows, GAIN, NONE)
        z.append((values(found) - chi) / [p.residual_std for p in found.parameters])
        sigma.append(found.sigma)
    assert abs(np.sqrt(np.mean(np.square(z))) - 1.0) < 0.08
    np.testing.assert_allclose(np.mean(sigma), 1.0, atol=0.01)


def test_errors_are_relative_to_all_torque_and_a_gain_is_as_uncertain_as_the_change_it_causes(structure, chi, rng):
    rows = system(structure, chi, rng, noise=0.3)
    W, torque = np.hstack((rows.W, rows.carried)), GAIN[rows.joint] * rows.V
    w = row_weights(W, torque, rows.joint)
    found = payload_as_in_paper(rows, GAIN, np.array([0.0, 0.01, 0.0, 0.0, 0.0, 0.0]))
    np.testing.assert_allclose(found.error_norm, np.linalg.norm(w * (torque - found.torque)), rtol=1e-9)
    np.testing.assert_allclose(found.rel_error_norm, found.error_norm / np.linalg.norm(w * torque), rtol=1e-12)
    # The solution with the same weights is linear in the gains.
    slope = np.linalg.pinv(w[:, None] * W, rcond=1e-12) @ (w * (rows.joint == 1) * rows.V)
    moved = np.abs(0.01 * slope[rows.W.shape[1] :])
    np.testing.assert_allclose([p.gain_std for p in found.parameters], moved, rtol=1e-6, atol=1e-12)
    for each, essential in zip(found.parameters, found.essential, strict=True):
        assert essential == (each.residual_std < 0.1 * abs(each.value))
    assert len(set(found.essential)) == 2
    assert found["ZZ"].name == "ZZ"
