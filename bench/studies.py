"""Time and memory of studies, printed as ratios; run by `make bench`.

The yardstick is `mj_step` of the same steps: the same robot from the same start under the same currents, nothing else.
There are two: the lean model that studies step, and the full one, as MuJoCo compiles the file, shapes and islands on.
"""

import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import Executor, wait
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import mujoco
import numpy as np
from threadpoolctl import threadpool_limits

import scenarios.experiments.run
import sim.closed_loop
import sim.record
from scenarios.experiments.run import motion_streams
from scenarios.experiments.scenario import load_scenario
from scenarios.experiments.setup import setup_of
from scenarios.experiments.study import CHUNK
from scenarios.experiments.study_folder import study_folder
from scenarios.experiments.trials import Task, Trial, run_task, run_trials, trial_schema
from scenarios.experiments.workers.processes import local_processes
from scenarios.support.versions import versions
from sim.compile import lean_model, plant_model
from sim.engine import Engine, Simulation
from sim.plant import Plant
from sim.record import record
from sim.sensors import SensorOptions

SCENARIO = load_scenario("nominal")
SCHEMA = trial_schema(SCENARIO, (), ())
JOBS = 2
ROUNDS = 3

START_UP = """
import sys
if __name__ == "__main__":
    from concurrent.futures import wait
    import scenarios.cli
    from scenarios.experiments.scenario import load_scenario
    from scenarios.experiments.workers.processes import local_processes
    from scenarios.experiments.study import carry_out, monte_carlo
    from scenarios.experiments.trials import Task, run_task
    from scenarios.support.versions import versions
    study = monte_carlo(load_scenario("nominal"), 1, 0)
    with local_processes(2) as workers:
        pool = workers.open()
        wait([pool.submit(run_task, Task(study.scenario, (), study.schema, versions())) for _ in range(2)])
"""


def trials(first: int, count: int = CHUNK) -> tuple[Trial, ...]:
    return tuple(Trial(number=k, seed=k) for k in range(first, first + count))


def full_model(plant: Plant, *, loaded: bool, step: float) -> mujoco.MjModel:
    """As MuJoCo compiles the file: with shapes, and constraints solved island by island."""
    model = plant_model(plant, loaded=loaded, step=step)
    model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_ISLAND)
    return model


YARDSTICKS = {"lean": lean_model, "full": full_model}


class BareStepping:
    """A chunk's simulations, replayed with the currents that its controllers commanded."""

    def __init__(self, model_of: Callable[..., mujoco.MjModel]) -> None:
        motions = setup_of(SCENARIO).experiments
        experiments = [replace(each, sensors=SensorOptions()) for _ in range(CHUNK) for each in motions]
        streams = [s for k in range(CHUNK) for s in motion_streams(k, {}, 2)]
        recordings = record(experiments, streams, threads=JOBS)  # without noise the log is what was commanded
        self.currents = np.stack([r.v for r in recordings], axis=1)  # (N, B, n)
        self.simulations = []
        for e, r in zip(experiments, recordings, strict=True):
            model = model_of(e.plant, loaded=e.loaded, step=e.step)
            self.simulations.append(Simulation(model=model, start=r.q[0]))
        self.last = np.stack([r.q[-1] for r in recordings])

    def __call__(self, threads: int) -> float:
        """Time to step once through [s]."""
        engine = Engine(self.simulations, substeps=1, threads=threads)
        started = time.perf_counter()
        for k, current in enumerate(self.currents):
            if k == len(self.currents) - 1:  # the log ends one step before the simulation does
                assert np.abs(engine.q - self.last).max() < 1e-12, "this is not the same motion"
            engine.current[:] = current
            engine.advance()
        return time.perf_counter() - started


def chunks_at_once(pool: Executor, jobs: int) -> float:
    """Time for every worker to do one chunk [s]."""
    started = time.perf_counter()
    tasks = [Task(SCENARIO, trials(k * CHUNK), SCHEMA, versions()) for k in range(jobs)]
    wait([pool.submit(run_task, task) for task in tasks])
    return time.perf_counter() - started


def study_over_stepping() -> None:
    """A study on all cores over bare stepping on all cores, and two cores against one."""
    yardsticks = {name: BareStepping(model_of) for name, model_of in YARDSTICKS.items()}
    over: dict[str, list[float]] = {name: [] for name in yardsticks}
    speed_up = []
    with local_processes(JOBS) as both, local_processes(1) as single:
        two, one = both.open(), single.open()
        chunks_at_once(two, JOBS), chunks_at_once(one, 1)  # imports, tables
        for _ in range(ROUNDS):
            stepping = {name: bare(JOBS) for name, bare in yardsticks.items()}  # one chunk on all cores
            two_s, one_s = chunks_at_once(two, JOBS), chunks_at_once(one, 1)
            for name, bare_s in stepping.items():
                over[name].append(two_s / JOBS / bare_s)
            speed_up.append(JOBS * one_s / two_s)
        steps = CHUNK * 2 * len(yardsticks["lean"].currents)
        print(f"study on {JOBS} cores: {CHUNK / two_s * JOBS:.1f} trials a second")
        for name, ratios in over.items():
            print(
                f"  over bare stepping of the {name} model on {JOBS}: {statistics.median(ratios):.2f} "
                f"({1e6 * stepping[name] / steps:.2f} us a step)"
            )
        print(f"two cores against one: {statistics.median(speed_up):.2f} times as fast")


def split() -> None:
    """Where the time of a chunk goes, on one core."""
    spent: dict[str, float] = {}

    def timed(name: str, function: Callable) -> Callable:
        def wrapped(*args, **kwargs):
            started = time.perf_counter()
            try:
                return function(*args, **kwargs)
            finally:
                spent[name] = spent.get(name, 0.0) + time.perf_counter() - started

        return wrapped

    run_trials(SCENARIO, trials(0, 2), SCHEMA, threads=1)
    Engine.advance = timed("physics", Engine.advance)
    sim.record.closed_loop = timed("loop", sim.record.closed_loop)
    sim.record.logged = timed("sensors", sim.record.logged)
    sim.record._prepared = timed("models", sim.record._prepared)
    scenarios.experiments.run.identify = timed("identification", scenarios.experiments.run.identify)
    with TemporaryDirectory() as folder:
        started = time.perf_counter()
        rows = run_trials(SCENARIO, trials(0), SCHEMA, threads=1)
        with study_folder(Path(folder), {}, count=CHUNK, command="", rows_per_trial=6) as place:
            timed("writing", place.keep)(rows)
        total = time.perf_counter() - started
    spent["controller and encoders"] = spent.pop("loop") - spent["physics"]
    spent["the rest"] = total - sum(spent.values())
    shares = ", ".join(f"{name} {100 * seconds / total:.0f} %" for name, seconds in spent.items())
    print(f"of a chunk's {total:.1f} s on one core: {shares}")


def start_up() -> None:
    """From the start of the command to workers that are ready for trials."""
    times = []
    for _ in range(5):
        started = time.perf_counter()
        subprocess.run([sys.executable, "-c", START_UP], check=True)
        times.append(time.perf_counter() - started)
    print(f"start-up of a study: {statistics.median(times):.2f} s (best {min(times):.2f})")


def memory() -> None:
    """Peak of a worker after few and after many chunks; resident, shared libraries included."""
    peaks = []
    with local_processes(1) as workers:
        pool = workers.open()
        for chunk in range(8):
            pool.submit(run_task, Task(SCENARIO, trials(chunk * CHUNK), SCHEMA, versions())).result()
            peaks.append(pool.submit(resource.getrusage, resource.RUSAGE_SELF).result().ru_maxrss / 1024)
    here = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(
        f"peak of a worker after {2 * CHUNK} trials {peaks[1]:.0f} MB, after {8 * CHUNK} {peaks[-1]:.0f} MB; "
        f"this process {here:.0f} MB"
    )


if __name__ == "__main__":
    start_up()
    memory()
    with threadpool_limits(1):
        study_over_stepping()
        split()
