"""How much noise and how coarse: a log against its own neighbours."""

import re

import numpy as np
from diagnoses import named
from known_logs import fourier

from ident.diagnosis.diagnosis import Severity
from ident.diagnosis.motion_quality import acceleration_noise, noise, noise_std
from ident.numerics.neighbours import quantum
from ident.numerics.signals import smooth_motion
from ident.observation.observation import ObserveOptions
from ident.recordings.recording import Recording

OPTIONS = ObserveOptions()


def test_noise_is_that_which_was_added_whatever_moves_beneath(rng):
    t = np.arange(0.0, 20.0, 0.008)
    q = fourier(rng, np.array([0.3, -1.1]))(t)[0]
    sigma = np.array([3e-3, 7e-3])
    found = noise_std(q + sigma * rng.normal(size=q.shape))
    # a median of 2500 correlated sizes: some 3 % of itself
    np.testing.assert_allclose(found, sigma, rtol=0.12)
    assert (noise_std(np.zeros((4, 2))) == 0.0).all()


def test_the_quantum_is_the_step_of_an_encoder_and_none_where_noise_is_finer(rng):
    angle = np.cumsum(rng.normal(0.0, 0.01, 3000))
    np.testing.assert_allclose(quantum(np.round(angle / 0.0037) * 0.0037), 0.0037, rtol=1e-9)  # rounding
    np.testing.assert_allclose(quantum(np.round(angle, 3)), 0.001, rtol=1e-9)
    assert quantum(angle) is None
    assert quantum(rng.choice([0.0, 1.0, 1.37, 2.9], 1000)) is None  # few values, but of no step
    assert quantum(np.array([0.0, 1.0, 0.0])) is None


def test_a_step_that_a_file_rounds_in_two_ways_is_one(rng):
    counts = np.cumsum(rng.integers(-3, 4, 3000))
    either = rng.random(3000) < 0.5
    angle = np.where(either, counts * 0.001, counts / 1000.0)
    assert len(np.unique(angle)) > len(np.unique(counts))  # some differ by the last digit
    np.testing.assert_allclose(quantum(angle), 0.001, rtol=1e-9)  # rounding


def test_values_are_few_by_the_steps_between_them_not_by_their_last_digits():
    counts = np.arange(3, 40)  # 37 values, 36 steps
    angle = np.concatenate([counts * 0.001, counts / 1000.0])
    np.testing.assert_allclose(quantum(angle[1:]), 0.001, rtol=1e-9)  # 73 samples, two of all values but one
    assert quantum(angle[2:]) is None
    assert quantum(angle[[0, 1, 37, 38]]) is None  # two values


def test_noise_of_an_acceleration_is_that_of_the_filtered_noise(ur_log):
    white = np.random.default_rng(3).normal(0.0, 3e-4, ur_log.q.shape)
    loud = Recording(ur_log.t, ur_log.q + white, ur_log.v)
    inner = slice(20, -20)
    ddq, alone = (smooth_motion(x, ur_log.period, OPTIONS.cutoff_hz)[2][inner] for x in (loud.q, white))
    share = np.sqrt(np.mean(alone**2, axis=0) / np.mean(ddq**2, axis=0))
    np.testing.assert_allclose(acceleration_noise(loud, OPTIONS), share, rtol=0.15)  # 20 s at 15 Hz: 600 values
    assert named(noise(ur_log, OPTIONS), "noise of q").severity is Severity.GOOD


def test_the_coarsest_encoder_is_named(ur_log):
    step = np.array([0.0, 0.0037, 0.0, 0.0, 0.0011, 0.0])
    q = np.where(step > 0.0, np.round(ur_log.q / np.where(step > 0.0, step, 1.0)) * step, ur_log.q)
    found = named(noise(Recording(ur_log.t, q, ur_log.v), OPTIONS), "encoder resolution")
    assert found.sentence == "the coarsest encoder has steps of 0.0037 rad or m (q2)"
    assert named(noise(ur_log, OPTIONS), "encoder resolution").sentence == "encoder steps are finer than the noise"


def test_noise_that_counts_is_weak_and_names_the_joint(ur_log):
    q = ur_log.q + np.array([0, 0, 0, 0, 2e-3, 0]) * np.random.default_rng(4).normal(size=ur_log.q.shape)
    found = named(noise(Recording(ur_log.t, q, ur_log.v), OPTIONS), "noise of q")
    assert (found.severity, found.joints) == (Severity.WEAK, (4,))
    assert found.sentence.startswith("q5 has noise of 0.00")
    v = ur_log.v + np.array([0, 0.6, 0, 0, 0, 0]) * ur_log.v.std(axis=0) * np.random.default_rng(5).normal(
        size=ur_log.v.shape
    )
    for standing in (0.0, 50.0):  # a current that holds a weight is not the less noisy
        found = named(noise(Recording(ur_log.t, ur_log.q, v + standing), OPTIONS), "noise of v")
        assert (found.severity, found.joints) == (Severity.WEAK, (1,))
        assert re.fullmatch(r"v2 has noise of 5[01] % of its standard deviation", found.sentence)  # 0.6 / hypot(1, 0.6)
