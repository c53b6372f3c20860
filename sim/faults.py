"""Faults of a run: divergence, a drive at its limit, a joint outside its range."""

import mujoco
import numpy as np

from ident.support.arrays import Array
from sim.errors import Diverged, LimitReached, Saturated, SimulationError
from sim.experiment import Experiment

SATURATED_TOO_LONG = 0.1
"""Largest time at the current limit [s]."""


def fault(e: Experiment, model: mujoco.MjModel, q: Array, v: Array, *, unstable: bool) -> SimulationError | None:
    """Return the fault of a run as an error, None if there is none.

    Args:
        e: The experiment.
        model: Its model.
        q: Readings [rad], shape (N, n).
        v: Current references [drive units], shape (N, n).
        unstable: Whether MuJoCo met a bad state.
    """
    if unstable or not np.isfinite(q).all():
        return Diverged(
            f"{e.name}: the simulation diverged; use a smaller step or a softer controller, and check the plant"
        )
    return _saturated(e, model, v) or _left_range(e, model, q)


def _saturated(e: Experiment, model: mujoco.MjModel, v: Array) -> Saturated | None:
    rate, limit = e.controller.rate_hz, e.plant.drives.current_limit
    first = first_at_limit(v, limit, rate)
    if first is None:
        return None
    joint, since = first
    return Saturated(
        f"{e.name}: drive of {model.joint(joint).name} at its limit of {limit[joint]:g} for more than "
        f"{SATURATED_TOO_LONG:g} s from t = {since:.3f} s; "
        + ("use a lighter payload or a slower motion" if e.loaded else "check motion, controller and gains")
    )


def first_at_limit(v: Array, limit: Array, rate_hz: float) -> tuple[int, float] | None:
    """Return the first drive that needs its largest current, or more, for at least `SATURATED_TOO_LONG`.

    Args:
        v: Currents [drive units], shape (N, n).
        limit: Largest ones [drive units], shape (n,).
        rate_hz: Samples a second [Hz].

    Returns:
        Joint, from 0, and start time [s]; None if there is none.
    """
    run = max(1, round(SATURATED_TOO_LONG * rate_hz))
    at_limit = np.abs(v) >= limit
    if not at_limit.any():
        return None
    held = np.zeros((len(v) + 1, v.shape[1]), dtype=np.int64)  # samples at the limit before each one
    np.cumsum(at_limit, axis=0, out=held[1:])
    long = (held[run:] - held[:-run]) == run
    if not long.any():
        return None
    k, j = np.argwhere(long)[0]
    return int(j), float(k / rate_hz)


def _left_range(e: Experiment, model: mujoco.MjModel, q: Array) -> LimitReached | None:
    n = q.shape[1]  # joints of the arm; motors of their own come behind
    lower, upper = model.jnt_range[:n].T  # both 0 of a joint without a range
    beyond = ((q < lower) | (q > upper)) & (lower < upper)
    if not beyond.any():
        return None
    k, j = np.argwhere(beyond)[0]
    unit = "m" if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_SLIDE else "rad"
    return LimitReached(
        f"{e.name}: {model.joint(j).name} at {q[k, j]:.3f} {unit} leaves its range {lower[j]:.3f} to {upper[j]:.3f} "
        f"{unit} at t = {k / e.controller.rate_hz:.3f} s; use another motion or a stiffer controller"
    )
