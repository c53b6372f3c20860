"""Encoder noise that biases a gain is named, and refuses it; with lower cut-offs the same logs give the gain."""

import numpy as np
import pytest
from consistency_logs import LOOSE, PAYLOADS, PLAIN
from known_logs import BRICK, mounted
from real_friction import GAIN, Truth, real_logs

from ident.diagnosis.diagnosis import Severity
from ident.diagnosis.encoder_noise import share_of_acceleration
from ident.identification import Identification, identify
from ident.observation.observation import ObserveOptions, observe
from ident.recordings.recording import Recording

pytestmark = pytest.mark.usefixtures("_computed_once")

SLOW = ObserveOptions(cutoff_hz=4.0, decimation_cutoff_hz=4.0, rows_per_second=8.0)


def logs_with(encoder: float) -> list[Recording]:
    return real_logs(Truth(), PAYLOADS, np.random.default_rng(5), encoder=encoder)


def found(axes, logs, observing=None) -> Identification:
    return identify(axes, mounted(*logs, BRICK), options=PLAIN, gains=LOOSE, observing=observing or ObserveOptions())


def test_a_gain_that_encoder_noise_biases_is_refused_until_the_filter_removes_the_noise(axes):
    logs = logs_with(2e-3)
    biased = found(axes, logs)
    (said,) = [each for each in biased.diagnoses if each.name == "encoder noise"]
    assert said.severity is Severity.WRONG
    assert "--cutoff-hz" in said.advice
    assert said.cause in biased.reasons[0]
    assert biased.reasons[1:] == (None, None)  # the payload's weight determines them
    assert np.all(np.abs(biased.gain / GAIN - 1.0)[1:] < 0.05)
    slower = found(axes, logs, SLOW)
    assert not any(each.name == "encoder noise" for each in slower.diagnoses)
    assert np.all(np.abs(slower.gain - GAIN) < 3.0 * slower.std)
    assert not slower.gain.mask.any()


def test_the_effect_is_the_difference_from_the_method_without_this_bias_in_deviations_of_both(axes):
    logs = logs_with(2e-3)
    biased, other = found(axes, logs), identify(axes, mounted(*logs, BRICK), method="iv", gains=LOOSE)
    (said,) = [each for each in biased.diagnoses if each.name == "encoder noise"]
    moved = biased.gain / other.gain - 1.0
    spread = np.hypot(biased.std / biased.gain, other.std / other.gain)
    effects = {each.joint: each for each in said.effects}
    for j in (1, 2):  # that of joint 1 is refused
        np.testing.assert_allclose(effects[j].percent, 100.0 * moved[j], rtol=1e-9)
        np.testing.assert_allclose(effects[j].deviations, moved[j] / spread[j], rtol=1e-9)


def test_fine_encoders_need_no_other_estimate(axes, monkeypatch):
    monkeypatch.delattr("ident.diagnosis.encoder_noise.instrumental_gains")
    logs = logs_with(1e-6)
    assert not any(each.name == "encoder noise" for each in found(axes, logs).diagnoses)


@pytest.mark.parametrize("encoder", [1e-4, 1e-3])
def test_the_share_of_noise_in_accelerations_is_that_of_logs_without_it(axes, encoder):
    (noisy, _), (quiet, _) = (
        [observe(log, axes, ObserveOptions()).recorded for log in logs_with(each)] for each in (encoder, 0.0)
    )
    added = np.mean((noisy.ddq - quiet.ddq) ** 2, axis=0) / np.mean(noisy.ddq**2, axis=0)
    # Noise density and mean square are both from about 600 independent values: 10 %.
    assert share_of_acceleration(noisy) == pytest.approx(float(added.max()), rel=0.25)
