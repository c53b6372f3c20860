"""What a million trials need from the process that writes them; run by `make scale`, which writes docs/scaling.md.

Trials are no work here (`bench.noop`), so that scheduler and writer are all that is measured: chunks of 32 trials
through a real Dask scheduler, parts through the study's folder, then resuming and summing up a million trials.
"""

import argparse
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace

import psutil
import pyarrow as pa
from rich.console import Console

import scenarios.experiments.study as study_module
from bench.noop import DELAY, JOINTS, no_op, synthetic_rows
from scenarios.experiments.scenario import load_scenario
from scenarios.experiments.study import CHUNK, Study, carry_out, monte_carlo, study_identity
from scenarios.experiments.study_folder import study_folder
from scenarios.experiments.workers.dask import dask_workers

ROOT = Path(__file__).parents[1]
PAGE, BEGIN, END = ROOT / "docs" / "scaling.md", "<!-- make scale -->", "<!-- /make scale -->"
MILLION = 10**6
PROCESSES, THREADS = 4, 16
SAMPLED_EVERY = 5.0
DASK = "import sys; from dask.__main__ import main; sys.argv[0] = 'dask'; main()"
MEASURED = """
import os, subprocess, sys, time
started = time.perf_counter()
process = subprocess.Popen(sys.argv[1:])  # from a small process: a child's peak begins with its parent's
_, status, used = os.wait4(process.pid, 0)
process.returncode = os.waitstatus_to_exitcode(status)
assert process.returncode in (0, 1)
print()
print(time.perf_counter() - started, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024)
"""
RESUME = """
import sys, time
from pathlib import Path
from scenarios.experiments.study_folder import StudyFolder
started = time.perf_counter()
assert StudyFolder(Path(sys.argv[1]), 6).missing(int(sys.argv[2])) == []
print(time.perf_counter() - started)
"""
QUIET = Console(quiet=True)


@dataclass(frozen=True)
class Cost:
    """Of a process that has ended: wall and processor time [s], peak memory [MB], what it printed."""

    wall: float
    cpu: float
    peak: float
    output: str


def cost_of(*command: object) -> Cost:
    words = [sys.executable, "-c", MEASURED, sys.executable, *map(str, command)]
    done = subprocess.run(words, stdout=subprocess.PIPE, text=True, cwd=ROOT, check=True)
    output, _, figures = done.stdout.rstrip("\n").rpartition("\n")
    return Cost(*map(float, figures.split()), output)


# A million trials that are there


def study_of(count: int) -> Study:
    return monte_carlo(load_scenario("nominal"), count, 0)


def fill(folder: Path, count: int) -> None:
    """A finished study, in parts as a writer leaves them."""
    study = study_of(count)
    with study_folder(folder, study_identity(study), count=count, command="", rows_per_trial=JOINTS) as place:
        for start in range(0, count, CHUNK):
            numbers = range(start, min(start + CHUNK, count))
            place.keep(synthetic_rows(numbers, numbers, study.schema))


# Many workers that cost nothing


@contextmanager
def scheduler(folder: Path) -> Iterator[SimpleNamespace]:
    """A Dask scheduler; `workers` starts a process of workers, and gives it back."""
    file, started = folder / "scheduler.json", []

    def start(*words: str, **environment: str) -> subprocess.Popen:
        command = [sys.executable, "-c", DASK, *words, "--scheduler-file", str(file), "--no-dashboard"]
        with (folder / f"{len(started)}.log").open("w") as log:
            paths = {"PYTHONPATH": str(ROOT)}
            started.append(
                subprocess.Popen(
                    [*command, "--host", "127.0.0.1"],
                    stdout=log,
                    stderr=log,
                    env=os.environ | paths | environment,
                    start_new_session=True,
                )
            )
        return started[-1]

    def workers(threads: int, delay: float = 0.0) -> subprocess.Popen:
        words = ["worker", "--nthreads", str(threads), "--local-directory", str(folder), "--no-nanny"]
        return start(*words, **{DELAY: str(delay)})

    try:
        process = start("scheduler", "--port", "0")
        while not file.exists():
            assert process.poll() is None, (folder / "0.log").read_text()
            time.sleep(0.05)
        yield SimpleNamespace(file=str(file), process=psutil.Process(process.pid), workers=workers)
    finally:
        for process in reversed(started):
            kill(process)


def kill(process: subprocess.Popen) -> None:
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


class Enough(Exception):
    """The time for a measurement is over."""


@dataclass
class Watch:
    """What the writer has done, and what it and the scheduler hold meanwhile [MB]."""

    until: float
    scheduler: psutil.Process
    chunks: int = 0
    first: float = 0.0
    spent: dict[str, float] = field(default_factory=dict)
    samples: list[tuple[float, int, float, float]] = field(default_factory=list)

    def keep(self, *args) -> None:
        now = time.monotonic()
        self.first = self.first or now
        KEEP(*args)
        self.chunks += 1
        elapsed = now - self.first
        if not self.samples or elapsed - self.samples[-1][0] > SAMPLED_EVERY:
            here = psutil.Process().memory_info().rss / 2**20
            self.samples.append((elapsed, self.chunks, here, self.scheduler.memory_info().rss / 2**20))
        if elapsed > self.until:
            raise Enough


KEEP = study_module.keep


@contextmanager
def as_no_op(keep=KEEP) -> Iterator[None]:
    task, study_module.run_task, study_module.keep = study_module.run_task, no_op, keep
    try:
        yield
    finally:
        study_module.run_task, study_module.keep = task, KEEP


def throughput(folder: Path, seconds: float) -> Watch:
    """As many trials as a scheduler with 64 worker threads, in 4 processes, carries out in a while."""
    with scheduler(folder) as cluster:
        for _ in range(PROCESSES):
            cluster.workers(THREADS)
        with dask_workers(cluster.file) as workers:
            while workers.count() < PROCESSES * THREADS:
                time.sleep(0.2)
            watch = Watch(seconds, cluster.process)
            used = psutil.Process().cpu_times(), cluster.process.cpu_times()
            with as_no_op(watch.keep), suppress(Enough):
                carry_out(study_of(100 * MILLION), folder / "out", workers, command="", console=QUIET)
            for name, before, process in zip(
                ("writer", "scheduler"), used, (psutil.Process(), cluster.process), strict=True
            ):
                after = process.cpu_times()
                watch.spent[name] = after.user + after.system - before.user - before.system
    return watch


def changing(folder: Path, count: int) -> str:
    """Workers that are slow, come late and leave: the study ends with the rows of one without any workers."""
    study = study_of(count)
    with scheduler(folder) as cluster:
        leaving = cluster.workers(1, delay=0.05)
        cluster.workers(1, delay=1.0)
        events = {8: lambda: cluster.workers(2, delay=0.02), 24: lambda: kill(leaving)}
        seen = 0

        def keep(*args) -> None:
            nonlocal seen
            KEEP(*args)
            seen += 1
            events.pop(seen, lambda: None)()

        with dask_workers(cluster.file) as workers, as_no_op(keep):
            place = carry_out(study, folder / "out", workers, command="", console=QUIET)
    assert not events, "the study ended before workers came and went"
    found = pa.concat_tables(place.tables(study.schema.names))
    assert found.equals(synthetic_rows(range(count), range(count), study.schema)), "other rows"
    return f"{count} trials, {seen} chunks: the same rows"


# The page


def table(rows: list[tuple[str, str]]) -> str:
    return "\n".join(["| | |", "|---|---|", *(f"| {name} | {value} |" for name, value in rows)])


def rewritten(page: str, part: str) -> str:
    before, _, rest = page.partition(BEGIN)
    return f"{before}{BEGIN}\n{part}\n{END}{rest.partition(END)[2]}"


def writer_rows(watch: Watch) -> list[tuple[str, str]]:
    elapsed, chunks, *_ = watch.samples[-1]
    half = next(sample for sample in watch.samples if sample[0] >= elapsed / 2)
    rate = chunks / elapsed
    later = (chunks - half[1]) / (elapsed - half[0])
    busy = ", ".join(f"{name} {1000 * spent / watch.chunks:.1f} ms" for name, spent in watch.spent.items())
    three = (watch.samples[0], half, watch.samples[-1])
    memory = [", ".join(f"{sample[k]:.0f} MB after {sample[1]} chunks" for sample in three) for k in (2, 3)]
    return [
        (f"chunks of {CHUNK} trials", f"{rate:.0f} a second over {elapsed:.0f} s, {later:.0f} in their second half"),
        ("trials carried out", f"{CHUNK * chunks:,}".replace(",", " ")),
        ("a million at that rate", f"{MILLION / CHUNK / rate / 60:.0f} minutes (extrapolated)"),
        ("processor time a chunk", busy),
        ("memory of the writer", memory[0]),
        ("memory of the scheduler", memory[1]),
    ]


def cost_words(cost: Cost) -> str:
    return f"{cost.wall:.1f} s, of which {cost.cpu:.1f} s of processor time; {cost.peak:.0f} MB at most"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=MILLION, help="of the study that is resumed and summed up")
    parser.add_argument("--seconds", type=float, default=300.0, help="that chunks are handed out")
    parser.add_argument("--write", action="store_true", help="into docs/scaling.md")
    options = parser.parse_args()
    load = os.getloadavg()[1]
    with TemporaryDirectory() as scratch:
        place, rows = Path(scratch), list[tuple[str, str]]()
        for name in ("changing", "throughput"):
            (place / name).mkdir()
        rows.append(("workers slow, late, killed", changing(place / "changing", 3000)))
        rows += writer_rows(throughput(place / "throughput", options.seconds))
        full = place / "full"
        fill(full, options.trials)
        parts = list((full / "trials").iterdir())
        size = sum(path.stat().st_size for path in parts) / 1e6
        rows.append((f"{options.trials} trials on disk", f"{size:.0f} MB in {len(parts)} parts"))
        resumed = cost_of("-c", RESUME, full, options.trials)
        rows.append(("what is there already", f"{float(resumed.output):.1f} s; {resumed.peak:.0f} MB at most"))
        words = ["-m", "scenarios", "monte-carlo", "nominal", "-n", options.trials, "--out", full, "--jobs", 1]
        rows.append(("the command on the finished study: imports, summary, pictures", cost_words(cost_of(*words))))
    machine = f"{os.cpu_count()} cores, load average {load:.1f} before and {os.getloadavg()[1]:.1f} after"
    written = f"{table(rows)}\n\nMeasured on {machine}; other work ran beside it where the load is above 0."
    print(written)
    if options.write:
        PAGE.write_text(rewritten(PAGE.read_text(encoding="utf-8"), written), encoding="utf-8")


if __name__ == "__main__":
    main()
