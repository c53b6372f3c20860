"""`record`: simulate a plant's motions in closed loop and return the recordings."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass
from operator import itemgetter
from typing import NamedTuple

import mujoco
import numpy as np

from ident.recordings.recording import Recording
from ident.support.arrays import Array
from sim.closed_loop import Advanced, closed_loop, no_progress
from sim.controller import Controller, tuned
from sim.engine import Engine, Simulation, acting, varies
from sim.errors import PlantError, SimulationError
from sim.experiment import (
    Experiment,
    after_warm_up,
    fault,
    is_carried,
    starts_warm,
    substeps,
    warming_motion,
    warmth_before,
)
from sim.model_spec import silenced
from sim.plant import Layout, layout, plant_model, resting
from sim.sensors import check_rate, logged, noise_streams
from sim.sensors.sensor import NoiseStreams


def record(
    experiments: Sequence[Experiment],
    streams: Sequence[NoiseStreams],
    *,
    threads: int,
    advanced: Advanced = no_progress,
) -> list[Recording]:
    """Run experiments; those of equal duration, rate and step on plants of one layout share a batch.

    A recording depends only on its own noise stream, neither on the batch nor on threads. `advanced` receives the
    simulated time, without warm-ups. Raises `SimulationError` if a run could not be built, diverged, saturated or
    reached a limit (the first one).
    """
    recordings = list[Recording]()
    for _, outcome in sorted(each_record(experiments, streams, threads=threads, advanced=advanced), key=itemgetter(0)):
        if isinstance(outcome, SimulationError):
            raise outcome
        recordings.append(outcome)
    return recordings


def each_record(
    experiments: Sequence[Experiment],
    streams: Sequence[NoiseStreams],
    *,
    threads: int,
    advanced: Advanced = no_progress,
) -> Iterator[tuple[int, Recording | SimulationError]]:
    """Yield the outcomes of `record` one at a time, with the number of the experiment; a failed run yields its error.

    Motions of a robot with warming drives run in sequence, others in parallel: an experiment with `earlier` above 0
    must directly follow the preceding one.
    """
    models: _Models = {}
    ended: dict[int, Array | SimulationError] = {}
    waves: dict[int, list[int]] = defaultdict(list)
    for i, experiment in enumerate(experiments):
        waves[experiment.earlier if is_carried(experiment) else 0].append(i)
    for _, wave in sorted(waves.items()):
        ready: list[tuple[int, _Run]] = []
        warm = _warm([(i, experiments[i]) for i in wave if starts_warm(experiments[i])], models, threads)
        for i in wave:
            try:
                warmth = warm[i] if i in warm else warmth_before(experiments, i, ended)
                ready.append((i, _prepared(experiments[i], streams[i], models, warmth)))
            except SimulationError as error:
                ended[i] = error
                yield i, error
        for i, run, log in _run_all(ready, threads, advanced):
            if is_carried(experiments[i]):
                ended[i] = log if isinstance(log, SimulationError) else log.warmth
            if isinstance(log, SimulationError):
                yield i, log
                continue
            e = run.experiment
            seen = logged(log.q, log.v, e.controller.rate_hz, e.sensors, run.noise)
            yield i, Recording(seen.t, seen.q, seen.v, e.name)


_Models = dict[tuple[int, bool, float, int], mujoco.MjModel]


def _warm(
    experiments: Sequence[tuple[int, Experiment]], models: _Models, threads: int
) -> dict[int, Array | SimulationError]:
    """Return the temperature rise of drives after a warm-up [K], by the midpoint rule (`sim.experiment`)."""
    found: dict[int, Array | SimulationError] = {i: np.zeros(each.plant.robot.n) for i, each in experiments}
    for share in (0.5, 1.0) if experiments else ():
        ready: list[tuple[int, _Run]] = []
        for i, experiment in experiments:
            warmth, motion = found[i], warming_motion(experiment)
            if isinstance(warmth, SimulationError):
                continue
            try:
                ready.append((i, _prepared(motion, noise_streams(np.random.default_rng(0)), models, warmth)))
            except PlantError as error:
                found[i] = error
        for i, run, log in _run_all(ready, threads, no_progress):
            found[i] = log if isinstance(log, SimulationError) else after_warm_up(run.experiment, log.v, share)
    return found


@dataclass(frozen=True, slots=True, eq=False)
class _Run:
    """An experiment ready to run."""

    experiment: Experiment
    simulation: Simulation
    controller: Controller
    substeps: int
    noise: NoiseStreams


class _Done(NamedTuple):
    """Result of a successful run: readings, currents and temperature rise of the drives."""

    q: Array
    v: Array
    warmth: Array


def _prepared(
    experiment: Experiment, noise: NoiseStreams, models: _Models, warmth: Array | SimulationError | None
) -> _Run:
    """Compile and tune; experiments with the same plant, load, step and number of earlier motions share a model."""
    if isinstance(warmth, SimulationError):
        raise warmth
    steps = substeps(experiment)
    check_rate(experiment.sensors, experiment.controller.rate_hz)
    plant, loaded, step, earlier = experiment.plant, experiment.loaded, experiment.step, experiment.earlier
    controller = tuned(experiment.belief, experiment.trajectory, experiment.controller)
    key = id(plant), loaded, step, earlier
    if key not in models:
        models[key] = plant_model(plant, loaded=loaded, step=step, earlier=earlier)
    model = models[key]
    start = resting(plant, model, controller.q_ref[0])
    simulation = Simulation(model=model, start=start)
    if varies(plant.errors):
        acts = acting(plant, model, step=step, earlier=earlier, warmth=warmth)
        simulation = Simulation(model=copy(model), start=start, varied=acts)
    return _Run(experiment, simulation, controller, steps, noise)


def _run_all(
    ready: Sequence[tuple[int, _Run]], threads: int, advanced: Advanced
) -> Iterator[tuple[int, _Run, _Done | SimulationError]]:
    """Run the prepared experiments, sharing batches where possible."""
    groups: dict[tuple[int, float, int, Layout], list[tuple[int, _Run]]] = defaultdict(list)
    for i, run in ready:
        samples, period = len(run.controller.reference), run.controller.period
        groups[samples, period, run.substeps, layout(run.experiment.plant)].append((i, run))
    for (_, _, steps, _), members in groups.items():
        runs = [run for _, run in members]
        with silenced():
            engine = Engine([run.simulation for run in runs], substeps=steps, threads=threads)
            found = closed_loop(
                engine,
                [run.controller for run in runs],
                np.stack([run.experiment.plant.drives.current_limit for run in runs]),
                [run.experiment.sensors for run in runs],
                [run.noise for run in runs],
                advanced=advanced,
            )
        for (i, run), q, v, warmth, unstable in zip(members, *found, engine.warmth(), engine.unstable(), strict=True):
            failed = fault(run.experiment, run.simulation.model, q, v, unstable=bool(unstable))
            yield i, run, failed or _Done(q, v, warmth)
