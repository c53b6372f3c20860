"""`record`: run a plant's motions in closed loop and return what its cell would have logged."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from ident.arrays import Array
from ident.recording import Recording
from sim.controller import Controller, ControllerOptions, tuned
from sim.engine import Engine
from sim.errors import Diverged, LimitReached, PlantError, Saturated, SimulationError
from sim.model import plant_model
from sim.plant import Plant
from sim.sensors import SensorOptions, logged_current
from sim.trajectory import FourierTrajectory

SATURATED_TOO_LONG = 0.1
"""Time at the current limit that makes a motion useless [s]."""
CHUNK = 500
"""Control periods whose encoder noise is drawn at once."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Experiment:
    """One motion of one plant.

    Attributes:
        name: For messages and the recording.
        plant: The truth.
        loaded: Whether the payload is mounted.
        trajectory: Reference motion.
        believed_gain: Drive gains that the controller assumes [N m / drive unit], shape (n,).
        controller: Its tuning.
        sensors: Noise levels.
        step: Physics step [s]; the control period is a multiple of it.
    """

    name: str
    plant: Plant
    loaded: bool
    trajectory: FourierTrajectory
    believed_gain: Array
    controller: ControllerOptions
    sensors: SensorOptions
    step: float


def record(experiments: Sequence[Experiment], rngs: Sequence[np.random.Generator], *, threads: int) -> list[Recording]:
    """Run experiments in one batch.

    Args:
        experiments: Motions of equal duration and rate, on arms of one layout.
        rngs: One generator an experiment; a recording depends on its own alone, not on the batch it ran in.
        threads: Threads to step with; recordings do not depend on it.

    Returns:
        One recording an experiment.

    Raises:
        SimulationError: The first run that diverged, saturated or reached a limit, with joint and time.
    """
    outcomes = try_record(experiments, rngs, threads=threads)
    recordings = [outcome for outcome in outcomes if isinstance(outcome, Recording)]
    for outcome in outcomes:
        if isinstance(outcome, SimulationError):
            raise outcome
    return recordings


def try_record(
    experiments: Sequence[Experiment], rngs: Sequence[np.random.Generator], *, threads: int
) -> list[Recording | SimulationError]:
    """As `record`, but a run that fails is returned as its error and the others are kept."""
    bare = _compiled(experiments, loaded=False)
    heavy = _compiled([e for e in experiments if e.loaded], loaded=True)
    models = [(heavy if e.loaded else bare)[_model_key(e)] for e in experiments]
    controllers = _controllers(experiments, [bare[_model_key(e)] for e in experiments])
    streams = [rng.spawn(2) for rng in rngs]  # encoder, current
    engine = Engine(
        models,
        np.stack([controller.q_ref[0] for controller in controllers]),
        substeps=_substeps(experiments[0]),
        threads=threads,
    )
    limits = np.stack([e.plant.drives.current_limit for e in experiments])
    q, v = _closed_loop(engine, controllers, limits, experiments, [encoder for encoder, _ in streams])
    unstable = engine.unstable()
    outcomes: list[Recording | SimulationError] = []
    for i, experiment in enumerate(experiments):
        fault = _fault(experiment, models[i], q[:, i], v[:, i], bool(unstable[i]))
        outcomes.append(fault or _logged(experiment, q[:, i], v[:, i], streams[i][1]))
    return outcomes


def _model_key(experiment: Experiment) -> tuple[int, float]:
    """Experiments on the same plant and step share their compiled models."""
    return id(experiment.plant), experiment.step


def _compiled(experiments: Sequence[Experiment], *, loaded: bool) -> dict[tuple[int, float], mujoco.MjModel]:
    """One model a plant and step."""
    distinct = {_model_key(e): e for e in experiments}
    return {key: plant_model(e.plant, loaded=loaded, step=e.step) for key, e in distinct.items()}


def _controllers(experiments: Sequence[Experiment], bare: Sequence[mujoco.MjModel]) -> list[Controller]:
    """One controller an experiment; equal ones are tabulated once."""
    tables: dict[tuple[int, int, bytes, ControllerOptions], Controller] = {}
    keys = []
    for e, model in zip(experiments, bare, strict=True):
        key = (id(model), id(e.trajectory), np.asarray(e.believed_gain).tobytes(), e.controller)
        keys.append(key)
        if key not in tables:
            tables[key] = tuned(model, e.trajectory, e.believed_gain, e.controller)
    if len({len(c.reference) for c in tables.values()}) > 1:
        raise PlantError("experiments of one batch need equal durations and control rates")
    return [tables[key] for key in keys]


def _substeps(experiment: Experiment) -> int:
    ratio = 1.0 / (experiment.controller.rate_hz * experiment.step)
    if round(ratio) < 1 or abs(ratio - round(ratio)) > 1e-6:
        raise PlantError(
            f"step {experiment.step:g} s does not divide the control period {1.0 / experiment.controller.rate_hz:g} s"
        )
    return round(ratio)


def _closed_loop(
    engine: Engine,
    controllers: Sequence[Controller],
    limits: Array,
    experiments: Sequence[Experiment],
    encoders: Sequence[np.random.Generator],
) -> tuple[Array, Array]:
    """Encoder readings and current references of every control period, each (N, B, n).

    The controller's law is written with in-place operations on (B, n) arrays: for a few simulations the cost
    of this loop is the number of NumPy calls, not arithmetic.
    """
    kp, kd, ki = (np.stack([getattr(c, name) for c in controllers]) for name in ("kp", "kd", "ki"))
    blend = np.array([[c.blend] for c in controllers])
    per_second = np.array([[c.blend / c.period] for c in controllers])
    quantum = np.array([[e.sensors.encoder_quantum] for e in experiments])
    noise_std = np.array([e.sensors.encoder_noise for e in experiments])
    references, integral = [c.reference for c in controllers], bool(ki.any())
    samples, (B, n) = len(references[0]), engine.q.shape
    q_log, v_log = np.empty((samples, B, n)), np.empty((samples, B, n))
    reading, v, dq, total, previous = engine.q.copy(), *(np.zeros((B, n)) for _ in range(3)), engine.q.copy()
    change = np.empty((B, n))
    quantised, below = quantum > 0.0, -limits
    rounding = bool(quantised.any())
    resolution = np.where(quantised, quantum, 1.0)
    for start in range(0, samples, CHUNK):
        stop = min(start + CHUNK, samples)
        reference = np.stack([table[start:stop] for table in references], axis=1)
        noise = np.stack([rng.standard_normal((stop - start, n)) for rng in encoders], axis=1) * noise_std[:, None]
        for k in range(start, stop):
            np.add(engine.q, noise[k - start], out=reading)
            if rounding:
                np.divide(reading, resolution, out=change)
                np.rint(change, out=change)
                change *= resolution
                np.copyto(reading, change, where=quantised)
            if k == 0:
                previous[:] = reading
            np.subtract(reading, previous, out=change)
            change *= per_second
            dq *= 1.0 - blend
            dq += change
            previous[:] = reading
            np.multiply(kp, reading, out=change)
            np.subtract(reference[k - start], change, out=v)
            np.multiply(kd, dq, out=change)
            v -= change
            if integral:
                total += ki * (np.stack([c.q_ref[k] for c in controllers]) - reading)
                v += total
            np.minimum(v, limits, out=v)
            np.maximum(v, below, out=v)
            engine.current[:] = v
            q_log[k], v_log[k] = reading, v
            engine.advance()
    return q_log, v_log


def _logged(experiment: Experiment, q: Array, v: Array, rng: np.random.Generator) -> Recording:
    rate = experiment.controller.rate_hz
    return Recording(np.arange(len(q)) / rate, q, logged_current(v, rate, experiment.sensors, rng), experiment.name)


def _fault(e: Experiment, model: mujoco.MjModel, q: Array, v: Array, unstable: bool) -> SimulationError | None:
    """Why a run is no recording, None if it is one."""
    names = [model.joint(j).name for j in range(model.njnt)]
    rate = e.controller.rate_hz
    run = max(1, round(SATURATED_TOO_LONG * rate))
    at_limit = np.abs(v) >= e.plant.drives.current_limit
    held = np.cumsum(at_limit, axis=0)
    long = (held[run:] - held[:-run]) == run
    if long.any():
        k, j = np.argwhere(long)[0]
        return Saturated(
            f"{e.name}: drive of {names[j]} at its limit of {e.plant.drives.current_limit[j]:g} for more than "
            f"{SATURATED_TOO_LONG:g} s from t = {(k + 1) / rate:.3f} s; "
            + ("use a lighter payload or a slower motion" if e.loaded else "check motion, controller and gains")
        )
    beyond = (q < model.jnt_range[:, 0]) | (q > model.jnt_range[:, 1])
    if beyond.any():
        k, j = np.argwhere(beyond)[0]
        low, high = model.jnt_range[j]
        return LimitReached(
            f"{e.name}: {names[j]} at {q[k, j]:.3f} rad leaves its range {low:.3f} to {high:.3f} rad "
            f"at t = {k / rate:.3f} s; use another motion or a stiffer controller"
        )
    if unstable or not np.isfinite(q).all():
        return Diverged(f"{e.name}: the simulation diverged; use a smaller step or a softer controller")
    return None
