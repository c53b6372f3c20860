from dataclasses import replace

import numpy as np
from exact import EXACT, GAIN, TRUSTING, drive_gains, exact_pair, lopsided, sequential_gains, values

from ident.estimation.estimators.sequential_2011 import first_moments
from ident.estimation.joint_by_joint import joint_fit
from ident.estimation.problem import GainOptions, pair
from ident.payload.payload import Payload


def test_exact_data_give_every_gain_from_the_mass_alone(structure, payload, rng):
    heavy = lopsided(payload)
    motions = exact_pair(structure, heavy, GAIN, rng)
    estimate = sequential_gains(*motions, Payload(mass=heavy.mass, known="mass"), TRUSTING)
    np.testing.assert_allclose(values(estimate), GAIN, rtol=100 * EXACT)  # two solutions in a row


def test_first_moments_of_exact_data_are_exact(structure, payload, rng):
    heavy = lopsided(payload)
    problem = pair(*exact_pair(structure, heavy, GAIN, rng), heavy, TRUSTING)
    mass = Payload(mass=heavy.mass, known="mass").known_part()
    moments = first_moments(problem, [joint_fit(problem, j, [mass]) for j in (0, 1, 2)], mass)
    np.testing.assert_allclose(moments.value, heavy.mass * np.array(heavy.com), rtol=100 * EXACT)


def test_deviations_carry_the_errors_of_the_steps_before(structure, payload):
    # 60 draws of three gains that rest on estimated moments: the rms z-score has a standard deviation of
    # 1 / sqrt(2 * 180) = 5.3 %; 19 % is left by chance once in 3000 seeds, not so if step 2's error were dropped.
    heavy, z, dropped = lopsided(payload), [], []
    light = Payload(mass=heavy.mass, known="mass")
    for seed in range(60):
        motions = exact_pair(structure, heavy, GAIN, np.random.default_rng(seed), noise=0.003, rows=120)
        options = GainOptions(max_rel_std=10.0, uncertainty="classical")
        estimate, known = sequential_gains(*motions, light, options), drive_gains(*motions, heavy, options)
        for j in (3, 4, 5):
            error = estimate.joints[j].value - GAIN[j]
            z.append(error / estimate.joints[j].residual_std)
            dropped.append(error / known.joints[j].residual_std)
    rms = np.sqrt(np.mean(np.square(z)))
    assert abs(rms - 1.0) < 0.19
    assert np.sqrt(np.mean(np.square(dropped))) > 1.2 * rms


def test_the_moments_are_handed_over_with_the_deviations_of_residuals_and_mass(structure, payload):
    # 50 draws of three moments: the rms z-score has a standard deviation of 1 / sqrt(2 * 150) = 6 %.
    heavy, z = lopsided(payload), []
    light = Payload(mass=heavy.mass, known="mass")
    for seed in range(50):
        motions = exact_pair(structure, heavy, GAIN, np.random.default_rng(seed), noise=0.003, rows=120)
        found = sequential_gains(*motions, light, GainOptions(max_rel_std=10.0, uncertainty="classical")).payload
        assert [parameter.name for parameter in found] == ["MX", "MY", "MZ"]
        true = heavy.mass * np.array(heavy.com)
        z += [(parameter.value - t) / parameter.std for parameter, t in zip(found, true, strict=True)]
    assert abs(np.sqrt(np.mean(np.square(z))) - 1.0) < 4 * 0.06
    before, after = (
        sequential_gains(*motions, replace(light, mass_std=std), GainOptions(max_rel_std=10.0)).payload
        for std in (0.0, 0.07)
    )
    for a, b in zip(before, after, strict=True):
        np.testing.assert_allclose(b.std**2, a.std**2 + (0.07 / heavy.mass * a.value) ** 2, rtol=1e-9)


def test_the_friction_of_a_later_joint_moves_with_the_moments_that_it_rests_on(structure, payload, monkeypatch):
    monkeypatch.setattr(
        "ident.estimation.estimators.sequential_2011.row_weights",
        lambda W, Y, groups: np.array([1.3, 0.7, 2.1])[groups],
    )
    heavy = lopsided(payload)
    bare, loaded = exact_pair(structure, heavy, GAIN, np.random.default_rng(3), noise=1e-5, rows=120)
    light = Payload(mass=heavy.mass, known="mass")
    estimate = sequential_gains(bare, loaded, light, TRUSTING)
    row, ends = 29, []
    h = 1e-5 * float(np.sqrt(np.mean(loaded.joints[1].V ** 2)))
    for sign in (-1.0, 1.0):
        V = loaded.joints[1].V.copy()
        V[row] += sign * h
        joints = list(loaded.joints)
        joints[1] = replace(joints[1], V=V)
        moved = replace(loaded, joints=tuple(joints))
        ends.append(sequential_gains(bare, moved, light, TRUSTING).solution.friction)
    derivative = (ends[1] - ends[0]) / (2.0 * h)
    solution = estimate.solution
    at = solution.rows.of(1).start + 120 + row
    # Of first order in the noise, 1e-5, and a central difference whose rounding is some 1e-4 of so small a part.
    np.testing.assert_allclose(derivative[3:], solution.friction_influence[3:, :, at], rtol=0.03)
