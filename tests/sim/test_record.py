from dataclasses import replace

import numpy as np
import pytest
from plants import CYLINDER, NOISY, experiment, nominal_plant, short_motion, streams, try_record

from ident.recordings.recording import Recording
from sim.controller import ControllerOptions
from sim.effects import ModelErrors
from sim.errors import LimitReached, PlantError, Saturated
from sim.record import record
from sim.sensors import SensorOptions, logged, noise_streams
from sim.sensors.current import coloured_noise

SILENT = SensorOptions()


def same(a: Recording, b: Recording) -> bool:
    return a.q.tobytes() == b.q.tobytes() and a.v.tobytes() == b.v.tobytes() and a.t.tobytes() == b.t.tobytes()


def test_the_same_seed_gives_the_same_bytes_and_another_seed_does_not():
    first, second, other = (record([experiment()], streams(seed), threads=1)[0] for seed in (3, 3, 4))
    assert same(first, second)
    assert not same(first, other)


def test_a_recording_does_not_depend_on_the_batch_it_ran_in():
    alone = record([experiment()], streams(3), threads=1)[0]
    many = record([experiment(loaded=True), experiment(sensors=SILENT), experiment()], streams(1, 2, 3), threads=1)
    assert same(alone, many[2])


def test_whoever_listens_is_told_every_second_that_is_simulated():
    heard = []
    options = ControllerOptions(rate_hz=500.0)
    motions = [experiment(controller=options), experiment(controller=options, loaded=True), experiment()]
    log = record(motions, streams(0, 1, 2), threads=1, advanced=heard.append)
    # Samples at both ends of a motion: one period more each. Sums of a few numbers are exact to rounding.
    np.testing.assert_allclose(sum(heard), sum(each.t[-1] + each.t[1] for each in log), rtol=1e-9)
    assert len(heard) > 2


def test_a_recording_is_what_the_cell_logs_one_row_a_control_period():
    recording = record([experiment(controller=ControllerOptions(rate_hz=500.0))], streams(0), threads=1)[0]
    np.testing.assert_allclose(np.diff(recording.t), 2e-3, rtol=1e-9)
    assert recording.q.shape == recording.v.shape == (1001, 6)


def test_the_arm_follows_its_reference_and_the_payload_costs_current():
    bare, loaded = record(
        [experiment(sensors=SILENT), experiment(sensors=SILENT, loaded=True)], streams(0, 1), threads=1
    )
    reference = short_motion()(bare.t)[0]
    assert np.abs(bare.q - reference).max() < 0.02  # friction is not fed forward
    assert np.mean(loaded.v[:, 1] ** 2) > np.mean(bare.v[:, 1] ** 2)


def test_integral_action_removes_the_standing_error():
    still = replace(short_motion(4.0), sine=np.zeros((6, 3)), cosine=np.zeros((6, 3)))
    quiet = nominal_plant(coulomb_friction=np.zeros(6))
    errors = []
    for integral_hz in (0.0, 1.0):
        options = ControllerOptions(integral_hz=integral_hz)
        held = experiment(plant=quiet, loaded=True, trajectory=still, controller=options, sensors=NOISY)
        errors.append(np.abs(record([held], streams(0), threads=1)[0].q[-100:].mean(axis=0) - still.center))
    assert (errors[1] < 0.05 * errors[0]).all()


def test_encoder_readings_are_multiples_of_the_quantum():
    quantum = 1e-4
    reading = record([experiment(sensors=replace(NOISY, encoder_quantum=quantum))], streams(0), threads=1)[0].q
    np.testing.assert_allclose(reading / quantum, np.rint(reading / quantum), rtol=0, atol=1e-9)


def test_encoder_noise_travels_round_the_loop_into_the_commanded_current():
    noise = replace(SILENT, encoder_noise=1e-4)
    quiet, noisy = (record([experiment(sensors=s)], streams(0), threads=1)[0] for s in (SILENT, noise))
    ripple = [np.std(np.diff(recording.v, axis=0)) for recording in (quiet, noisy)]
    assert ripple[1] > 10 * ripple[0]


def test_current_noise_has_the_stated_size_and_colour(rng):
    v = np.ones((200_000, 2)) * [1.0, -20.0]
    white = logged(v, v, 1000.0, replace(SILENT, current_white=0.05), noise_streams(rng)).v - v
    # 200 000 samples: the standard deviation is known to 0.16 %; four of them.
    np.testing.assert_allclose(white.std(axis=0), [0.05, 1.0], rtol=0.0064)
    coloured = coloured_noise((200_000, 2), 1000.0, 20.0, rng)
    spectrum = np.abs(np.fft.rfft(coloured[:, 0])) ** 2
    frequency = np.fft.rfftfreq(200_000, 1e-3)
    assert spectrum[frequency < 30].sum() > 0.9 * spectrum.sum()
    # Some 200 s times 40 Hz independent values: 1 % of standard deviation; four of them.
    np.testing.assert_allclose(coloured.std(axis=0), 1.0, atol=0.04)


def test_too_heavy_a_payload_is_an_error_with_joint_and_time():
    heavy = nominal_plant(payload=replace(CYLINDER, mass=90.0))
    with pytest.raises(
        Saturated, match=r"^motion: drive of joint[23] at its limit of .* from t = 0\.\d+ s; use a lighter"
    ):
        record([experiment(plant=heavy, loaded=True)], streams(0), threads=1)


@pytest.mark.parametrize(("shift", "found"), [(1.7, r"2\.\d+"), (-2.2, r"-1\.\d+")])
def test_leaving_the_range_of_a_joint_is_an_error_with_joint_and_time(shift, found):
    motion = short_motion()
    far = replace(motion, center=motion.center + np.array([0, 0, 0, 0, shift, 0]))
    with pytest.raises(
        LimitReached, match=rf"^motion: joint5 at {found} rad leaves its range -1\.833 to 2\.094 rad at t ="
    ):
        record([experiment(trajectory=far)], streams(0), threads=1)


def test_one_failure_in_a_batch_leaves_the_others_their_recordings():
    heavy = nominal_plant(payload=replace(CYLINDER, mass=90.0))
    outcomes = try_record([experiment(), experiment(plant=heavy, loaded=True)], streams(3, 4), threads=1)
    assert same(outcomes[0], record([experiment()], streams(3), threads=1)[0])
    assert isinstance(outcomes[1], Saturated)


def test_a_step_that_does_not_fit_is_refused():
    with pytest.raises(PlantError, match=r"step 0\.0007 s does not divide the control period 0\.001 s"):
        record([experiment(step=7e-4)], streams(0), threads=1)


def test_experiments_of_any_duration_rate_step_and_layout_run_in_one_call_as_they_run_alone():
    elastic = ModelErrors(joint_compliance=(1e-4,) * 6)
    several = [
        experiment(plant=nominal_plant(errors=elastic)),
        experiment(trajectory=short_motion(1.0, 0.03)),
        experiment(),
        experiment(controller=ControllerOptions(rate_hz=500.0)),
        experiment(step=5e-4),
        experiment(plant=nominal_plant(errors=ModelErrors(wrist_coupling=1.0)), loaded=True),
        experiment(plant=nominal_plant(errors=ModelErrors(gravity_spring=2e4)), loaded=True),
    ]
    together = record(several, streams(*range(7)), threads=2)
    for i, single in enumerate(several):
        assert same(together[i], record([single], streams(i), threads=1)[0])


def test_a_control_period_takes_as_long_in_small_steps_as_in_large_ones():
    coarse, fine = record([experiment(sensors=SILENT, step=h) for h in (1e-3, 2.5e-4)], streams(0, 0), threads=1)
    # The integrator is of first order: an error of about a step's travel, 1 ms at some 0.5 rad/s.
    np.testing.assert_allclose(coarse.q, fine.q, rtol=0, atol=1e-3)


def test_a_plant_that_cannot_be_built_is_the_outcome_of_its_own_experiment():
    stiff = nominal_plant(errors=ModelErrors(joint_compliance=(1e-9,) * 6))
    noisy = replace(NOISY, coloured_cutoff_hz=600.0)
    several = [experiment(plant=stiff), experiment(sensors=noisy), experiment(step=7e-4), experiment()]
    outcomes = try_record(several, streams(0, 1, 2, 3), threads=1)
    assert [type(outcome) for outcome in outcomes] == [PlantError, PlantError, PlantError, Recording]
    assert same(outcomes[3], record([experiment()], streams(3), threads=1)[0])


@pytest.mark.parametrize("shift", [3, -2])
def test_the_logged_current_comes_later_than_the_logged_position(shift):
    silent, late = (
        record([experiment(sensors=replace(SILENT, current_delay=delay))], streams(0), threads=1)[0]
        for delay in (0.0, shift * 1e-3)
    )
    assert late.q.tobytes() == silent.q.tobytes()
    source = np.clip(np.arange(len(silent.v)) - shift, 0, len(silent.v) - 1)
    # Interpolation at a sample, whose time has a rounding error of 1e-16 of 2 s; the current jumps by 100 in a period.
    np.testing.assert_allclose(late.v, silent.v[source], rtol=0, atol=1e-9)


def test_clock_jitter_moves_time_stamps_by_its_deviation_and_nothing_else():
    options = replace(NOISY, clock_jitter=2.5e-4)
    exact, jittered = (record([experiment(sensors=s)], streams(5), threads=1)[0] for s in (NOISY, options))
    assert exact.q.tobytes() == jittered.q.tobytes()
    assert exact.v.tobytes() == jittered.v.tobytes()
    still = np.ones((100_000, 1))
    stamps = logged(still, still, 1000.0, options, noise_streams(np.random.default_rng(0))).t
    error = stamps - np.arange(100_000) / 1000.0
    # The variance of 1e5 even deviates is known to 0.28 % (kurtosis 1.8), the deviation to half of it; four of them.
    np.testing.assert_allclose(error.std(), 2.5e-4, rtol=0.006)
    assert np.abs(error).max() <= np.sqrt(3.0) * 2.5e-4 * (1 + 1e-9)
    with pytest.raises(PlantError, match=r"clock_jitter = 0\.0003 s at 1000 Hz: expected a quarter .* 0\.00025 s"):
        record([experiment(sensors=replace(SILENT, clock_jitter=3e-4))], streams(0), threads=1)


def test_encoder_is_the_first_and_current_the_second_child_of_an_experiment_s_generator():
    sensors = replace(SILENT, encoder_noise=1e-4, current_white=0.05, clock_jitter=1e-4)
    clean = record([experiment(sensors=replace(SILENT, encoder_noise=1e-4))], streams(3), threads=1)[0]
    noisy = record([experiment(sensors=sensors)], streams(3), threads=1)[0]
    encoder, current = np.random.default_rng(3).spawn(2)
    start = short_motion()(np.zeros(1))[0][0]
    np.testing.assert_array_equal(noisy.q[0], start + 1e-4 * encoder.standard_normal(6))
    noise = 0.05 * current.standard_normal(clean.v.shape) * np.sqrt(np.mean(clean.v**2, axis=0))
    # Two roundings of currents below 500.
    np.testing.assert_allclose(noisy.v, clean.v + noise, rtol=0, atol=1e-12)


def test_motions_of_one_plant_have_the_friction_of_their_own_time():
    plant = nominal_plant(errors=ModelErrors(coulomb_drift=0.4, viscous_drift=0.4))
    motions = [experiment(plant=plant, sensors=SILENT, earlier=k) for k in range(3)]
    together = record(motions, streams(0, 0, 0), threads=1)
    for k, recording in enumerate(together):
        drives = nominal_plant().drives
        fixed = nominal_plant(
            coulomb_friction=1.4**k * drives.coulomb_friction, viscous_friction=1.4**k * drives.viscous_friction
        )
        (expected,) = record([experiment(plant=fixed, sensors=SILENT)], streams(0), threads=1)
        # Two roundings of a product, which a well-damped arm does not amplify.
        np.testing.assert_allclose(recording.v, expected.v, rtol=0, atol=1e-6)
    assert np.abs(together[2].v - together[1].v).max() > 0.1
