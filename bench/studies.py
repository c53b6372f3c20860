"""Time and memory of studies, printed; run by `make bench`.

The yardstick of speed is `mj_step` of the same steps: the same robot from the same start under the same currents. What
a study costs besides its trials is measured with the rows of one trial, written again and again under other numbers.
"""

import resource
import statistics
import subprocess
import sys
import time
from concurrent.futures import Executor, wait
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pyarrow as pa
from threadpoolctl import threadpool_limits

from scenarios.experiments.run import Trial, motion_streams
from scenarios.experiments.scenario import load_scenario, setup_of
from scenarios.experiments.study import CHUNK, monte_carlo, study_identity
from scenarios.experiments.study_folder import study_folder
from scenarios.experiments.trials import Task, run_task, trial_schema
from scenarios.experiments.workers import local_processes
from scenarios.support.versions import versions
from sim.engine import Engine, Simulation
from sim.plant import plant_model
from sim.record import record
from sim.sensors import SensorOptions

SCENARIO = load_scenario("nominal")
SCHEMA = trial_schema(SCENARIO, (), ())
JOBS, ROUNDS, MANY = 2, 3, 100_000


def trials(first: int) -> tuple[Trial, ...]:
    return tuple(Trial(number=k, seed=k) for k in range(first, first + CHUNK))


class BareStepping:
    """A chunk's simulations, replayed with the currents that its controllers commanded."""

    def __init__(self) -> None:
        motions = setup_of(SCENARIO).experiments
        experiments = [replace(each, sensors=SensorOptions()) for _ in range(CHUNK) for each in motions]
        streams = [s for k in range(CHUNK) for s in motion_streams(k, {}, 2)]
        recordings = record(experiments, streams, threads=JOBS)  # without noise the log is what was commanded
        self.currents = np.stack([r.v for r in recordings], axis=1)  # (N, B, n)
        self.simulations = [
            Simulation(model=plant_model(e.plant, loaded=e.loaded, step=e.step), start=r.q[0])
            for e, r in zip(experiments, recordings, strict=True)
        ]
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
    wait([pool.submit(run_task, Task(SCENARIO, trials(k * CHUNK), SCHEMA, versions())) for k in range(jobs)])
    return time.perf_counter() - started


def study_over_stepping() -> None:
    """A study on all cores over bare stepping on all cores, two cores against one, and the peak of a worker."""
    bare, over, speed_up = BareStepping(), list[float](), list[float]()
    with local_processes(JOBS) as both, local_processes(1) as single:
        two, one = both.open(), single.open()
        chunks_at_once(two, JOBS), chunks_at_once(one, 1)  # imports, tables
        for _ in range(ROUNDS):
            bare_s, two_s, one_s = bare(JOBS), chunks_at_once(two, JOBS), chunks_at_once(one, 1)
            over.append(two_s / JOBS / bare_s)
            speed_up.append(JOBS * one_s / two_s)
        peak = one.submit(resource.getrusage, resource.RUSAGE_SELF).result().ru_maxrss / 1024
    step_us = 1e6 * bare_s / (2 * CHUNK * len(bare.currents))
    print(f"study on {JOBS} cores: {CHUNK / two_s * JOBS:.1f} trials a second; a worker takes {peak:.0f} MB at most")
    print(f"  over bare stepping on {JOBS}: {statistics.median(over):.2f} ({step_us:.2f} us a step)")
    print(f"two cores against one: {statistics.median(speed_up):.2f} times as fast")


def besides_trials() -> None:
    """Writing rows of many trials, and the command on the finished study: imports, resuming, summary, pictures."""
    study = monte_carlo(SCENARIO, MANY, 0)
    rows = pa.concat_tables([run_task(Task(SCENARIO, trials(0)[:1], SCHEMA))] * CHUNK)
    places = [(SCHEMA.get_field_index(name), name) for name in ("trial", "seed")]
    with TemporaryDirectory() as scratch:
        folder = Path(scratch) / "study"
        started = time.process_time()
        with study_folder(folder, study_identity(study), count=MANY, command="", rows_per_trial=6) as place:
            for first in range(0, MANY, CHUNK):
                numbers = pa.array(np.repeat(np.arange(first, first + CHUNK), len(rows) // CHUNK))
                for at, name in places:
                    rows = rows.set_column(at, name, numbers)
                place.keep(rows)
        written = 1e3 * (time.process_time() - started) / (MANY / CHUNK)
        command = ["-m", "scenarios", "monte-carlo", "nominal", "-n", str(MANY), "--out", str(folder), "--jobs", "1"]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run([sys.executable, *command], stdout=subprocess.DEVNULL)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        assert done.returncode in (0, 1)
        size = sum(path.stat().st_size for path in (folder / "trials").iterdir()) / 1e6
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(f"{MANY} trials on disk: {size:.0f} MB; writing takes {written:.1f} ms of CPU a chunk of {CHUNK}")
    print(f"the command on the finished study: {cpu:.1f} s of CPU, {after.ru_maxrss / 1024:.0f} MB at most")


if __name__ == "__main__":
    with threadpool_limits(1):
        besides_trials()
        study_over_stepping()
