"""How much of what compliance does is let in beside encoder noise, against closed forms and noise that is made."""

from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import logs_of, problem_of, ready_of
from exact import full_rate
from real_friction import Truth

from ident.estimation.all_joints import fit
from ident.estimation.sweep import NOISE_SHARE, inertia_matrices, shown_hz
from ident.estimation.terms import torques_of
from ident.numerics.signals import low_passed, smooth_motion
from ident.observation.full_rate import FullRate

PERIOD, CUTOFF = 4e-3, 15.0
M = np.array([[3.1, 0.7], [0.7, 0.4]])
NOISE = np.array([3e-12, 8e-12])
DENSITY = np.array([3.1**2 * (3.1**2 * 3e-12 + 0.7**2 * 8e-12), 0.4**2 * (0.7**2 * 3e-12 + 0.4**2 * 8e-12)])
"""Of the noise that unit accelerations give, M_kk^2 (sum over l of M_kl^2 N_l)."""


def still(noise: np.ndarray, cutoff_hz: float = CUTOFF) -> FullRate:
    return full_rate(np.zeros((100_000, len(noise))), noise, period=PERIOD, cutoff_hz=cutoff_hz)


@pytest.fixture(scope="module")
def white() -> np.ndarray:
    return np.random.default_rng(4).standard_normal((100_000, 2))


def test_noise_is_let_in_up_to_its_share_of_the_power(white):
    # P f of a white signal against D (2 pi)^8 f^9 / 9 of the noise: equal shares at f^8 = 9 share P / (D (2 pi)^8).
    expected = np.array([7.3, 13.6])
    power = DENSITY * (2.0 * np.pi) ** 8 * expected**8 / (9.0 * NOISE_SHARE)
    own = white * np.sqrt(power / (2.0 * PERIOD))
    # Spectra of 60 periods have lines each 2/3 Hz, of which the last one counts whole: the limit is half a line to one
    # and a half too low.
    found = shown_hz(still(NOISE, cutoff_hz=40.0), own, M**2)
    np.testing.assert_allclose(found, expected - 2.0 / 3.0, rtol=0, atol=0.4)


def test_what_is_nothing_but_encoder_noise_is_known_as_that(white):
    # The fourth derivative of white noise, low-passed as positions are, as loud as unit accelerations make it.
    quiet = smooth_motion(smooth_motion(white, PERIOD, CUTOFF)[2], PERIOD, 100.0)[2][2000:-2000]
    own = quiet * np.sqrt(DENSITY / (2.0 * PERIOD))
    for share, whole in ((0.75, True), (1.35, False)):
        found = shown_hz(still(share * NOISE_SHARE * NOISE), own, M**2)
        assert ((found == CUTOFF) == whole).all()


def test_a_compliance_is_slowed_by_its_own_noise_and_no_other_is(axes):
    # Encoder noise of the second joint alone, as loud as its compliance below some Hz.
    problem = problem_of(axes, logs_of(Truth()))
    ready = ready_of(problem)
    torques = torques_of(ready, fit(ready, {}, None).theta)[0]
    softened, behind = torques.softened(), torques.sweep.behind
    plain = torques.sweep.rows(softened)
    inertia = np.mean(inertia_matrices(torques.arm, torques.links.chi, behind.states.q) ** 2, axis=0)
    own = torques.sweep.at_full_rate(np.einsum("skk->sk", softened))
    inertia[0, 1] = inertia[2, 1] = 0.0
    noise = np.array([0.0, 1e-12, 0.0])
    while shown_hz(replace(behind, noise=noise), own, inertia)[1] > 8.0:
        noise *= 2.0
    loud = replace(behind, noise=noise)
    limit = shown_hz(loud, own, inertia)
    assert limit[0] == limit[2] == CUTOFF
    motion = replace(problem.motions[0], observation=replace(problem.motions[0].observation, full_rate=loud))
    sweep = replace(torques.sweep, problem=replace(problem, motions=(motion, problem.motions[1])))
    found = replace(torques, sweep=sweep).slowed(softened)
    slow = low_passed(torques.sweep.at_full_rate(softened[:, :, 1]), behind.period, limit[1])
    np.testing.assert_array_equal(found[:, 1], sweep.decimated(slow[:, :, None])[:, 0])
    assert np.abs(found[:, 1] - plain[:, 1]).max() > 1e-4 * np.abs(plain[:, 1]).max()


def test_of_what_noise_drowns_at_every_frequency_only_the_slowest_is_let_in(white):
    found = shown_hz(still(NOISE), 1e-12 * white, M**2)
    np.testing.assert_allclose(found, 0.25, rtol=1e-12)  # one line of spectra of 60 periods of 15 Hz
