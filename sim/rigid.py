"""Torques and inertias of a compiled model along a motion, without friction.

MuJoCo's inverse dynamics is evaluated at a few samples and interpolated by splines. A joint without a drive (a link
behind its transmission) moves such that its torque balance is zero: starting from the motor's position, it is
repeatedly displaced by its torque over its stiffness.
"""

from dataclasses import dataclass, field

import mujoco
import numpy as np

from ident.numerics.splines import periodic_spline
from ident.support.arrays import Array
from sim.controller import inverse_dynamics
from sim.effects.wrist_coupling import coupling_tendons
from sim.errors import LooseTransmission
from sim.silenced_mujoco import silenced
from sim.trajectory import FourierTrajectory

SAMPLES_PER_HARMONIC = 20
"""Number of samples per period of the motion's highest harmonic."""
INERTIAS_PER_HARMONIC = 10
"""Number of samples of the inertia matrix per such period, with linear interpolation."""
YIELD_ITERATIONS = 4
"""Number of iterations; each multiplies the error by the ratio of the load's stiffness to the transmission's."""
PROBE = 1e-6
"""Step [rad] of the finite difference for a stiffness."""


@dataclass(frozen=True, slots=True)
class Frictionless:
    """A compiled model without drives and friction; two are equal if their bytes are.

    Attributes:
        saved: Its bytes.
        model: The model.
    """

    saved: bytes
    model: mujoco.MjModel = field(compare=False, repr=False)


def frictionless(model: mujoco.MjModel) -> Frictionless:
    """Remove drives and the friction of joints and coupled motors from a model, in place."""
    driven, coupled = slice(model.nv - model.nu, None), coupling_tendons(model)
    model.dof_frictionloss[:] = model.tendon_frictionloss[:] = 0.0
    model.dof_damping[driven] = model.tendon_damping[coupled] = 0.0
    model.actuator_gainprm[:] = model.actuator_biasprm[:] = 0.0
    saved = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, saved)
    return Frictionless(saved.tobytes(), model)


def torque_along(rigid: Frictionless, motion: FourierTrajectory, t: Array) -> Array:
    """Torque on the driven joints.

    Args:
        rigid: The model.
        motion: Motion of the driven joints, one period.
        t: Times [s], shape (N,).

    Returns:
        [N m], shape (N, n).
    """
    model, n = rigid.model, motion.n
    count = min(SAMPLES_PER_HARMONIC * motion.sine.shape[1], len(t) - 1)
    coarse = motion.duration / count * np.arange(count + 1)
    driven = [x[:-1] for x in motion(coarse)]
    free = model.nv - n
    torque = _yielding(model, driven, motion.duration) if free else inverse_dynamics(model, *driven)
    closed = np.vstack((torque, torque[:1]))[:, free:]
    return periodic_spline(coarse, closed)(t % coarse[-1])


@silenced()
def inertias(rigid: Frictionless, motion: FourierTrajectory, t: Array) -> Array:
    """Return the inertia matrix of the driven joints along a motion; links behind a transmission are separate.

    Args:
        rigid: The model.
        motion: Motion of the driven joints, one period.
        t: Times [s], shape (N,).

    Returns:
        [kg m^2], shape (N, n, n).
    """
    model, n = rigid.model, motion.n
    count = INERTIAS_PER_HARMONIC * motion.sine.shape[1]
    coarse = motion.duration / count * np.arange(count + 1)
    data, M, found = mujoco.MjData(model), np.empty((model.nv, model.nv)), np.empty((count + 1, n, n))
    for k, q in enumerate(motion(coarse)[0]):
        data.qpos[:n], data.qpos[-n:] = q, q
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fullM(model, data, M)
        found[k] = M[-n:, -n:] if model.nv == n else M[-n:, -n:] + M[:n, :n]
    places = np.interp(t, coarse, np.arange(count + 1.0))
    below = np.minimum(places.astype(np.intp), count - 1)
    share = (places - below)[:, None, None]
    return (1.0 - share) * found[below] + share * found[below + 1]


def _yielding(model: mujoco.MjModel, driven: list[Array], duration: float) -> Array:
    """Return the torque on all joints if joints without a drive are in equilibrium, shape (samples, nv)."""
    n = driven[0].shape[1]
    free = model.nv - n
    stiffness = _own_stiffness(model, free)
    q = driven[0][:, :free].copy()  # a link begins where its motor is
    torque = np.zeros((len(q), model.nv))
    for _ in range(YIELD_ITERATIONS):
        states = [np.hstack(pair) for pair in zip((q, *_rates(q, duration)), driven, strict=True)]
        torque = inverse_dynamics(model, *states)
        q = q - torque[:, :free] / stiffness
    return torque


def _rates(q: Array, duration: float) -> tuple[Array, Array]:
    """First and second derivative of a periodic signal, each of its shape."""
    rate = 2j * np.pi / duration * np.arange(len(q) // 2 + 1)[:, None]
    spectrum = np.fft.rfft(q, axis=0)
    return np.fft.irfft(rate * spectrum, len(q), axis=0), np.fft.irfft(rate**2 * spectrum, len(q), axis=0)


@silenced()
def _own_stiffness(model: mujoco.MjModel, free: int) -> Array:
    """Return the stiffness of each free joint from its own springs [N m/rad], shape (free,)."""
    data, stiffness = mujoco.MjData(model), np.empty(free)
    for k in range(free):
        forces = []
        for angle in (0.0, PROBE):
            data.qpos[:] = 0.0
            data.qpos[k] = angle
            mujoco.mj_fwdPosition(model, data)
            mujoco.mj_fwdVelocity(model, data)
            forces.append(float(data.qfrc_passive[k]))
        stiffness[k] = (forces[0] - forces[1]) / PROBE
    if not stiffness.all():
        raise LooseTransmission(
            f"joint {int(np.argmin(np.abs(stiffness))) + 1} is inside its backlash gap, so no current "
            "holds its position; simulate the motion instead"
        )
    return stiffness
