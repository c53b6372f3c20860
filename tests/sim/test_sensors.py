from dataclasses import fields, replace

import numpy as np
import pytest
from plants import streams
from refusals import refused
from scipy import signal

from sim.errors import PlantError
from sim.sensors import SENSORS, SensorOptions, check_rate, logged, noise_streams, noises, without_spectrum
from sim.sensors.readings import coloured_noise
from sim.sensors.sensor import Log


def encoders(readings: np.ndarray, *options: SensorOptions, seed: int = 0) -> np.ndarray:
    """What encoders read, periods first."""
    noise = [noise_streams(np.random.default_rng(seed + i)) for i in range(len(options))]
    read = SENSORS["Encoder"].reader(options, noise, readings.shape[-1])
    assert read is not None
    out = readings.copy()
    for row in out:
        read(row)
    return out


def test_noise_comes_before_the_quantum_and_simulations_have_their_own_of_both():
    truth = np.full((1100, 3, 2), 0.4321)  # more periods than are drawn at once
    fine, coarse = SensorOptions(encoder_noise=3e-4), SensorOptions(encoder_noise=7e-4, encoder_quantum=5e-4)
    read = encoders(truth, fine, coarse, SensorOptions())
    for i, (std, quantum) in enumerate(((3e-4, None), (7e-4, 5e-4), (0.0, None))):
        generator = np.random.default_rng(i).spawn(3)[0]
        expected = 0.4321 + std * generator.standard_normal((1100, 2))
        if quantum:
            expected = np.rint(expected / quantum) * quantum
        np.testing.assert_array_equal(read[:, i], expected)


def test_coloured_noise_is_as_strong_in_its_first_samples_as_later():
    # 4000 starts of 20 samples; settled already, the deviation of each is 1 within 4 / sqrt(2 * 4000) = 4.5 %.
    noise = coloured_noise((20, 4000), 1000.0, 7.0, np.random.default_rng(0))
    np.testing.assert_allclose(noise.std(axis=1), 1.0, rtol=0, atol=0.045)


def test_noise_is_in_proportion_to_the_rms_current_of_its_own_joint():
    v = np.array([2.0, -30.0, 0.5]) * np.ones((50_000, 3))
    options = SensorOptions(current_white=0.04, current_coloured=0.03, coloured_cutoff_hz=200.0)
    noise = logged(v, v, 1000.0, options, noise_streams(np.random.default_rng(2))).v - v
    # Independent, so that variances add; of 5e4 samples, correlated over some 3: 4 sigma are 2 %.
    np.testing.assert_allclose(noise.std(axis=0) / [2.0, 30.0, 0.5], np.hypot(0.04, 0.03), rtol=0.02)


def log_of(*, rate: float = 250.0, samples: int = 400) -> Log:
    t = np.arange(samples) / rate
    return Log(
        t=t,
        q=np.sin(3.0 * t)[:, None] * [0.4, -1.3, 0.7],
        v=np.cos(5.0 * t + 0.3)[:, None] * [7.0, 2.5, -4.0],
        rate_hz=rate,
    )


def drawn(name: str, shape: tuple[int, ...], distribution: str, seed: int = 6) -> np.ndarray:
    """What a sensor draws: the children of a generator, in the order of the sensors."""
    child = ["encoder", "current", "clock", "current_sensor", "drive_clocks", "samples"].index(name)
    return getattr(np.random.default_rng(seed).spawn(6)[child], distribution)(shape)


def test_a_current_sensor_has_an_error_of_gain_and_of_zero_in_each_motion_and_joint():
    log, (noise,) = log_of(), streams(6)
    seen = SENSORS["CurrentSensor"].logs(SensorOptions(current_gain_error=0.02, current_offset=0.05), log, noise)
    gain, offset = drawn("current_sensor", (2, 3), "standard_normal")
    rms = np.sqrt(np.mean(log.v**2, axis=0))
    np.testing.assert_allclose(seen.v, log.v * (1.0 + 0.02 * gain) + 0.05 * offset * rms, rtol=0, atol=1e-14)
    assert seen.q is log.q
    assert seen.t is log.t
    alone = SENSORS["CurrentSensor"].logs(SensorOptions(current_offset=0.05), log, streams(6)[0])
    np.testing.assert_allclose(alone.v, log.v + 0.05 * offset * rms, rtol=0, atol=1e-14)


def test_drives_sample_by_clocks_of_their_own():
    offset, rate = 0.003, 0.004
    log, (noise,) = log_of(), streams(6)
    seen = SENSORS["DriveClocks"].logs(SensorOptions(clock_offset=offset, clock_rate=rate), log, noise)
    by_rate, by_offset = drawn("drive_clocks", (2, 3), "standard_normal")
    taken = np.clip(np.outer(log.t, 1.0 + rate * by_rate) + offset * by_offset, log.t[0], log.t[-1])
    np.testing.assert_array_equal(seen.t, log.t)
    # Straight lines between samples 4 ms apart: an eighth of the square times 3^2 1.3 and 5^2 7.
    np.testing.assert_allclose(seen.q, np.sin(3.0 * taken) * [0.4, -1.3, 0.7], rtol=0, atol=2.4e-5)
    np.testing.assert_allclose(seen.v, np.cos(5.0 * taken + 0.3) * [7.0, 2.5, -4.0], rtol=0, atol=3.6e-4)
    assert np.abs(seen.q - log.q).max() > 2e-3


def test_samples_are_lost_and_repeat_the_last_that_is_its_own():
    log, (noise,) = log_of(), streams(6)
    seen = SENSORS["Samples"].logs(SensorOptions(samples_lost=0.2, samples_repeated=0.4), log, noise)
    lost, repeated = drawn("samples", (2, 400), "random") < [[0.2], [0.4]]
    expected: list[tuple[float, ...]] = []
    last = 0
    for k in range(400):
        inner = 0 < k < 399
        last = last if repeated[k] and inner else k
        if not (lost[k] and inner):
            expected.append((log.t[k], *log.q[last], *log.v[last]))
    np.testing.assert_array_equal(np.column_stack((seen.t, seen.q, seen.v)), expected)
    assert (seen.t[0], seen.t[-1]) == (log.t[0], log.t[-1])


def test_noise_of_a_log_is_what_its_equations_say():
    t = np.arange(4001) / 1000.0
    q = np.stack((np.sin(3.0 * t), 0.4 * np.cos(5.0 * t)), axis=1)
    v = np.stack((7.0 * np.cos(2.0 * t), 3.0 - t), axis=1)
    log = Log(t=t, q=q, v=v, rate_hz=1000.0)
    encoders, clock = {"encoder_quantum": 3e-4, "encoder_noise": 2e-4}, {"clock_jitter": 1e-4}
    currents = {"current_white": 0.07, "current_coloured": 0.03, "coloured_cutoff_hz": 15.0}
    options = SensorOptions(**encoders, **currents, **clock)
    found = {noise.stream: noise for noise in noises(log, options)}
    assert set(found) == {"encoder", "white", "coloured", "clock"}
    quantum = 9e-8 / 12.0  # variance of an even error
    np.testing.assert_allclose(found["encoder"].q, np.sqrt(4e-8 + quantum), rtol=1e-12)
    rms = np.sqrt(np.mean(v**2, axis=0))
    np.testing.assert_allclose(found["white"].v, 0.07 * rms, rtol=1e-12)
    impulse = signal.sosfilt(found["coloured"].sos, np.eye(1, 4000)[0])
    np.testing.assert_allclose(found["coloured"].v * np.linalg.norm(impulse), 0.03 * rms, rtol=1e-9)  # of unit variance
    adjusted = noises(log, SensorOptions(current_gain_error=0.06, current_offset=0.04))
    assert [(each.stream, each.lasting, each.shared) for each in adjusted] == [("current_sensor", True, False)] * 2
    np.testing.assert_allclose(adjusted[0].v, 0.06 * v, rtol=1e-12)
    np.testing.assert_allclose(adjusted[1].v, 0.04 * rms, rtol=1e-12)
    assert not any(found[name].lasting for name in found)
    speed = np.stack((3.0 * np.cos(3.0 * t), -2.0 * np.sin(5.0 * t)), axis=1)
    np.testing.assert_allclose(found["clock"].q, -1e-4 * speed, rtol=0, atol=2e-6)  # one-sided at the ends
    np.testing.assert_allclose(found["clock"].v[:, 1], 1e-4, rtol=1e-9)
    assert [found[name].shared for name in ("encoder", "white", "coloured", "clock")] == [False, False, False, True]
    for name in ("encoder", "white", "coloured"):
        assert not (found[name].v.any() and found[name].q.any())
    assert noises(log, SensorOptions()) == []


def test_every_value_that_draws_from_a_stream_has_noise_in_the_log_or_is_named_as_without_a_spectrum():
    log, known = log_of(), {"clock_offset": "drive_clocks", "clock_rate": "drive_clocks"}
    known |= {"samples_lost": "samples", "samples_repeated": "samples"}
    for field in fields(SensorOptions):
        options = SensorOptions(**{field.name: 0.003})
        named = (known[field.name],) if field.name in known else ()
        assert without_spectrum(log, options) == named, field.name
        silent = {*known, "current_delay", "coloured_cutoff_hz", "log_rate_hz"}
        assert bool(noises(log, options)) == (field.name not in silent)
    assert without_spectrum(log, SensorOptions(samples_lost=0.1, clock_rate=1e-5)) == ("drive_clocks", "samples")


def test_a_log_without_noise_keeps_its_delay():
    q, v = np.zeros((50, 2)), np.outer(np.arange(50.0), (1.0, -2.0))
    log = logged(q, v, 100.0, SensorOptions(current_delay=0.02, current_white=0.3, clock_jitter=1e-3), None)
    np.testing.assert_allclose(log.v[2:], v[:-2], rtol=1e-12)
    np.testing.assert_allclose(log.t, np.arange(50) / 100.0, rtol=1e-12)


def test_a_slow_log_keeps_one_sample_in_so_many_as_they_were_and_draws_noise_for_them_alone():
    q, v = np.cumsum(np.ones((103, 2)), axis=0), np.random.default_rng(0).standard_normal((103, 2))
    silent = logged(q, v, 500.0, SensorOptions(log_rate_hz=25.0), noise_streams(np.random.default_rng(1)))
    np.testing.assert_array_equal(silent.q, q[::20])
    np.testing.assert_array_equal(silent.v, v[::20])
    np.testing.assert_allclose(silent.t, np.arange(6) / 25.0, rtol=1e-15)
    assert silent.rate_hz == 25.0
    options = SensorOptions(log_rate_hz=25.0, current_white=0.1, samples_lost=0.0)
    noisy = logged(q, v, 500.0, options, noise_streams(np.random.default_rng(1)))
    own = logged(q[::20], v[::20], 25.0, replace(options, log_rate_hz=0.0), noise_streams(np.random.default_rng(1)))
    np.testing.assert_array_equal(noisy.v, own.v)


def test_a_log_s_rate_divides_the_controller_s_and_noise_fits_the_log():
    coloured = SensorOptions(log_rate_hz=25.0, current_coloured=0.1, coloured_cutoff_hz=10.0)
    check_rate(coloured, 500.0)
    for options, message in (
        (SensorOptions(log_rate_hz=30.0), "log_rate_hz = 30 at 500 Hz: expected 0, or the controller's rate divided"),
        (SensorOptions(log_rate_hz=1000.0), "log_rate_hz = 1000 at 500 Hz"),
        (replace(coloured, coloured_cutoff_hz=20.0), "coloured_cutoff_hz = 20 at 25 Hz: .* less than 12.5 Hz"),
    ):
        refused(PlantError, message, check_rate, options, 500.0)


@pytest.mark.parametrize("name", SENSORS)
def test_a_sensor_whose_values_are_zero_reads_and_logs_the_truth(name):
    effect, perfect, noise = SENSORS[name], SensorOptions(), noise_streams(np.random.default_rng(4))
    assert effect.reader([perfect], [noise], 2) is None
    t = np.arange(40) / 250.0
    log = Log(t=t, q=np.sin(3.0 * t)[:, None] * [0.4, -1.3], v=np.cos(5.0 * t)[:, None] * [7.0, 2.5], rate_hz=250.0)
    logged = effect.logs(perfect, log, noise)
    for field in ("t", "q", "v"):
        np.testing.assert_array_equal(getattr(logged, field), getattr(log, field))
