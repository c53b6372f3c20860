"""Encoder noise that biases a gain is named, and refuses it; with lower cut-offs the same logs give the gain."""

from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import LOOSE, PAYLOADS, PLAIN
from known_logs import BRICK, mounted
from real_friction import GAIN, Truth, real_logs

from ident.diagnosis.diagnosis import Severity
from ident.diagnosis.gain_checks import noise_in_load
from ident.estimation.problem import ObservedMotion
from ident.identification import Identification, identify
from ident.model.regressor import inverse_dynamics
from ident.observation.observation import ObserveOptions, observe
from ident.payload.payload import standard_parameters
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
    assert np.all(np.abs(biased.gain - GAIN)[1:] < 4.0 * biased.std[1:])  # more would be called wrong
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
    assert {each.joint for each in said.effects} == {0, 1, 2}
    for each in said.effects:
        if (j := each.joint) > 0:  # that of joint 1 is refused
            np.testing.assert_allclose(each.percent, 100.0 * moved[j], rtol=1e-9)
            np.testing.assert_allclose(each.deviations, moved[j] / spread[j], rtol=1e-9)


def test_fine_encoders_need_no_other_estimate(axes, monkeypatch):
    monkeypatch.delattr("ident.diagnosis.gain_checks.instrumental_gains")
    logs = logs_with(1e-6)
    assert not any(each.name == "encoder noise" for each in found(axes, logs).diagnoses)


@pytest.mark.parametrize("encoder", [1e-4, 1e-3])
def test_the_share_of_noise_in_a_load_is_that_of_logs_without_it(axes, encoder):
    noisy, quiet = (observe(logs_with(each)[1], axes, ObserveOptions()) for each in (encoder, 0.0))
    q, still = quiet.recorded.q, np.zeros_like(quiet.recorded.q)
    chi = np.zeros(axes.base.regrouping.shape[1])
    chi[axes.payload_columns] = standard_parameters(BRICK.mass, BRICK.com, BRICK.inertia)
    added = noisy.recorded.ddq - quiet.recorded.ddq
    torque = inverse_dynamics(axes.arm, chi, q, still, added) - inverse_dynamics(axes.arm, chi, q, still, still)
    load = [np.var(each.W_L @ chi[axes.payload_columns]) for each in noisy.joints]
    # Noise density, and mean square over about 600 independent values and some 50 poses: 15 %.
    np.testing.assert_allclose(noise_in_load(ObservedMotion(noisy, BRICK)), np.mean(torque**2, axis=0) / load, rtol=0.3)


def test_only_what_is_known_of_a_payload_is_a_load(axes):
    motion = observe(logs_with(1e-3)[1], axes, ObserveOptions())
    every, mass = (noise_in_load(ObservedMotion(motion, replace(BRICK, known=each))) for each in ("all", "mass"))
    assert (np.abs(mass / every - 1.0) > 0.02).any()
    np.testing.assert_array_equal(noise_in_load(ObservedMotion(motion, None)), np.zeros(3))


def test_noise_matters_least_where_gravity_makes_most_of_the_load(axes):
    logs = logs_with(7e-5)
    sound = found(axes, logs)
    share = noise_in_load(ObservedMotion(observe(logs[1], axes, ObserveOptions()), BRICK))
    (upright, *loaded) = share > sound.std / np.abs(sound.gain)
    assert upright
    assert not any(loaded)
