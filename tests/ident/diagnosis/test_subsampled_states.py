"""A motion at some instants: filtered as the currents are, no closer than rows."""

from dataclasses import replace

import numpy as np
import pytest
from known_logs import BRICK, UR_GAIN, UR_MIDDLE, known_logs, ur_like

from ident.diagnosis.screening import subsampled_states
from ident.numerics.signals import smooth_motion
from ident.observation.observation import ObserveOptions
from ident.recordings.recording import Recording, resampled

OPTIONS = ObserveOptions()


@pytest.fixture(scope="module")
def logs() -> tuple[Recording, Recording]:
    return known_logs(ur_like(), BRICK, UR_GAIN, np.random.default_rng(11), middle=UR_MIDDLE)


def test_instants_are_of_the_filtered_motion_and_as_many_as_asked_for_at_most(logs):
    log = logs[0]
    at = subsampled_states(log, 150, OPTIONS)
    # 2 samples and 2 periods of 10 Hz at 125 Hz are 27 at either end; 2500 - 54 in at most 150 are every 17th
    q, dq, ddq = smooth_motion(log.q, log.period, OPTIONS.cutoff_hz)
    v = smooth_motion(log.v, log.period, OPTIONS.decimation_cutoff_hz)[0]
    chosen = slice(27, 2500 - 27, 17)
    assert len(at.q) <= 150
    for found, expected in ((at.q, q), (at.dq, dq), (at.ddq, ddq), (at.v, v)):
        np.testing.assert_array_equal(found, expected[chosen])
    slow = np.abs(dq) <= 0.2 * np.sqrt(np.mean(dq[27:-27] ** 2, axis=0))
    np.testing.assert_array_equal(at.moving, ~slow[chosen])


def test_instants_are_no_closer_than_rows(logs):
    assert len(subsampled_states(logs[0], 10_000, OPTIONS).q) == -(-(2500 - 54) // 6)  # 20 a second of 125


def test_a_current_that_acts_late_is_looked_at_late(logs):
    late = subsampled_states(logs[0], 150, replace(OPTIONS, current_delay=2 * logs[0].period))
    shifted = Recording(logs[0].t, logs[0].q, np.vstack((logs[0].v[[0, 0]], logs[0].v[:-2])))
    np.testing.assert_allclose(late.v, subsampled_states(shifted, 150, OPTIONS).v, rtol=1e-9, atol=1e-12)  # rounding


def test_a_jittered_clock_is_made_even_first(logs, rng):
    log = logs[0]
    t = log.t + rng.uniform(-0.002, 0.002, len(log.t))
    uneven = Recording(t, log.q, log.v)
    even = subsampled_states(resampled(uneven), 150, OPTIONS)
    np.testing.assert_array_equal(subsampled_states(uneven, 150, OPTIONS).q, even.q)
    careless = Recording(np.linspace(t[0], t[-1], len(t)), log.q, log.v)  # the samples at times that are not theirs
    assert np.abs(subsampled_states(careless, 150, OPTIONS).q - even.q).max() > 1e-4
