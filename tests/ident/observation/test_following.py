"""Filters that follow the rate of the logs."""

from dataclasses import replace

import numpy as np
import pytest

from ident.observation.observation import ObserveOptions, following
from ident.recordings.recording import Recording
from ident.support.errors import RecordingError


def log(rate: float, motion_hz: float = 0.8, name: str = "slow") -> Recording:
    t = np.arange(0.0, 20.0, 1.0 / rate)
    q = np.column_stack([0.7 * np.sin(2.0 * np.pi * f * t + 0.3) for f in (0.3, motion_hz)])
    return Recording(t, q, np.cos(q), name)


def test_a_cut_off_that_was_not_chosen_is_a_quarter_of_the_rate_at_most():
    found, note = following(ObserveOptions(), [log(250.0, name="fast"), log(30.0)])
    assert (found.cutoff_hz, found.decimation_cutoff_hz) == pytest.approx((7.5, 7.5), rel=1e-3)
    assert found.rows_per_second == pytest.approx(15.0, rel=1e-3)
    assert note == "slow: logged at 30 Hz, so positions are low-passed at 7.5 Hz and currents at 7.5 Hz"
    found, _ = following(ObserveOptions(), [log(50.0)])  # only what the rate asks for is lowered
    assert (found.cutoff_hz, found.decimation_cutoff_hz) == pytest.approx((12.5, 10.0), rel=1e-3)
    assert found.rows_per_second == 20.0


def test_fast_logs_and_chosen_cut_offs_stay_as_they_are():
    for options, logs in (
        (ObserveOptions(), [log(60.0), log(1000.0)]),
        (ObserveOptions(cutoff_hz=9.0, decimation_cutoff_hz=8.0, rows_per_second=18.0), [log(30.0)]),
    ):
        found, note = following(options, logs)
        assert found is options
        assert note is None


@pytest.mark.parametrize("rate", [30.0, 20.0])
def test_a_motion_that_a_lowered_filter_bends_is_refused_by_joint(rate):
    following(ObserveOptions(), [log(rate, motion_hz=0.1 * rate)])
    # 1 - 1 / (1 + (0.22 / 0.25)^8)
    said = rf"^slow: joint 2 moves too fast for a log at {rate:g} Hz: a low-pass at {0.25 * rate:g} Hz removes 26 % of"
    with pytest.raises(RecordingError, match=said):
        following(ObserveOptions(), [replace(log(200.0), name="fast"), log(rate, motion_hz=0.22 * rate)])


def test_noise_of_encoders_is_no_motion():
    quiet, rng = log(30.0), np.random.default_rng(3)
    noisy = replace(quiet, q=quiet.q + 2e-3 * rng.standard_normal(quiet.q.shape))
    assert following(ObserveOptions(), [noisy])[1] == following(ObserveOptions(), [quiet])[1]


def test_steps_of_a_coarse_encoder_under_a_slow_joint_are_no_motion():
    # A ramp of 2 mrad/s and rests: its steps have lines of their own, far above the white noise of as many steps.
    t = np.arange(0.0, 40.0, 1.0 / 30.0)
    way = np.column_stack(
        [0.7 * np.sin(0.3 * t), np.where((t > 10.0) & (t < 30.0), 0.002 * (t - 10.0), 0.04 * (t >= 30.0))]
    )
    stepped = Recording(t, 1.5e-3 * np.rint(way / 1.5e-3), np.cos(way), "stepped")
    found, _ = following(ObserveOptions(), [stepped])
    assert found.cutoff_hz == pytest.approx(7.5)
    fast = way + np.column_stack([0.0 * t, 0.05 * np.sin(2.0 * np.pi * 6.6 * t)])
    with pytest.raises(RecordingError, match="joint 2 moves too fast"):
        following(ObserveOptions(), [replace(stepped, q=1.5e-3 * np.rint(fast / 1.5e-3))])
