"""`record`: run a plant's motions in closed loop and return what its cell would have logged."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass

import mujoco
import numpy as np

from ident.arrays import Array
from ident.recording import Recording
from sim.closed_loop import closed_loop
from sim.controller import Controller, ControllerBelief, ControllerOptions, tuned
from sim.engine import Engine, Simulation
from sim.errors import Diverged, LimitReached, PlantError, Saturated, SimulationError, StepError
from sim.friction import friction_law
from sim.mechanisms import Layout, layout
from sim.model import friction_constants, plant_model, resting
from sim.plant import Plant
from sim.sensors import NoiseStreams, SensorOptions, check_rate, delayed, logged_current, logged_time
from sim.trajectory import FourierTrajectory

SATURATED_TOO_LONG = 0.1
"""Time at the current limit that makes a motion useless [s]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Experiment:
    """One motion of one plant.

    Attributes:
        name: For messages and the recording.
        plant: The truth.
        loaded: Whether the payload is mounted.
        trajectory: Reference motion.
        belief: What the controller takes the arm for.
        controller: Its tuning.
        sensors: Noise and timing.
        step: Physics step [s]; the control period is a multiple of it.
    """

    name: str
    plant: Plant
    loaded: bool
    trajectory: FourierTrajectory
    belief: ControllerBelief
    controller: ControllerOptions
    sensors: SensorOptions
    step: float


def record(experiments: Sequence[Experiment], streams: Sequence[NoiseStreams], *, threads: int) -> list[Recording]:
    """Run experiments, in one batch those that can share one.

    Args:
        experiments: Motions; those of equal duration, rate and step on plants of one layout run together.
        streams: Noise of each experiment; a recording depends on its own alone, not on the batch it ran in.
        threads: Threads to step with; recordings do not depend on it.

    Returns:
        One recording an experiment.

    Raises:
        SimulationError: The first run that could not be built, diverged, saturated or reached a limit.
    """
    outcomes = try_record(experiments, streams, threads=threads)
    recordings = [outcome for outcome in outcomes if isinstance(outcome, Recording)]
    for outcome in outcomes:
        if isinstance(outcome, SimulationError):
            raise outcome
    return recordings


def try_record(
    experiments: Sequence[Experiment], streams: Sequence[NoiseStreams], *, threads: int
) -> list[Recording | SimulationError]:
    """As `record`, but a run that fails is returned as its error and the others are kept."""
    outcomes = dict(each_record(experiments, streams, threads=threads))
    return [outcomes[i] for i in range(len(experiments))]


def each_record(
    experiments: Sequence[Experiment], streams: Sequence[NoiseStreams], *, threads: int
) -> Iterator[tuple[int, Recording | SimulationError]]:
    """As `try_record`, one outcome at a time with the number of its experiment, for whoever does not keep them all."""
    models: dict[tuple[int, bool, float], mujoco.MjModel] = {}
    groups: dict[tuple[int, float, int, Layout], list[tuple[int, _Run]]] = defaultdict(list)
    for i, (experiment, noise) in enumerate(zip(experiments, streams, strict=True)):
        try:
            prepared = _prepared(experiment, noise, models)
        except PlantError as error:
            yield i, error
        else:
            samples, period = len(prepared.controller.reference), prepared.controller.period
            groups[samples, period, prepared.substeps, layout(experiment.plant)].append((i, prepared))
    for members in groups.values():
        indices, runs = zip(*members, strict=True)
        yield from zip(indices, _run_batch(runs, threads), strict=True)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Run:
    """An experiment ready to run."""

    experiment: Experiment
    simulation: Simulation
    controller: Controller
    substeps: int
    noise: NoiseStreams


def _prepared(
    experiment: Experiment, noise: NoiseStreams, models: dict[tuple[int, bool, float], mujoco.MjModel]
) -> _Run:
    """Compile and tune; experiments on the same plant, load and step share their compiled model."""
    substeps = _substeps(experiment)
    check_rate(experiment.sensors, experiment.controller.rate_hz)
    plant, loaded, step = experiment.plant, experiment.loaded, experiment.step
    controller = tuned(experiment.belief, experiment.trajectory, experiment.controller)
    key = id(plant), loaded, step
    if key not in models:
        models[key] = plant_model(plant, loaded=loaded, step=step)
    model = models[key]
    start = resting(model, controller.q_ref[0])
    friction = friction_law(plant, friction_constants(model))
    own = model if friction is None else copy(model)
    return _Run(
        experiment=experiment,
        simulation=Simulation(model=own, start=start, friction=friction),
        controller=controller,
        substeps=substeps,
        noise=noise,
    )


def _substeps(experiment: Experiment) -> int:
    ratio = 1.0 / (experiment.controller.rate_hz * experiment.step)
    if round(ratio) < 1 or abs(ratio - round(ratio)) > 1e-6:
        raise StepError(
            f"step {experiment.step:g} s does not divide the control period {1.0 / experiment.controller.rate_hz:g} s"
        )
    return round(ratio)


def _run_batch(runs: Sequence[_Run], threads: int) -> Iterator[Recording | SimulationError]:
    engine = Engine([run.simulation for run in runs], substeps=runs[0].substeps, threads=threads)
    q, v = closed_loop(
        engine,
        [run.controller for run in runs],
        np.stack([run.experiment.plant.drives.current_limit for run in runs]),
        [run.experiment.sensors for run in runs],
        [run.noise.encoder for run in runs],
    )
    unstable = engine.unstable()
    for i, run in enumerate(runs):
        fault = _fault(run.experiment, run.simulation.model, q[i], v[i], bool(unstable[i]))
        yield fault or _logged(run, q[i], v[i])


def _logged(run: _Run, q: Array, v: Array) -> Recording:
    sensors, rate = run.experiment.sensors, run.experiment.controller.rate_hz
    return Recording(
        logged_time(len(q), rate, sensors, run.noise.clock),
        q,
        logged_current(delayed(v, rate, sensors.current_delay), rate, sensors, run.noise),
        run.experiment.name,
    )


def _fault(e: Experiment, model: mujoco.MjModel, q: Array, v: Array, unstable: bool) -> SimulationError | None:
    """Why a run is no recording, None if it is one."""
    n, rate = v.shape[1], e.controller.rate_hz
    if unstable or not np.isfinite(q).all():
        return Diverged(f"{e.name}: the simulation diverged; use a smaller step, a softer controller, a possible plant")
    names = [model.joint(j).name for j in range(n)]  # of the arm; motors of their own come behind
    run = max(1, round(SATURATED_TOO_LONG * rate))
    at_limit = np.abs(v) >= e.plant.drives.current_limit
    held = np.zeros((len(v) + 1, n), dtype=np.int64)  # samples at the limit before each one
    if at_limit.any():
        np.cumsum(at_limit, axis=0, out=held[1:])
    long = (held[run:] - held[:-run]) == run
    if long.any():
        k, j = np.argwhere(long)[0]
        return Saturated(
            f"{e.name}: drive of {names[j]} at its limit of {e.plant.drives.current_limit[j]:g} for more than "
            f"{SATURATED_TOO_LONG:g} s from t = {k / rate:.3f} s; "
            + ("use a lighter payload or a slower motion" if e.loaded else "check motion, controller and gains")
        )
    beyond = (q < model.jnt_range[:n, 0]) | (q > model.jnt_range[:n, 1])
    if beyond.any():
        k, j = np.argwhere(beyond)[0]
        low, high = model.jnt_range[j]
        return LimitReached(
            f"{e.name}: {names[j]} at {q[k, j]:.3f} rad leaves its range {low:.3f} to {high:.3f} rad "
            f"at t = {k / rate:.3f} s; use another motion or a stiffer controller"
        )
    return None
