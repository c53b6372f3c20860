"""How much of what compliance does is let in beside encoder noise, against closed forms and noise that is made."""

from dataclasses import replace

import numpy as np
import pytest

from ident.estimation.all_joints.shown_band import NOISE_SHARE, shown_hz, without_encoder_noise
from ident.numerics.signals import decimator, low_passed, smooth_motion
from ident.observation.full_rate import FullRate
from ident.recordings.recording import Recording

PERIOD, CUTOFF = 4e-3, 15.0
M = np.array([[3.1, 0.7], [0.7, 0.4]])
NOISE = np.array([3e-12, 8e-12])
DENSITY = np.array([3.1**2 * (3.1**2 * 3e-12 + 0.7**2 * 8e-12), 0.4**2 * (0.7**2 * 3e-12 + 0.4**2 * 8e-12)])
"""Of the noise that unit accelerations give, M_kk^2 (sum over l of M_kl^2 N_l)."""


def full_rate(noise: np.ndarray, samples: int = 100_000, cutoff_hz: float = CUTOFF) -> FullRate:
    q = np.zeros((samples, len(noise)))
    return FullRate(
        q=q,
        dq=q,
        ddq=q,
        moving=np.ones(q.shape, dtype=bool),
        period=PERIOD,
        cutoff_hz=cutoff_hz,
        decimator=decimator(PERIOD, 10.0, 12),
        edge=0,
        group=1,
        noise=noise,
        recording=Recording(PERIOD * np.arange(samples), *2 * (np.arange(q.size, dtype=float).reshape(q.shape),)),
        current_delay=0.0,
    )


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
    found = shown_hz(full_rate(NOISE, cutoff_hz=40.0), own, M**2)
    np.testing.assert_allclose(found, expected - 2.0 / 3.0, rtol=0, atol=0.4)


def test_what_is_nothing_but_encoder_noise_is_known_as_that(white):
    # The fourth derivative of white noise, low-passed as positions are, as loud as unit accelerations make it.
    quiet = smooth_motion(smooth_motion(white, PERIOD, CUTOFF)[2], PERIOD, 100.0)[2][2000:-2000]
    own = quiet * np.sqrt(DENSITY / (2.0 * PERIOD))
    for share, whole in ((0.75, True), (1.35, False)):
        found = shown_hz(full_rate(share * NOISE_SHARE * NOISE), own, M**2)
        assert ((found == CUTOFF) == whole).all()


def test_a_compliance_is_slowed_by_its_own_noise_and_no_other_is(white):
    softened = np.stack((white, 1.7 * white[::-1]), axis=2)[:6000]
    loud = full_rate(np.array([0.0, 1.4e-17]), samples=6000)
    M2 = np.array([[9.0, 0.0], [0.0, 4.0]])
    limit = shown_hz(loud, np.einsum("skk->sk", softened), M2)
    assert limit[0] == CUTOFF
    assert 0.5 < limit[1] < 10.0
    found = without_encoder_noise(loud, softened, M2)
    np.testing.assert_array_equal(found[:, :, 0], softened[:, :, 0])
    np.testing.assert_array_equal(found[:, :, 1], low_passed(softened[:, :, 1], PERIOD, limit[1]))
    silent = replace(loud, noise=np.zeros(2), cutoff_hz=14.9)  # between two lines of a spectrum
    np.testing.assert_array_equal(without_encoder_noise(silent, softened, M2), softened)


def test_of_what_noise_drowns_at_every_frequency_only_the_slowest_is_let_in(white):
    found = shown_hz(full_rate(NOISE), 1e-12 * white, M**2)
    np.testing.assert_allclose(found, 0.25, rtol=1e-12)  # one line of spectra of 60 periods of 15 Hz
