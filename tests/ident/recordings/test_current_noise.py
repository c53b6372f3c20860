"""Copies of recordings that were resampled, shifted, smoothed or truncated, and repetitions of one motion."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ident.numerics.signals import low_passed
from ident.recordings.copies import share_samples
from ident.recordings.current_noise import current_noise, has_noise, noisiest, same_noise, unpacked
from ident.recordings.recording import Recording


def motion(seed: int, rate: float = 500.0, seconds: float = 17.0) -> Recording:
    """One motion of three joints, with friction at reversals and 5 % of white noise of its own."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, seconds, 1.0 / rate)
    phase = 2.0 * np.pi * np.outer(t, [0.31, 0.43, 0.57]) + np.array([0.3, 1.1, 2.2])
    q, dq = np.sin(phase) + 0.4 * np.cos(1.7 * phase), np.cos(phase) - 0.68 * np.sin(1.7 * phase)
    v = 3.0 * q + 0.7 * np.tanh(50.0 * dq)
    noisy = v + 0.05 * np.std(v, axis=0) * rng.standard_normal(v.shape)
    return Recording(t, q + 2e-6 * rng.standard_normal(q.shape), noisy, f"motion {seed}")


def over_time(recording: Recording, change: Callable[[np.ndarray], np.ndarray]) -> Recording:
    return replace(recording, q=change(recording.q), v=change(recording.v))


def interpolated(recording: Recording, t: np.ndarray) -> Recording:
    q, v = (np.column_stack([np.interp(t, recording.t, x) for x in each.T]) for each in (recording.q, recording.v))
    return Recording(t, q, v, "copy")


def averaged(x: np.ndarray, samples: int = 15) -> np.ndarray:
    return np.column_stack([np.convolve(column, np.full(samples, 1 / samples), "same") for column in x.T])


def truncated(recording: Recording) -> Recording:
    kept = slice(2000, 4700)
    return Recording(recording.t[kept] - 4.0, recording.q[kept], recording.v[kept], "copy")


def later(recording: Recording) -> Recording:
    return replace(recording, t=recording.t + 41.3)


COPIES = {
    "shifted by part of a sample": lambda x: interpolated(x, x.t[3:-3] + 7e-4),
    "resampled at 77 Hz": lambda x: interpolated(x, np.arange(x.t[0] + 1e-4, x.t[-1], 1 / 77)),
    "averaged over 30 ms": lambda x: over_time(x, averaged),
    "averaged over 50 ms": lambda x: over_time(x, lambda y: averaged(y, 25)),
    "low-passed at 20 Hz": lambda x: over_time(x, lambda y: low_passed(y, x.period, 20.0)),
    "smoothed, truncated, later and resampled": lambda x: interpolated(
        later(truncated(over_time(x, averaged))), np.arange(41.35, 46.2, 1 / 170)
    ),
    "the last part": lambda x: interpolated(x, x.t[5400:-3] + 7e-4),
    "later and resampled at 77 Hz": lambda x: interpolated(later(x), np.arange(41.3001, 58.2, 1 / 77)),
}


@pytest.mark.parametrize("copy", COPIES)
def test_a_copy_has_the_noise_of_its_original(copy):
    original = motion(3)
    copied = COPIES[copy](original)
    assert not share_samples(copied, original)  # no row is the same
    assert same_noise(copied, original)
    assert same_noise(original, copied)


def test_a_repetition_has_a_noise_of_its_own():
    assert same_noise(motion(3), motion(3))
    assert not same_noise(motion(3), motion(4))
    assert not same_noise(truncated(motion(3)), motion(4))
    assert not same_noise(motion(3), motion(4, rate=130.0))


def test_the_noise_of_one_joint_recognises_copies_by_a_packed_text():
    noise = noisiest(current_noise(motion(3)))
    kept = unpacked(noise.rate, noise.joints[0], noise.packed())
    np.testing.assert_array_equal(kept.x, noise.x)
    # Aliased noise is its own: a slower copy that was not low-passed is recognised by its original alone.
    for name in ("shifted by part of a sample", "averaged over 30 ms", "low-passed at 20 Hz"):
        assert has_noise(COPIES[name](motion(3)), kept)
    assert not has_noise(motion(4), kept)
    assert not has_noise(over_time(motion(3), lambda x: x[:, : noise.joints[0]]), kept)  # fewer joints


def test_the_noisiest_joint_is_neither_the_one_with_peaks_nor_the_smooth_one():
    log = motion(3)
    peaks = np.where(np.arange(len(log.t)) % 500 < 3, 9.0, log.v[:, 0])
    v = np.column_stack((peaks, log.v[:, 1], 3.0 * np.sin(2.0 * log.t)))
    assert noisiest(current_noise(replace(log, v=v))).joints == (1,)


def test_too_little_in_common_says_nothing():
    log = motion(3)
    brief = interpolated(log, np.arange(1.0003, 2.5, log.period))
    assert not same_noise(brief, log)
    assert not same_noise(log, over_time(log, lambda x: x[:, :2]))
