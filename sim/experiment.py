"""An experiment: one motion of one plant, with its controller and sensors; sequences of motions; faults of a run.

Motions of drives that do not warm up are independent and may run in parallel; others start with the temperature that
the earlier motions of the robot left. A warm-up is not simulated completely: drives that warm up within minutes respond
to the mean of I^2 R. It is computed with the midpoint rule: one motion with cold drives gives the load for the first
half, and a motion with the drives at the temperature after this half gives the load for the whole warm-up.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from ident.support.arrays import Array
from sim.controller import ControllerBelief, ControllerOptions
from sim.effects import Temperature
from sim.effects.motors import warmed
from sim.errors import DIVERGED, LIMIT_REACHED, SATURATED, PlantError, SimulationError, TrajectoryError
from sim.model_spec import arm_joints
from sim.plant import Plant
from sim.sensors import SensorOptions
from sim.trajectory import FourierTrajectory

MOST_STEPS = 5e7
"""Largest number of physics steps of a motion; they take some minutes."""
MOST_NUMBERS = 5e7
"""Largest number of samples times joints of a motion; tables, noise and log then take 5 GB."""
SATURATED_TOO_LONG = 0.1
"""Largest time at the current limit [s]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Experiment:
    """One motion of one plant."""

    name: str
    plant: Plant
    loaded: bool  # whether the plant's payload is mounted
    trajectory: FourierTrajectory
    belief: ControllerBelief
    controller: ControllerOptions
    sensors: SensorOptions
    step: float  # physics step [s]; the control period is a multiple of it
    earlier: int = 0  # number of earlier motions of the robot: friction may drift between them, and drives stay warm
    warm_up: float = 0.0  # time for which the motion was repeated with a bare flange before the first one [s]
    pause: float = 0.0  # rest before this motion [s], unless it is the first


def substeps(experiment: Experiment) -> int:
    """Return the number of physics steps per control period; raises `PlantError` if it is not whole."""
    rate, step, duration = experiment.controller.rate_hz, experiment.step, experiment.trajectory.duration
    name, n = experiment.name, experiment.plant.robot.n
    if not step > 0.0:
        raise PlantError(f"step = {step:g} s: expected a positive number")
    if duration / step > MOST_STEPS:
        raise PlantError(
            f"{name}: {duration:g} s in steps of {step:g} s are {duration / step:.2g} steps; {MOST_STEPS:g} at most; "
            "use a larger step or a shorter motion"
        )
    if duration * rate * n > MOST_NUMBERS:
        raise PlantError(
            f"{name}: {duration:g} s at {rate:g} Hz are {duration * rate:.2g} samples of {n} joints; {MOST_NUMBERS:g} "
            "numbers at most; use a lower rate or a shorter motion"
        )
    ratio = 1.0 / (rate * step)
    if round(ratio) < 1 or abs(ratio - round(ratio)) > 1e-6:
        raise PlantError(f"step {step:g} s does not divide the control period {1.0 / rate:g} s")
    return round(ratio)


def is_carried(experiment: Experiment) -> bool:
    """Return whether the robot's drives warm up, so that earlier motions have an effect."""
    return Temperature.varies(experiment.plant.errors)


def starts_warm(experiment: Experiment) -> bool:
    """Return whether it is a first motion after a warm-up that has an effect."""
    return is_carried(experiment) and experiment.earlier == 0 and experiment.warm_up > 0.0


def warming_motion(experiment: Experiment) -> Experiment:
    """Return the warm-up motion of an experiment: the same motion with a bare flange, not recorded."""
    return replace(experiment, name=f"warm-up before {experiment.name}", loaded=False, sensors=SensorOptions())


def after_warm_up(experiment: Experiment, v: Array, share: float) -> Array:
    """Return the temperature rise of cold drives after a share of a warm-up that repeats currents v [K], (n,)."""
    load = np.mean((v / experiment.plant.drives.current_limit) ** 2, axis=0)
    return warmed(experiment.plant.errors, np.zeros(v.shape[1]), load, share * experiment.warm_up)


def warmth_before(
    experiments: Sequence[Experiment], i: int, ended: Mapping[int, Array | SimulationError]
) -> Array | SimulationError | None:
    """Return the temperature rise at the start of motion i [K], shape (n,); None if cold or without effect.

    `ended` has the final rise of the earlier motions, or their errors; `PlantError` without the preceding one.
    """
    experiment = experiments[i]
    if not is_carried(experiment) or not experiment.earlier:
        return None
    if i == 0 or experiments[i - 1].earlier != experiment.earlier - 1 or i - 1 not in ended:
        return PlantError(
            f"{experiment.name}: motion {experiment.earlier + 1}: drives warm up, but the preceding "
            "motion is missing; pass all motions in order of time"
        )
    before = ended[i - 1]
    if isinstance(before, SimulationError):
        return before
    return warmed(experiment.plant.errors, before, np.zeros_like(before), experiment.pause)


def fault(e: Experiment, model: mujoco.MjModel, q: Array, v: Array, *, unstable: bool) -> SimulationError | None:
    """Return the fault of a run as an error: divergence, a drive at its limit, a joint outside its range; or None."""
    if unstable or not np.isfinite(q).all():
        return TrajectoryError(
            f"{e.name}: the simulation diverged; use a smaller step or a softer controller, and check the plant",
            kind=DIVERGED,
        )
    rate, own = e.controller.rate_hz, arm_joints(model)
    if (saturated := saturation(e, model, v, rate)) is not None:
        return saturated
    if (motors := e.plant.robot.motors) is not None:
        q = np.asarray(np.linalg.solve(motors, q.T).T, np.float64)
    lower, upper = model.jnt_range[own].T  # both 0 without a range
    beyond = ((q < lower) | (q > upper)) & (lower < upper)
    if not beyond.any():
        return None
    k, j = np.argwhere(beyond)[0]
    unit = "m" if model.jnt_type[own][j] == mujoco.mjtJoint.mjJNT_SLIDE else "rad"
    return TrajectoryError(
        f"{e.name}: {model.joint(own.start + j).name} at {q[k, j]:.3f} {unit} leaves its range {lower[j]:.3f} to "
        f"{upper[j]:.3f} {unit} at t = {k / rate:.3f} s; use another motion or a stiffer controller",
        joint=int(j),
        value=float(q[k, j]),
        bounds=(float(lower[j]), float(upper[j])),
        kind=LIMIT_REACHED,
    )


def saturation(e: Experiment, model: mujoco.MjModel, v: Array, rate_hz: float) -> TrajectoryError | None:
    """Return the error of the first drive whose needed currents (N, n) are too long at its limit; None if none is."""
    run, limit = max(1, round(SATURATED_TOO_LONG * rate_hz)), e.plant.drives.current_limit
    held = np.zeros((len(v) + 1, v.shape[1]), dtype=np.int64)  # samples at the limit before each one
    np.cumsum(np.abs(v) >= limit, axis=0, out=held[1:])
    found = np.argwhere((held[run:] - held[:-run]) == run)
    if not len(found):
        return None
    k, j = found[0].tolist()
    most, largest = float(np.abs(v[:, j]).max()), float(limit[j])
    needs = (
        f"at its limit of {largest:g}" if most <= largest else f"would need up to {most:.4g}, its limit is {largest:g},"
    )
    return TrajectoryError(
        f"{e.name}: drive of {model.joint(arm_joints(model).start + j).name} {needs} for more than "
        f"{SATURATED_TOO_LONG:g} s from t = {k / rate_hz:.3f} s; "
        + ("use a lighter payload or a slower motion" if e.loaded else "use a slower motion, or check the controller"),
        joint=j,
        value=most,
        bounds=(-largest, largest),
        kind=SATURATED,
    )
