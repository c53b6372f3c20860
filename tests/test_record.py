from dataclasses import replace

import numpy as np
import pytest
from plants import CYLINDER, NOISY, experiment, nominal_plant, short_motion

from ident.recording import Recording
from sim.controller import ControllerOptions
from sim.errors import LimitReached, PlantError, Saturated
from sim.record import record, try_record
from sim.sensors import SensorOptions, coloured_noise, logged_current

SILENT = SensorOptions()


def rngs(*seeds: int) -> list[np.random.Generator]:
    return [np.random.default_rng(seed) for seed in seeds]


def same(a: Recording, b: Recording) -> bool:
    return a.q.tobytes() == b.q.tobytes() and a.v.tobytes() == b.v.tobytes() and a.t.tobytes() == b.t.tobytes()


def test_the_same_seed_gives_the_same_bytes_and_another_seed_does_not():
    first, second, other = (record([experiment()], rngs(seed), threads=2)[0] for seed in (3, 3, 4))
    assert same(first, second)
    assert not same(first, other)


def test_a_recording_does_not_depend_on_the_batch_it_ran_in():
    alone = record([experiment()], rngs(3), threads=1)[0]
    many = record([experiment(loaded=True), experiment(sensors=SILENT), experiment()], rngs(1, 2, 3), threads=2)
    assert same(alone, many[2])


def test_a_recording_is_what_the_cell_logs_one_row_a_control_period():
    recording = record([experiment(controller=ControllerOptions(rate_hz=500.0))], rngs(0), threads=1)[0]
    np.testing.assert_allclose(np.diff(recording.t), 2e-3, rtol=1e-9)
    assert recording.q.shape == recording.v.shape == (1001, 6)


def test_the_arm_follows_its_reference_and_the_payload_costs_current():
    bare, loaded = record([experiment(sensors=SILENT), experiment(sensors=SILENT, loaded=True)], rngs(0, 1), threads=2)
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
        errors.append(np.abs(record([held], rngs(0), threads=1)[0].q[-100:].mean(axis=0) - still.center))
    assert (errors[1] < 0.05 * errors[0]).all()


def test_encoder_readings_are_multiples_of_the_quantum():
    quantum = 1e-4
    reading = record([experiment(sensors=replace(NOISY, encoder_quantum=quantum))], rngs(0), threads=1)[0].q
    np.testing.assert_allclose(reading / quantum, np.rint(reading / quantum), rtol=0, atol=1e-9)


def test_encoder_noise_travels_round_the_loop_into_the_commanded_current():
    noise = replace(SILENT, encoder_noise=1e-4)
    quiet, noisy = (record([experiment(sensors=s)], rngs(0), threads=1)[0] for s in (SILENT, noise))
    ripple = [np.std(np.diff(recording.v, axis=0)) for recording in (quiet, noisy)]
    assert ripple[1] > 10 * ripple[0]


def test_current_noise_has_the_stated_size_and_colour(rng):
    v = np.ones((200_000, 2)) * [1.0, -20.0]
    white = logged_current(v, 1000.0, replace(SILENT, current_white=0.05), rng) - v
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
        record([experiment(plant=heavy, loaded=True)], rngs(0), threads=1)


def test_leaving_the_range_of_a_joint_is_an_error_with_joint_and_time():
    motion = short_motion()
    far = replace(motion, center=motion.center + np.array([0, 0, 0, 0, 1.7, 0]))
    with pytest.raises(
        LimitReached, match=r"^motion: joint5 at 2\.\d+ rad leaves its range -1\.833 to 2\.094 rad at t ="
    ):
        record([experiment(trajectory=far)], rngs(0), threads=1)


def test_one_failure_in_a_batch_leaves_the_others_their_recordings():
    heavy = nominal_plant(payload=replace(CYLINDER, mass=90.0))
    outcomes = try_record([experiment(), experiment(plant=heavy, loaded=True)], rngs(3, 4), threads=2)
    assert same(outcomes[0], record([experiment()], rngs(3), threads=1)[0])
    assert isinstance(outcomes[1], Saturated)


def test_steps_and_durations_that_do_not_fit_are_refused():
    with pytest.raises(PlantError, match=r"step 0\.0007 s does not divide the control period 0\.001 s"):
        record([experiment(step=7e-4)], rngs(0), threads=1)
    with pytest.raises(PlantError, match="experiments of one batch need equal durations"):
        record([experiment(), experiment(trajectory=short_motion(3.0))], rngs(0, 1), threads=1)
