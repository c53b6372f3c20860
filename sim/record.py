"""`record`: simulate a plant's motions in closed loop and return the recordings.

The control law, in NumPy between the steps of MuJoCo, from encoder readings to currents in every control period:

    dq   <- dq + b ((q - q_before) / T - dq)           low-passed difference of readings, b = 1 - exp(-2 pi f_c T)
    s    <- s + Ki T (q_ref - q)                       integral action, if any
    v     = Kp (q_ref - q) + Kd (dq_ref - dq) + s + tau_ff,   all divided by g_assumed

limited by the drive to |v| <= v_max (`sim.plant`). q is the encoder reading, so encoder noise enters v through the
loop. The part that does not depend on the reading, `(Kp q_ref + Kd dq_ref + tau_ff) / g_assumed`, is tabulated with the
motion (`sim.controller`) and called reference.
"""

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import replace
from operator import itemgetter
from typing import NamedTuple

import mujoco
import numpy as np

from ident.recordings.recording import Recording
from ident.support.arrays import Array
from sim.controller import Controller, tuned
from sim.engine import Engine, Simulation, acting, varies
from sim.errors import SimulationError
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
from sim.sensors import SENSORS, check_rate, logged, noise_streams
from sim.sensors.sensor import NoiseStreams

CHUNK = 100
"""Number of control periods whose references are gathered and whose logs are stored together; they fit in the cache."""
Advanced = Callable[[float], None]
"""Callback that receives the simulated time since the last call, summed over all simulations [s]."""


def no_progress(seconds: float) -> None:
    """Callback that does nothing."""


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
        warm: dict[int, Array | SimulationError] = {
            i: np.zeros(experiments[i].plant.robot.n) for i in wave if starts_warm(experiments[i])
        }
        for share in (0.5, 1.0):  # the midpoint rule
            silent = noise_streams(np.random.default_rng(0))
            motions = {i: (warming_motion(experiments[i]), silent, warmth) for i, warmth in warm.items()}
            for i, log in _outcomes(motions, models, threads, no_progress):
                warm[i] = log if isinstance(log, SimulationError) else after_warm_up(experiments[i], log.v, share)
        starts = {
            i: (experiments[i], streams[i], warm[i] if i in warm else warmth_before(experiments, i, ended))
            for i in wave
        }
        for i, log in _outcomes(starts, models, threads, advanced):
            if is_carried(experiments[i]):
                ended[i] = log if isinstance(log, SimulationError) else log.warmth
            if isinstance(log, SimulationError):
                yield i, log
                continue
            e = experiments[i]
            seen = logged(log.q, log.v, e.controller.rate_hz, e.sensors, streams[i])
            yield i, Recording(seen.t, seen.q, seen.v, e.name)


_Models = dict[tuple[int, bool, float, int], mujoco.MjModel]


_Start = tuple[Experiment, NoiseStreams, Array | SimulationError | None]
"""An experiment, its noise, and the temperature rise of its drives, None for cold ones, or why there is none."""


class _Run(NamedTuple):
    """An experiment ready to run."""

    experiment: Experiment
    noise: NoiseStreams
    simulation: Simulation
    controller: Controller
    substeps: int


class _Done(NamedTuple):
    """Result of a successful run: readings, currents and temperature rise of the drives."""

    q: Array
    v: Array
    warmth: Array


def _outcomes(
    starts: Mapping[int, _Start], models: _Models, threads: int, advanced: Advanced
) -> Iterator[tuple[int, _Done | SimulationError]]:
    """Run experiments, sharing batches where possible."""
    groups: dict[tuple[int, float, int, Layout], list[tuple[int, _Run]]] = defaultdict(list)
    for i, start in starts.items():
        try:
            run = _prepared(start, models)
        except SimulationError as error:
            yield i, error
            continue
        samples, period = len(run.controller.reference), run.controller.period
        groups[samples, period, run.substeps, layout(run.experiment.plant)].append((i, run))
    for (_, _, steps, _), members in groups.items():
        runs = [run for _, run in members]
        with silenced():
            engine = Engine([run.simulation for run in runs], substeps=steps, threads=threads)
            logs = _closed_loop(engine, runs, advanced)
        for (i, run), q, v, warmth, unstable in zip(members, *logs, engine.warmth(), engine.unstable(), strict=True):
            failed = fault(run.experiment, run.simulation.model, q, v, unstable=bool(unstable))
            yield i, failed or _Done(q, v, warmth)


def _prepared(start: _Start, models: _Models) -> _Run:
    """Compile and tune; experiments with the same plant, load, step and number of earlier motions share a model."""
    experiment, noise, warmth = start
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
    motors, begin = plant.robot.motors, controller.q_ref[0]
    start_of_all = resting(plant, model, begin if motors is None else np.linalg.solve(motors, begin))
    simulation = Simulation(model=model, start=start_of_all, motors=motors)
    if varies(plant.errors):
        acts = acting(plant, model, step=step, earlier=earlier, warmth=warmth)
        simulation = replace(simulation, model=copy(model), varied=acts)
    return _Run(experiment, noise, simulation, controller, steps)


def _closed_loop(engine: Engine, runs: Sequence[_Run], advanced: Advanced) -> tuple[Array, Array]:
    """Run B motions of equal length and period; return readings [rad] and currents of all periods, each (B, N, n)."""
    controllers, sensors = [run.controller for run in runs], [run.experiment.sensors for run in runs]
    samples, (B, n) = len(controllers[0].reference), engine.q.shape
    q_log, v_log = np.empty((2, B, samples, n))
    made = [sensor.reader(sensors, [run.noise for run in runs], n) for sensor in SENSORS.values()]
    readers = [reader for reader in made if reader is not None]
    periods = ControlPeriods(controllers, min(CHUNK, samples))
    current, readings = engine.current, list(periods.reading)
    for start in range(0, samples, CHUNK):
        rows = slice(start, min(start + CHUNK, samples))
        length = rows.stop - start
        for i, controller in enumerate(controllers):
            periods.reference[:length, i] = controller.reference[rows]
            if periods.q_ref is not None:
                periods.q_ref[:length, i] = controller.q_ref[rows]
        for k in range(length):
            reading = readings[k]
            engine.read(reading)
            for distort in readers:
                distort(reading)
            if start + k == 0:
                periods.switch_on(reading)
            current[...] = periods.command(k)
            engine.advance()
        periods.go_on()
        q_log[:, rows] = periods.reading[:length].transpose(1, 0, 2)
        v_log[:, rows] = periods.v[:length].transpose(1, 0, 2)
        advanced(B * length * controllers[0].period)
    limits = np.stack([run.experiment.plant.drives.current_limit for run in runs])[:, None]
    return q_log, np.clip(v_log, -limits, limits, out=v_log)


class ControlPeriods:
    """B controllers in a sequence of control periods, with their readings and commands.

    With few simulations, the number of NumPy calls determines the computing time. Values that undergo the same
    operation are therefore adjacent in memory, and all views are created once. Readings [rad], references and currents
    before saturation `v` [drive units] have the shape (length, B, n). References are written before the run, a reading
    right before its period is commanded.
    """

    def __init__(self, controllers: Sequence[Controller], length: int) -> None:
        """Allocate the memory of a run of `length` control periods, for controllers of equal period."""
        kp, self._kd, ki = (np.stack([getattr(c, name) for c in controllers]) for name in ("kp", "kd", "ki"))
        B, n = kp.shape
        keeps, takes = (
            np.repeat([[each] for each in shares], n, axis=1)
            for shares in ([1.0 - c.blend for c in controllers], [c.blend / c.period for c in controllers])
        )
        self._coefficients = np.stack((-kp, keeps, np.ones((B, n)), takes))  # whole arrays: broadcasting costs
        self._ki = ki if ki.any() else None
        self._memory = np.zeros((length + 2, 4, B, n))  # a period before, then the run, then where its last one ends
        self.reading, self.reference = self._memory[1:-1, 0], self._memory[1:-1, 2]
        self.q_ref = None if self._ki is None else np.zeros((length, B, n))  # for the integral action
        self.v = np.zeros((length, B, n))
        # Of a period: readings, speed estimate of the period before, reference, difference to the readings before. The
        # results, reference minus position feedback and speed estimate, are where the next period has its first two.
        rows = zip(self._memory, self._memory[1:], self._memory[2:], self.v, strict=False)
        self._periods = [
            (now[0], before[0], now[3], now, after[:2], after[0], after[1], v) for before, now, after, v in rows
        ]
        self._products, self._product = np.empty((4, B, n)), np.empty((B, n))
        self._first, self._second = self._products[:2], self._products[2:]
        self._integral = np.zeros((B, n))

    def switch_on(self, reading: Array) -> None:
        """Put the controllers at rest before the first period, at a reading [rad], shape (B, n)."""
        self._memory[0, 0] = reading
        self._memory[1, 1] = self._integral[:] = 0.0

    def go_on(self) -> None:
        """Continue from the last period."""
        self._memory[0, 0], self._memory[1, 1] = self._memory[-2, 0], self._memory[-1, 1]

    def command(self, k: int) -> Array:
        """Compute the currents of period k from its reading and the preceding period: a row of `v`, shape (B, n)."""
        reading, before, difference, known, after, left, dq, v = self._periods[k]
        np.subtract(reading, before, difference)
        np.multiply(self._coefficients, known, self._products)
        np.add(self._first, self._second, after)
        np.multiply(self._kd, dq, self._product)
        np.subtract(left, self._product, v)
        if self._ki is not None and self.q_ref is not None:
            self._integral += self._ki * (self.q_ref[k] - reading)
            np.add(v, self._integral, v)
        return v
