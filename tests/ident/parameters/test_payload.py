"""Payloads from currents with the gains known; the paper's own least squares, whose gains are uncertain."""

from dataclasses import replace

import numpy as np
import pytest
from exact import GAIN, exact_problem
from refusals import refused
from weighings import PLAIN, UNKNOWN, known, weighed

from ident.estimation.known_gains import KnownGains, Shares
from ident.estimation.problem import Columns
from ident.model.parameters import INERTIAL
from ident.numerics.least_squares import row_weights
from ident.parameters.payload import PaperEstimate, body_values, payload_as_in_paper, payload_of
from ident.parameters.weighing import verified
from ident.payload.payload import Payload, standard_parameters
from ident.support.errors import GainsError, NotIdentifiable


def test_exact_currents_give_every_parameter_of_the_payload(weighed_payload, heavy):
    assert weighed_payload.names == INERTIAL
    # Noise of 1e-9 of each joint's rms current, some 100 times the smallest parameter's share, amplified by cond < 1e3.
    np.testing.assert_allclose(weighed_payload.value, heavy.known_part().chi, rtol=0, atol=1e-5)
    body = weighed_payload.body
    values = {each.name: each.value for each in body.quantities}
    np.testing.assert_allclose(values["mass"], 7.025, rtol=1e-6)
    np.testing.assert_allclose([values[axis] for axis in "xyz"], heavy.com, atol=1e-6)
    np.testing.assert_allclose([values[key] for key in ("ixx", "izz", "iyz")], [0.012146, 0.008659, 0.0], atol=1e-4)
    assert body.possible
    assert not body.refused


def test_uncertainty_of_gains_is_the_change_they_cause(structure, heavy, rng):
    noisy = weighed(structure, heavy, rng, noise=1e-6)
    rel_std = np.array([0.0, 0.0, 0.0, 0.02, 0.0, 0.0])
    found = payload_of(noisy, known(rel_std=rel_std), PLAIN)
    step = 1e-4
    more = payload_of(noisy, known(GAIN * (1.0 + step * (rel_std > 0))), PLAIN)
    slope = (more.value - payload_of(noisy, known(), PLAIN).value) / step
    # A difference over a step of 1e-4 of what is linear but for the residual, which the linearisation leaves out.
    np.testing.assert_allclose(np.sqrt(np.diag(found.shares.gains)), 0.02 * np.abs(slope), rtol=1e-3, atol=1e-6)
    np.testing.assert_allclose(found.shares.gains, 0.02**2 * np.outer(slope, slope), rtol=3e-3, atol=1e-8)


def test_a_joint_whose_gain_is_not_known_changes_nothing_but_the_deviation(weighed_problem, heavy):
    found = payload_of(weighed_problem, known(joints=[0, 1, 2, 4, 5]), PLAIN)
    np.testing.assert_allclose(found.value, heavy.known_part().chi, rtol=0, atol=1e-5)


def test_deviations_of_a_payload_are_those_of_the_draws(structure, heavy):
    # Draws of noise and gains. Ten parameters: the rms of 120 z-scores has a deviation of 6.5 % where they are
    # independent, and more for those that are not.
    rel_std, z = np.full(6, 0.02), []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        noisy = weighed(structure, heavy, rng, noise=0.02)
        gains = known(GAIN * np.exp(rel_std * rng.standard_normal(6)), rel_std)
        found = payload_of(noisy, gains, PLAIN)
        z.append((found.value - heavy.known_part().chi) / np.sqrt(np.diag(found.shares.total)))
    assert 0.85 < np.sqrt(np.mean(np.square(z))) < 1.15
    assert 0.9 < np.mean(np.abs(z) < 2.0) < 0.99


def test_what_cannot_give_a_payload_is_refused(weighed_problem):
    for which, words in ((slice(0, 1), "no motion carries a payload"), (slice(1, 2), "no motion is bare")):
        with pytest.raises(NotIdentifiable, match=words):
            payload_of(replace(weighed_problem, motions=weighed_problem.motions[which]), known(), PLAIN)
    three = KnownGains(names=("a", "b", "c"), joints=np.arange(1), value=np.ones(1) * 2, covariance=np.eye(1))
    refused(GainsError, "gains of 3 joints", payload_of, weighed_problem, three, PLAIN)


def test_body_values_undo_huygens_and_steiner():
    mass, com, inertia = 3.7, (0.11, -0.23, 0.31), (0.05, 0.06, 0.04, 0.003, -0.002, 0.004)
    found = body_values(standard_parameters(mass, com, inertia))
    np.testing.assert_allclose(found, [mass, *com, *inertia], rtol=1e-12)  # rounding


def test_deviations_of_a_body_follow_from_those_of_its_parameters(weighed_payload):
    rng = np.random.default_rng(5)
    factor = 1e-7 * rng.standard_normal((10, 10))
    shares = Shares(residual=factor @ factor.T, gains=0.0 * factor, model=4.0 * factor @ factor.T)
    body = replace(weighed_payload, shares=shares).body
    moved = [body_values(weighed_payload.value + column) - body_values(weighed_payload.value) for column in factor.T]
    std = np.linalg.norm(moved, axis=0)  # steps of 1e-7: of second order 1e-7 of themselves
    np.testing.assert_allclose([each.residual_std for each in body.quantities], std, rtol=1e-4)
    np.testing.assert_allclose([each.model_std for each in body.quantities], 2.0 * std, rtol=1e-4)
    np.testing.assert_allclose([each.std for each in body.quantities], np.sqrt(5.0) * std, rtol=1e-4)


def test_a_mass_that_may_be_zero_has_no_centre(weighed_payload):
    for sure, std in ((True, 2.3), (False, 2.4)):  # three deviations of 7.025 kg are 2.342
        covariance = np.diag([1e-12] * 9 + [std**2])
        shares = Shares(residual=covariance, gains=0.0 * covariance, model=0.0 * covariance)
        body = replace(weighed_payload, shares=shares).body
        assert body.of("mass") is not None
        assert (body.of("x") is not None) == sure
        if not sure:
            assert body.refused["x"] == "the mass is less than 3 standard deviations above zero"
            np.testing.assert_allclose(body.of("mass").std, 2.4, rtol=1e-9)
    assert replace(weighed_payload, value=weighed_payload.value - np.eye(10)[0]).body.possible is False  # XX < 0


def test_what_shows_only_with_others_is_refused_by_name(weighed_problem):
    structure = weighed_problem.structure
    turning = structure.payload_probes.copy()
    turning[:, :, 3] = 2.0 * turning[:, :, 0]
    together = replace(weighed_problem, structure=replace(structure, payload_probes=turning))
    found = payload_of(together, known(), PLAIN)
    assert set(found.refused) == {"XX", "YY"}
    assert len(found.names) == 8
    body = found.body
    assert body.possible is None
    assert "XX: only its sum with other parameters is identifiable" in body.refused["ixx"]
    assert body.of("x") is not None
    unsure = replace(found, refused=found.refused | {"M": "unseen"})
    refused(NotIdentifiable, "the payload's M: unseen", verified, unsure, replace(UNKNOWN, known="mass"), known(), "")


NONE = np.zeros(6)
WEIGHED = Payload(mass=3.3, known="mass")


def system(structure, heavy: Payload, rng: np.random.Generator, noise: float = 0.0, rows: int = 300) -> Columns:
    motions = [(chi := rng.uniform(0.5, 2.0, 84), None, None), (chi, heavy, WEIGHED)]
    return Columns.of(exact_problem(structure, motions, GAIN, rng, noise=noise, rows=rows).motions)


def values(estimate: PaperEstimate) -> np.ndarray:
    return np.array([p.value for p in estimate.parameters])


def test_exact_data_give_the_exact_payload(structure, heavy, rng):
    rows = system(structure, heavy, rng, noise=1e-12)
    found = payload_as_in_paper(rows, GAIN, NONE)
    # Noise of 1e-12 of currents that are a thousand times the smallest parameter's share.
    np.testing.assert_allclose(values(found), heavy.known_part().chi, rtol=0, atol=1e-8)
    assert found.unknowns == rows.W.shape[1] + 10


def test_weights_make_sigma_one_and_deviations_those_of_the_draws(structure, heavy):
    # Ten parameters: of 30 draws the rms z-score has a deviation of 4 %, of which the bound is two.
    z, sigma = [], []
    for seed in range(30):
        rows = system(structure, heavy, np.random.default_rng(seed), noise=0.02, rows=60)
        found = payload_as_in_paper(rows, GAIN, NONE)
        z.append((values(found) - heavy.known_part().chi) / [p.residual_std for p in found.parameters])
        sigma.append(found.sigma)
    assert abs(np.sqrt(np.mean(np.square(z))) - 1.0) < 0.08
    np.testing.assert_allclose(np.mean(sigma), 1.0, atol=0.01)


def test_errors_are_relative_to_all_torque_and_a_gain_is_as_uncertain_as_the_change_it_causes(structure, heavy, rng):
    rows = system(structure, heavy, rng, noise=0.3)
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
