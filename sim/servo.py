"""The control law in MuJoCo's own actuators, `law = "native"`: hundreds of control periods in one call.

    v = (Kp (q_ref - q - e) + Kd (dq_ref - dq - F e) + tau_ff) / g_believed,   |v| <= v_max

as actuators whose force is affine in position and speed, held over a physics step by the integrator `Euler`; the part
that does not depend on the state is their control. dq is the true speed of the joint, while `sim.control_law` uses a
low-passed difference of readings. e is the noise of the encoders, drawn before the motion, and F e the speed that
`sim.control_law` would estimate from it: encoder noise acts in the loop. Encoder quantisation does not: only the log is
rounded.
"""

from collections.abc import Sequence
from copy import copy

import mujoco
import numpy as np

from ident.numerics.filters import filtered
from ident.support.arrays import Array
from sim.closed_loop import Advanced, LoopLog, no_progress
from sim.controller import Controller
from sim.drives import DriveTruth
from sim.effects import EFFECTS
from sim.engine import Engine
from sim.errors import ControllerError
from sim.experiment import Experiment
from sim.sensors import SENSOR_EFFECTS, SensorOptions
from sim.sensors.effect import NoiseStreams
from sim.sensors.encoder import drawn_noise, rounded

CHUNK = 500
"""Control periods of one call."""
OTHERWISE = 'use controller.law = "filtered"'


def check_native(experiment: Experiment, steps: int, streams: NoiseStreams) -> None:
    """Check that only MuJoCo acts within and between control periods.

    Args:
        experiment: To be run with the native law.
        steps: Number of physics steps per control period.
        streams: Noise of its sensors.

    Raises:
        ControllerError: If the controller integrates, the period is not one physics step, or a model error or sensor
            acts in every control period.
    """
    name, options = experiment.name, experiment.controller
    if options.integral_hz:
        raise ControllerError(
            f'{name}: controller.law = "native" does not integrate, but integral_hz = {options.integral_hz:g}; set it '
            f"to 0, or {OTHERWISE}"
        )
    if steps != 1:
        raise ControllerError(
            f'{name}: controller.law = "native" needs one physics step per control period, but there are {steps}; '
            f"set step = {1.0 / options.rate_hz:g}, or {OTHERWISE}"
        )
    for error, effect in EFFECTS.items():
        if effect.varies(experiment.plant.errors):
            raise ControllerError(
                f'{name}: controller.law = "native" cannot simulate a model error that acts in every control '
                f"period, as {error} does; {OTHERWISE}"
            )
    n = experiment.plant.robot.n
    for sensor, effect in SENSOR_EFFECTS.items():
        if sensor != "encoder" and effect.reader([experiment.sensors], [streams], n) is not None:
            raise ControllerError(
                f'{name}: controller.law = "native" reads only the encoders, but {sensor} changes what the '
                f"controller reads; {OTHERWISE}"
            )


def servo_model(model: mujoco.MjModel, controller: Controller, drives: DriveTruth) -> mujoco.MjModel:
    """Return a plant whose actuators close the loop; its controls are `Controller.reference`."""
    servo = copy(model)
    servo.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER  # implicitfast would treat the speed feedback implicitly
    servo.actuator_biasprm[:, 1] = -drives.gain * controller.kp
    servo.actuator_biasprm[:, 2] = -drives.gain * controller.kd
    largest = np.abs(drives.gain) * drives.current_limit
    servo.actuator_forcerange[:] = servo.actuator_biasprm[:, :1] + np.outer(largest, (-1.0, 1.0))
    servo.actuator_forcelimited[:], servo.actuator_ctrllimited[:] = 1, 0
    return servo


def servo_loop(
    engine: Engine,
    controllers: Sequence[Controller],
    limits: Array,
    sensors: Sequence[SensorOptions],
    streams: Sequence[NoiseStreams],
    *,
    advanced: Advanced = no_progress,
) -> LoopLog:
    """As `sim.closed_loop.closed_loop`, of simulations on models of `servo_model`."""
    samples, (B, n) = len(controllers[0].reference), engine.q.shape
    log = LoopLog(np.empty((B, samples, n)), np.empty((B, samples, n)))
    for q, v, controller, options, noise in zip(log.q, log.v, controllers, sensors, streams, strict=True):
        q[:] = drawn_noise(options, noise, (samples, n))
        v[:] = controller.reference - controller.kp * q - controller.kd * _estimated_speed(controller, q)
    kp, kd = (np.stack(each)[:, None] for each in ([c.kp for c in controllers], [c.kd for c in controllers]))
    dq_now = np.zeros((B, 1, n))
    for start in range(0, samples, CHUNK):
        rows = slice(start, min(start + CHUNK, samples))
        q_now = engine.q[:, None].copy()
        after = engine.roll_out(np.ascontiguousarray(log.v[:, rows]))
        q, dq = (np.concatenate((x, y[:, :-1]), axis=1) for x, y in ((q_now, after.q), (dq_now, after.dq)))
        log.v[:, rows] -= kp * q + kd * dq
        log.q[:, rows] += q
        dq_now = after.dq[:, -1:]
        advanced(B * (rows.stop - rows.start) * controllers[0].period)
    for q, v, limit, options in zip(log.q, log.v, limits, sensors, strict=True):
        np.clip(v, -limit, limit, out=v)
        if options.encoder_quantum:
            rounded(q, np.full_like(q, options.encoder_quantum), q)
    return log


def _estimated_speed(controller: Controller, reading: Array) -> Array:
    """Return the speed that `sim.control_law` estimates from readings [rad/s], shape (N, n); initially at rest."""
    moved = np.diff(reading, axis=0, prepend=reading[:1])
    first_order = np.array([[controller.blend / controller.period, 0.0, 0.0, 1.0, controller.blend - 1.0, 0.0]])
    return filtered(first_order, moved)
