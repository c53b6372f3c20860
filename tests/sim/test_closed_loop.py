from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from plants import BELIEF, RX90, experiment, nominal_plant, short_motion, streams

from sim.controller import Controller, ControllerOptions, tuned
from sim.errors import PlantError
from sim.record import ControlPeriods, record
from sim.trajectory import at_rest

TUNING = ControllerOptions(
    rate_hz=400.0, bandwidth_hz=5.3, damping=0.37, integral_hz=0.7, velocity_cutoff_hz=61.0, feedforward=0.83
)


GAIN = np.array([1.3, -0.7, 0.9, 2.1, -1.7, 0.4])
LIMIT = np.array([62.0, 290.0, 27.0, 7.3, 4.4, 10.9])
PERIODS = 300


def documented(q: np.ndarray) -> np.ndarray:
    """Currents for given readings: `sim.record` and `sim.controller` as written there, by scalars."""
    motion = short_motion()
    arm = pin.buildModelFromMJCF(str(RX90.model))
    arm.armature = np.array(BELIEF.rotor_inertia)
    data, T = arm.createData(), 1.0 / 400.0
    samples = round(motion.duration * 400.0) + 1
    q_ref, dq_ref, ddq_ref = motion(T * np.arange(samples))
    every = q_ref[:: max(1, samples // 50)]
    M = np.mean([np.diag(pin.crba(arm, data, each)) for each in every], axis=0)
    w, b = 2 * np.pi * 5.3, 1 - np.exp(-2 * np.pi * 61.0 * T)
    v = np.empty_like(q)
    for j in range(6):
        Kp, Kd = M[j] * w * w, 2 * 0.37 * w * M[j]
        Ki = 2 * np.pi * 0.7 * Kp
        dq = s = 0.0
        before = q[0, j]
        for k in range(len(q)):
            dq = dq + b * ((q[k, j] - before) / T - dq)
            before = q[k, j]
            s = s + Ki * T * (q_ref[k, j] - q[k, j])
            tau = 0.83 * pin.rnea(arm, data, q_ref[k], dq_ref[k], ddq_ref[k])[j]
            wanted = (Kp * (q_ref[k, j] - q[k, j]) + Kd * (dq_ref[k, j] - dq) + s + tau) / GAIN[j]
            v[k, j] = max(-LIMIT[j], min(LIMIT[j], wanted))
    return v


def commanded(
    controllers: list[Controller], readings: np.ndarray, limits: np.ndarray, *, length: int = 70
) -> np.ndarray:
    """Currents for given readings, shape (N, B, n), so many control periods at a time, within the drives' limits."""
    periods, out = ControlPeriods(controllers, length), []
    periods.switch_on(readings[0])
    for start in range(0, len(readings), length):
        rows = slice(start, min(start + length, len(readings)))
        for k, row in enumerate(range(rows.start, rows.stop)):
            periods.reference[k] = [c.reference[row] for c in controllers]
            if periods.q_ref is not None:
                periods.q_ref[k] = [c.q_ref[row] for c in controllers]
            periods.reading[k] = readings[row]
            out.append(np.clip(periods.command(k), -limits, limits))
        periods.go_on()
    return np.array(out)


def readings(rng: np.random.Generator) -> np.ndarray:
    """Lopsided readings near the reference: near enough for currents inside their limits now and then."""
    q = short_motion()(np.arange(PERIODS) / 400.0)[0]
    return q + 0.01 * np.sin(np.outer(np.arange(PERIODS), [0.09, 0.15, 0.11, 0.17, 0.13, 0.16])) + 0.0003


def test_the_law_is_what_its_docstring_says_saturation_on_both_sides_included(rng):
    q = readings(rng)
    controller = tuned(replace(BELIEF, gain=tuple(GAIN.tolist())), short_motion(), TUNING)
    expected = documented(q)
    for limit in (LIMIT, -LIMIT):
        assert (expected == limit).any(axis=0).all()  # each joint is at each of its limits
    assert (np.abs(expected) < LIMIT).mean() > 0.2
    v = commanded([controller], q[:, None, :], LIMIT[None])[:, 0]
    # Differences of positions times 1e4 N m/rad: four digits of 16 lost, and the integral of 300 of them.
    np.testing.assert_allclose(v, expected, rtol=0, atol=1e-8)


def test_the_loop_commands_what_the_law_says_for_what_the_encoders_read():
    sensors = replace(experiment().sensors, current_white=0.0, current_coloured=0.0)
    rotors = tuple((1.2 * RX90.drives.rotor_inertia).tolist())  # neither gains nor rotors are those of the plant
    belief = replace(BELIEF, gain=(1.1, 0.9, 1.2, 0.8, 1.3, 0.7), rotor_inertia=rotors)
    options = ControllerOptions(bandwidth_hz=7.0, integral_hz=0.4, velocity_cutoff_hz=90.0)
    run = experiment(sensors=sensors, belief=belief, controller=options, trajectory=short_motion(0.6, 0.01))
    largest = np.abs(record([run], streams(4), threads=1)[0].v).max(axis=0)
    for limit in (1.1 * largest, 0.99 * largest):
        (recording,) = record([replace(run, plant=nominal_plant(current_limit=limit))], streams(4), threads=1)
        controller = tuned(belief, run.trajectory, options)
        v = commanded([controller], recording.q[:, None, :], limit[None])[:, 0]
        np.testing.assert_array_equal(recording.v, v)
        assert (np.abs(v) == limit).any() == (limit < largest).all()


def test_impossible_tunings_and_beliefs_are_refused():
    other = replace(BELIEF, gain=(1.0, 1.0), rotor_inertia=(1.0, 1.0))
    five = at_rest(np.zeros(5), np.zeros((5, 2)), np.full((5, 2), 0.1), 2.0)
    for make, message in (
        (lambda: ControllerOptions(rate_hz=1e9), r"controller: rate_hz = 1e\+09: expected 1 to 100000 Hz"),
        (lambda: ControllerOptions(bandwidth_hz=0.0), r"bandwidth_hz = 0: expected more than 0 to 10000 Hz"),
        (lambda: ControllerOptions(feedforward=np.nan), r"feedforward = nan: expected a finite number"),
        (lambda: replace(BELIEF, gain=(1.0, 1.0)), "2 gains and 6 rotor inertias; expected one per joint"),
        (
            lambda: replace(BELIEF, gain=(1.0, 0.0, 1.0, 1.0, 1.0, 1.0)),
            "finite numbers up to .*, gains not zero",
        ),
        (lambda: tuned(other, short_motion(), TUNING), "6 joints, but the controller's model has 2"),
        (lambda: tuned(BELIEF, five, TUNING), "the motion moves 5 joints of an arm with 6"),
    ):
        with pytest.raises(PlantError, match=message):
            make()
