from dataclasses import replace

import numpy as np
from exact import EXACT, GAIN, TRUSTING, drive_gains, exact_pair, lopsided, sequential_gains, values

from ident.first_moments import first_moments
from ident.joint_fit import joint_fit
from ident.options import GainOptions
from ident.payload import Payload
from ident.problem import pair


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


def test_uncertainty_of_the_mass_reaches_every_gain_in_full(structure, payload, rng):
    heavy = lopsided(payload)
    motions = exact_pair(structure, heavy, GAIN, rng, noise=1e-3)
    light = Payload(mass=heavy.mass, mass_std=0.1, known="mass")
    before = sequential_gains(*motions, light, TRUSTING)
    after = sequential_gains(*motions, replace(light, mass=1.01 * light.mass), TRUSTING)
    np.testing.assert_allclose(
        values(after), 1.01 * values(before), rtol=1e-6
    )  # moments scale with the mass, inertias not
    np.testing.assert_allclose([j.payload_rel_std for j in before.joints], 0.1 / heavy.mass, rtol=1e-9)


def test_deviations_carry_the_errors_of_the_steps_before(structure, payload):
    # 300 draws of three gains that rest on estimated moments: the rms z-score has a standard deviation of
    # 1 / sqrt(2 * 900) = 2.4 %; 12 % is left by chance once in a million seeds, not so if step 2's error were dropped.
    heavy, z, dropped = lopsided(payload), [], []
    light = Payload(mass=heavy.mass, known="mass")
    for seed in range(300):
        motions = exact_pair(structure, heavy, GAIN, np.random.default_rng(seed), noise=0.003, rows=120)
        estimate = sequential_gains(*motions, light, GainOptions(max_rel_std=10.0))
        known = drive_gains(*motions, heavy, GainOptions(max_rel_std=10.0))
        for j in (3, 4, 5):
            error = estimate.joints[j].value - GAIN[j]
            z.append(error / estimate.joints[j].std)
            dropped.append(error / known.joints[j].std)
    rms = np.sqrt(np.mean(np.square(z)))
    assert abs(rms - 1.0) < 0.12
    assert np.sqrt(np.mean(np.square(dropped))) > 1.2 * rms
