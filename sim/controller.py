"""A digital joint controller, tuned on its model of the arm, whose law is in `sim.record`.

    Kp = M w^2,   Kd = 2 zeta w M,   Ki = 2 pi f_i Kp,   w = 2 pi bandwidth

where M is the mean diagonal of the assumed inertia matrix, including rotors, along the motion.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import mujoco
import numpy as np
from annotated_types import Interval, Unit

from ident.support.arrays import Array
from ident.support.options import refuse_outside
from sim.errors import PlantError
from sim.model_spec import file_stamp, silenced
from sim.plant import bare_arm
from sim.robot import LARGEST, Robot
from sim.trajectory import FourierTrajectory


@dataclass(frozen=True, kw_only=True)
class ControllerOptions:
    """Tuning of the controller.

    Attributes:
        rate_hz: Control and logging rate [Hz].
        bandwidth_hz: Natural frequency of each joint's position loop [Hz].
        damping: Damping ratio of the loop.
        integral_hz: Corner of the integral action [Hz], 0 for none.
        velocity_cutoff_hz: First-order low-pass of the velocity estimate [Hz].
        feedforward: Share of the bare arm's inverse dynamics that is used as feedforward, 0 to 1.
    """

    rate_hz: Annotated[float, Interval(ge=1.0, le=1e5), Unit("Hz")] = 1000.0
    bandwidth_hz: Annotated[float, Interval(gt=0.0, le=1e4), Unit("Hz")] = 8.0
    damping: Annotated[float, Interval(ge=0.0, le=100.0)] = 0.8
    integral_hz: Annotated[float, Interval(ge=0.0, le=1e4), Unit("Hz")] = 0.0
    velocity_cutoff_hz: Annotated[float, Interval(gt=0.0, le=1e6), Unit("Hz")] = 150.0
    feedforward: Annotated[float, Interval(ge=0.0, le=10.0)] = 1.0

    def __post_init__(self) -> None:
        """Check the values."""
        refuse_outside(self, PlantError, "controller")


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerBelief:
    """The controller's model of the arm: a robot with its nominal rotors, and gains that may differ from its own."""

    robot: Robot
    gain: tuple[float, ...]  # drive gains [N m / drive unit], none zero

    def __post_init__(self) -> None:
        """Check the gains."""
        if len(self.gain) != self.robot.n:
            raise PlantError(f"controller: {len(self.gain)} gains for {self.robot.n} joints; expected one per joint")
        if not all(0.0 < abs(gain) <= LARGEST for gain in self.gain):
            raise PlantError(
                f"controller: gain {list(self.gain)}: expected finite numbers up to {LARGEST:g}, none of them zero"
            )


@dataclass(frozen=True, slots=True, eq=False)
class Controller:
    """A tuned controller with its reference motion tabulated; arrays per joint are (n,)."""

    reference: Array  # `Kp q_ref + Kd dq_ref + tau_ff` over assumed gain, at every period, shape (N, n) [drive units]
    q_ref: Array  # reference positions [rad], shape (N, n)
    kp: Array  # position gain over assumed drive gain [drive units / rad]
    kd: Array  # velocity gain over assumed drive gain [drive units s / rad]
    ki: Array  # integral gain over assumed drive gain, times the period [drive units / rad]
    blend: float  # weight of the newest difference in the velocity estimate
    period: float  # control period [s]


def tuned(belief: ControllerBelief, trajectory: FourierTrajectory, options: ControllerOptions) -> Controller:
    """Tune a controller on the inertia of its model along a motion, tabulated once for batches that share it."""
    return _tuned(belief, trajectory, options, file_stamp(belief.robot.model))


@lru_cache(maxsize=16)  # a motion of 20 s at 1 kHz takes 2 MB
def _tuned(
    belief: ControllerBelief, trajectory: FourierTrajectory, options: ControllerOptions, stamp: int
) -> Controller:
    gain, robot = np.array(belief.gain, dtype=np.float64), belief.robot
    rotors, A = robot.drives.rotor_inertia, robot.motors
    model = bare_arm(robot.model, rotors if A is None else np.zeros_like(rotors), robot.flange)
    if trajectory.n != model.nv:
        raise PlantError(f"controller: the motion moves {trajectory.n} joints of an arm with {model.nv}")
    period = 1.0 / options.rate_hz
    samples = round(trajectory.duration * options.rate_hz) + 1
    q, dq, ddq = trajectory(period * np.arange(samples, dtype=np.float64))
    rate = 2.0 * np.pi * options.bandwidth_hz
    M = inertias(model, q[:: max(1, samples // 50)]).mean(axis=0)
    torque = inverse_dynamics(model, q, dq, ddq) if options.feedforward else np.zeros_like(q)
    if A is not None:  # of the motors
        through = np.linalg.inv(A)
        q, dq, ddq = (x @ A.T for x in (q, dq, ddq))
        M, torque = through.T @ M @ through + np.diag(rotors), torque @ through + rotors * ddq
    kp, kd = np.diag(M) * rate**2, 2.0 * options.damping * rate * np.diag(M)
    reference = (q * kp + dq * kd + options.feedforward * torque) / gain
    reference.flags.writeable = q.flags.writeable = False
    return Controller(
        reference=reference,
        q_ref=q,
        kp=kp / gain,
        kd=kd / gain,
        ki=kp / gain * 2.0 * np.pi * options.integral_hz * period,
        blend=1.0 - float(np.exp(-2.0 * np.pi * options.velocity_cutoff_hz * period)),
        period=period,
    )


@silenced()
def inverse_dynamics(model: mujoco.MjModel, q: Array, dq: Array, ddq: Array) -> Array:
    """Return the joint torques of a frictionless arm and its rotors [N m], shape (N, n)."""
    data, torque = mujoco.MjData(model), np.empty_like(q)
    position, speed, acceleration, needed = data.qpos, data.qvel, data.qacc, data.qfrc_inverse  # views: to ask costs
    for k in range(len(q)):
        position[:], speed[:], acceleration[:] = q[k], dq[k], ddq[k]
        mujoco.mj_inverse(model, data)
        torque[k] = needed
    return torque


@silenced()
def inertias(model: mujoco.MjModel, q: Array) -> Array:
    """Return the inertia matrices of all joints, with rotors, at positions (N, nv) [kg m^2], shape (N, nv, nv)."""
    data, M = mujoco.MjData(model), np.empty((len(q), model.nv, model.nv))
    for position, each in zip(q, M, strict=True):
        data.qpos[:] = position
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fullM(model, data, each)
    return M
