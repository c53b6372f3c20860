from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from plants import BELIEF, RX90, experiment, nominal_plant, short_motion, streams

from sim.closed_loop import ControlPeriods
from sim.controller import Controller, ControllerOptions, tuned
from sim.errors import PlantError
from sim.record import record

TUNING = ControllerOptions(
    rate_hz=400.0, bandwidth_hz=5.3, damping=0.37, integral_hz=0.7, velocity_cutoff_hz=61.0, feedforward=0.83
)
GAIN = np.array([1.3, -0.7, 0.9, 2.1, -1.7, 0.4])
LIMIT = np.array([62.0, 290.0, 27.0, 7.3, 4.4, 10.9])
PERIODS = 300


def documented(q: np.ndarray) -> np.ndarray:
    """Currents for given readings: `sim.control_law` and `sim.controller` as written there, by scalars."""
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
    for j in range(6):
        assert (expected[:, j] == LIMIT[j]).any(), f"joint {j + 1} never at its upper limit"
        assert (expected[:, j] == -LIMIT[j]).any(), f"joint {j + 1} never at its lower limit"
    assert (np.abs(expected) < LIMIT).mean() > 0.2
    v = commanded([controller], q[:, None, :], LIMIT[None])[:, 0]
    # Differences of positions times 1e4 N m/rad: four digits of 16 lost, and the integral of 300 of them.
    np.testing.assert_allclose(v, expected, rtol=0, atol=1e-8)


def test_controllers_of_a_batch_have_each_their_own_constants(rng):
    first = tuned(BELIEF, short_motion(), TUNING)
    other = tuned(
        replace(BELIEF, gain=(0.6, 1.4, 0.8, -1.2, 2.2, 1.9)),
        short_motion(),
        replace(TUNING, bandwidth_hz=3.1, velocity_cutoff_hz=29.0, damping=0.9, integral_hz=0.0),
    )
    q = np.stack((readings(rng), readings(rng) - 0.003), axis=1)
    limits = np.stack((LIMIT, 2.5 * LIMIT))
    together = commanded([first, other], q, limits)
    for i, controller in enumerate((first, other)):
        alone = commanded([controller], q[:, i : i + 1], limits[i : i + 1])
        np.testing.assert_array_equal(together[:, i : i + 1], alone)


def test_a_command_changes_nothing_that_it_was_given(rng):
    periods = ControlPeriods([tuned(BELIEF, short_motion(), TUNING)], 3)
    assert periods.q_ref is not None
    given = (periods.reference, periods.q_ref, periods.reading)
    kept = [rng.normal(size=each.shape) for each in given]
    periods.reference[:], periods.q_ref[:] = kept[:2]
    periods.switch_on(kept[2][0])
    for k in range(3):
        periods.reading[k] = kept[2][k]
        periods.command(k)
    for each, before in zip(given, kept, strict=True):
        np.testing.assert_array_equal(each, before)


def test_controllers_that_are_switched_on_again_have_forgotten_everything(rng):
    controller, q = tuned(BELIEF, short_motion(), TUNING), readings(rng)
    periods, found = ControlPeriods([controller], PERIODS), []
    assert periods.q_ref is not None
    periods.reference[:, 0], periods.q_ref[:, 0] = controller.reference[:PERIODS], controller.q_ref[:PERIODS]
    for _ in range(2):
        periods.switch_on(q[:1])
        for k in range(PERIODS):
            periods.reading[k, 0] = q[k]
            periods.command(k)
        found.append(periods.v.copy())
        periods.go_on()
    np.testing.assert_array_equal(*found)


def test_the_loop_commands_what_the_law_says_for_what_the_encoders_read():
    sensors = replace(experiment().sensors, current_white=0.0, current_coloured=0.0)
    belief = replace(BELIEF, gain=(1.1, 0.9, 1.2, 0.8, 1.3, 0.7))
    options = ControllerOptions(bandwidth_hz=7.0, integral_hz=0.4, velocity_cutoff_hz=90.0)
    run = experiment(sensors=sensors, belief=belief, controller=options)
    largest = np.abs(record([run], streams(4), threads=1)[0].v).max(axis=0)
    for limit in (1.1 * largest, 0.99 * largest):
        (recording,) = record([replace(run, plant=nominal_plant(current_limit=limit))], streams(4), threads=1)
        controller = tuned(belief, run.trajectory, options)
        v = commanded([controller], recording.q[:, None, :], limit[None])[:, 0]
        np.testing.assert_array_equal(recording.v, v)
        assert (np.abs(v) == limit).any() == (limit < largest).all()


def test_what_the_controller_divides_by_is_its_belief_and_not_the_truth():
    true = nominal_plant(gain=np.array([0.7, 1.6, 0.8, 1.5, 0.6, 1.9]))
    sensors = replace(experiment().sensors, current_white=0.0, current_coloured=0.0)
    v = [record([experiment(plant=p, sensors=sensors)], streams(0), threads=1)[0].v[0] for p in (nominal_plant(), true)]
    np.testing.assert_array_equal(*v)


def test_gains_wired_backwards_are_driven_by_a_controller_that_knows_it():
    gain = np.array([-0.9, 1.1, -1.3, 0.8, 1.2, -0.7])
    plant, belief = nominal_plant(gain=gain), replace(BELIEF, gain=tuple(gain.tolist()))
    sensors = replace(experiment().sensors, current_white=0.0, current_coloured=0.0)
    offset = np.zeros(6)
    turned, plain = (
        record([experiment(plant=p, belief=b, sensors=sensors)], streams(0), threads=1)[0]
        for p, b in (
            (replace(plant, drives=replace(plant.drives, amplifier_offset=offset)), belief),
            (
                replace(plant, drives=replace(plant.drives, gain=np.abs(gain), amplifier_offset=offset)),
                replace(belief, gain=tuple(np.abs(gain).tolist())),
            ),
        )
    )
    np.testing.assert_array_equal(turned.q, plain.q)
    np.testing.assert_array_equal(turned.v, np.sign(gain) * plain.v)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"rate_hz": 0.0}, r"controller: rate_hz = 0: expected 1 to 100000 Hz"),
        ({"rate_hz": 1e9}, r"controller: rate_hz = 1e\+09: expected 1 to 100000 Hz"),
        ({"bandwidth_hz": 0.0}, r"bandwidth_hz = 0: expected more than 0 to 10000 Hz"),
        ({"damping": -0.1}, r"damping = -0\.1: expected 0 to 100$"),
        ({"feedforward": np.nan}, r"feedforward = nan: expected a finite number"),
    ],
)
def test_impossible_tunings_are_refused(values, message):
    with pytest.raises(PlantError, match=message):
        ControllerOptions(**values)
