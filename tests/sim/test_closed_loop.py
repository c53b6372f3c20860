from dataclasses import fields, replace

import numpy as np
import pinocchio as pin
from plants import BELIEF, RX90, experiment, nominal_plant, short_motion, streams
from refusals import refused

from sim.controller import ControllerBelief, ControllerOptions, tuned
from sim.errors import PlantError
from sim.record import record
from sim.trajectory import at_rest

TUNING = ControllerOptions(
    rate_hz=400.0, bandwidth_hz=5.3, damping=0.37, integral_hz=0.7, velocity_cutoff_hz=61.0, feedforward=0.83
)
GAIN = np.array([1.3, -0.7, 0.9, 2.1, -1.7, 0.4])
ROTORS = 1.2 * RX90.drives.rotor_inertia
MOTION = short_motion(0.7, 0.02)


def documented(q: np.ndarray, limit: np.ndarray) -> np.ndarray:
    """Currents for given readings: `sim.record` and `sim.controller` as written there, by scalars."""
    arm = pin.buildModelFromMJCF(str(RX90.model))
    arm.armature = ROTORS
    data, T = arm.createData(), 1.0 / 400.0
    references = list(zip(*MOTION(T * np.arange(len(q))), strict=True))
    every = references[:: max(1, len(q) // 50)]
    M = np.mean([np.diag(pin.crba(arm, data, q_ref)) for q_ref, _, _ in every], axis=0)
    torque = np.array([pin.rnea(arm, data, *each) for each in references])
    w, b = 2 * np.pi * 5.3, 1 - np.exp(-2 * np.pi * 61.0 * T)
    v = np.empty_like(q)
    for j in range(6):
        Kp, Kd = M[j] * w * w, 2 * 0.37 * w * M[j]
        Ki = 2 * np.pi * 0.7 * Kp
        dq = s = 0.0
        before = q[0, j]
        for k, (q_ref, dq_ref, _) in enumerate(references):
            dq = dq + b * ((q[k, j] - before) / T - dq)
            before = q[k, j]
            s = s + Ki * T * (q_ref[j] - q[k, j])
            wanted = (Kp * (q_ref[j] - q[k, j]) + Kd * (dq_ref[j] - dq) + s + 0.83 * torque[k, j]) / GAIN[j]
            v[k, j] = max(-limit[j], min(limit[j], wanted))
    return v


def test_the_loop_commands_what_the_documented_law_says_for_what_the_encoders_read_up_to_the_limits_of_the_drives():
    # Neither gains nor rotors that the controller believes in are those of the plant.
    robot = RX90.model_copy(update={"drives": replace(RX90.drives, rotor_inertia=ROTORS)})
    belief = ControllerBelief(robot=robot, gain=tuple(GAIN.tolist()))
    sensors = replace(experiment().sensors, current_white=0.0, current_coloured=0.0)
    run = experiment(sensors=sensors, belief=belief, controller=TUNING, trajectory=MOTION, step=1.25e-3)
    plant = nominal_plant(gain=GAIN * [1.1, 0.9, 1.2, 0.8, 1.3, 0.7])
    largest = np.abs(record([replace(run, plant=plant)], streams(4), threads=1)[0].v).max(axis=0)
    for share in (1.1, 0.93):
        limit = share * largest
        limited = replace(plant, drives=replace(plant.drives, current_limit=limit))
        (recording,) = record([replace(run, plant=limited)], streams(4), threads=1)
        # Differences of positions times 1e4 N m/rad: four digits of 16 lost, and the integral of 280 of them.
        np.testing.assert_allclose(recording.v, documented(recording.q, limit), rtol=0, atol=1e-8)
        assert (recording.v == limit).any() == (recording.v == -limit).any() == (share < 1.0)


def test_impossible_tunings_and_beliefs_are_refused():
    two = replace(RX90.drives, **{each.name: getattr(RX90.drives, each.name)[:2] for each in fields(RX90.drives)})
    other = ControllerBelief(robot=RX90.model_copy(update={"drives": two}), gain=(1.0, 1.0))
    five = at_rest(np.zeros(5), np.zeros((5, 2)), np.full((5, 2), 0.1), 2.0)
    for make, message in (
        (lambda: ControllerOptions(rate_hz=1e9), r"controller: rate_hz = 1e\+09: expected 1 to 100000 Hz"),
        (lambda: replace(BELIEF, gain=(1.0, 1.0)), "2 gains for 6 joints; expected one per joint"),
        (lambda: replace(BELIEF, gain=(1.0, 0.0, 1.0, 1.0, 1.0, 1.0)), "finite numbers up to .*, none of them zero"),
        (lambda: replace(BELIEF, gain=(1.0, 2e9, 1.0, 1.0, 1.0, 1.0)), r"finite numbers up to 1e\+09"),
        (lambda: tuned(other, short_motion(), TUNING), "6 joints, but the controller's model has 2"),
        (lambda: tuned(BELIEF, five, TUNING), "the motion moves 5 joints of an arm with 6"),
    ):
        refused(PlantError, message, make)
