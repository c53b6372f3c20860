"""The native law against the same law in Python around `mj_step`, and what it refuses."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from plants import BELIEF, experiment, nominal_plant, streams

from sim.compile import lean_model
from sim.controller import ControllerOptions, tuned
from sim.effects import ModelErrors
from sim.errors import Diverged, PlantError
from sim.experiment import Experiment
from sim.record import record
from sim.sensors import SENSORS, SensorOptions
from sim.trajectory import FourierTrajectory

GAIN = np.array([-0.9, 1.1, -1.3, 0.8, 1.2, -0.7])
NATIVE = ControllerOptions(law="native", bandwidth_hz=7.0, damping=0.6, velocity_cutoff_hz=90.0, feedforward=0.9)
NOISE = 3e-5
LAWS = ("filtered", "native")


def native(**changes) -> Experiment:
    """Drives wired both ways and with offsets, a controller that believes in other gains, noisy encoders."""
    plant = nominal_plant(
        gain=GAIN, amplifier_offset=np.array([0.8, -1.1, 0.4, 0.3, -0.2, 0.1]), coulomb_asymmetry=np.linspace(-1, 1, 6)
    )
    belief = replace(BELIEF, gain=tuple((1.1 * GAIN).tolist()))
    run = experiment(
        plant=plant, belief=belief, controller=NATIVE, sensors=SensorOptions(encoder_noise=NOISE), loaded=True
    )
    return replace(run, **changes)


def stepped(run: Experiment, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Readings before they are rounded, and currents: the law as `sim.servo` writes it, in every step."""
    controller = tuned(run.belief, run.trajectory, run.controller)
    model, limit = lean_model(run.plant, loaded=run.loaded, step=run.step), run.plant.drives.current_limit
    if run.plant.errors.wrist_coupling:  # Euler takes viscous friction of a coupled motor as it is when a step begins
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    data, N = mujoco.MjData(model), len(controller.reference)
    data.qpos[:] = controller.q_ref[0]
    e, speed = NOISE * streams(seed)[0]["encoder"].standard_normal((N, 6)), np.zeros(6)
    q, v = np.empty((2, N, 6))
    for k in range(N):
        q[k] = data.qpos + e[k]
        speed += controller.blend * ((e[k] - e[max(k - 1, 0)]) * run.controller.rate_hz - speed)
        wanted = controller.reference[k] - controller.kp * q[k] - controller.kd * (data.qvel + speed)
        v[k] = data.ctrl[:] = np.clip(wanted, -limit, limit)
        mujoco.mj_step(model, data)
    return q, v


@pytest.mark.parametrize("errors", [{}, {"wrist_coupling": 1.0}])
def test_the_native_law_is_what_its_docstring_says_saturation_included(errors):
    run = native()
    run = replace(run, plant=replace(run.plant, errors=ModelErrors(**errors)))
    largest = np.abs(record([run], streams(4), threads=1)[0].v).max(axis=0)
    for limit in (1.1 * largest, 0.97 * largest):
        limited = replace(run, plant=replace(run.plant, drives=replace(run.plant.drives, current_limit=limit)))
        (log,) = record([limited], streams(4), threads=1)
        q, v = stepped(limited, 4)
        assert (np.abs(v) == limit).any() == (limit < largest).all()
        # Rounding, over 2000 steps; friction at rest magnifies it, the position gain is some 3e3 drive units a radian.
        np.testing.assert_allclose(log.q, q, rtol=0, atol=1e-9)
        np.testing.assert_allclose(log.v, v, rtol=0, atol=3e-6)


def test_the_quantum_is_in_the_log_alone():
    fine, coarse = (
        record([native(sensors=SensorOptions(encoder_noise=NOISE, encoder_quantum=each))], streams(1), threads=1)[0]
        for each in (0.0, 1e-4)
    )
    np.testing.assert_array_equal(coarse.v, fine.v)
    np.testing.assert_array_equal(coarse.q, np.rint(fine.q / 1e-4) * 1e-4)


def test_a_recording_does_not_depend_on_the_batch_or_the_law_of_others():
    filtered = replace(NATIVE, law="filtered")
    runs = [native(), native(controller=filtered), native(loaded=False), native(controller=replace(NATIVE, damping=1))]
    together = record(runs, streams(1, 2, 3, 4), threads=1)
    for i, run in enumerate(runs):
        (alone,) = record([run], streams(i + 1), threads=1)
        np.testing.assert_array_equal(together[i].q, alone.q)
        np.testing.assert_array_equal(together[i].v, alone.v)


def test_either_law_keeps_the_arm_on_the_same_motion():
    filtered, fast = (record([native(controller=replace(NATIVE, law=law))], streams(0), threads=1)[0] for law in LAWS)
    motion: FourierTrajectory = native().trajectory
    off = np.abs(filtered.q - motion(filtered.t)[0]).max()
    assert 0.0 < np.abs(filtered.q - fast.q).max() < 0.1 * off


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"controller": replace(NATIVE, integral_hz=0.5)},
            r'^motion: controller\.law = "native" does not integrate, but integral_hz = 0\.5; set it to 0, or use '
            r'controller\.law = "filtered"$',
        ),
        (
            {"step": 5e-4},
            r"needs one physics step per control period, but there are 2; set step = 0\.001, or use",
        ),
        (
            {"plant": nominal_plant(errors=ModelErrors(cogging=0.001, wrist_coupling=1.0))},
            "cannot simulate a model error that acts in every control period, as cogging does; use",
        ),
    ],
)
def test_what_the_native_law_cannot_do_is_refused(changes, message):
    with pytest.raises(PlantError, match=message):
        record([native(**changes)], streams(0), threads=1)


def test_a_sensor_that_the_native_law_would_not_hear_is_refused(monkeypatch):
    monkeypatch.setattr(SENSORS["delay"], "reader", staticmethod(lambda *_: lambda reading: None))
    with pytest.raises(PlantError, match="reads only the encoders, but delay changes what"):
        record([native()], streams(0), threads=1)


def test_a_law_that_there_is_not_is_refused():
    with pytest.raises(PlantError, match="controller: law = 'servo': expected one of filtered, native"):
        ControllerOptions(law="servo")


def test_a_motion_that_diverges_is_no_recording(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo logs its warning to the working folder
    run = native(controller=replace(NATIVE, bandwidth_hz=9e3))
    strong = replace(run.plant, drives=replace(run.plant.drives, current_limit=np.full(6, 1e9)))
    with pytest.raises(Diverged, match="motion: the simulation diverged"):
        record([replace(run, plant=strong)], streams(0), threads=1)
