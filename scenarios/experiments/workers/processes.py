"""Processes of this machine, forked from a server that has imported the modules of the workers.

They import the same modules as their parent process, also where the working folder has a `sim.py` of the user.
"""

import argparse
import gc
import multiprocessing
import os
import signal
import threading
from collections.abc import Generator, Mapping
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager

from scenarios.experiments.workers.execute import WorkerKind, Workers

WORKER = "scenarios.experiments.trials"
"""Module that a worker imports."""
MOST_PER_CORE = 4
"""Largest number of workers per core; each takes 350 MB, and more than one per core save no time."""


@contextmanager
def local_processes(jobs: int) -> Generator[Workers]:
    """Processes of this machine.

    They are terminated at exit, and end themselves if this process is killed.
    """
    before, environment = set(multiprocessing.active_children()), dict(os.environ)
    start = multiprocessing.get_context(_start_method())
    try:
        yield Workers(
            lambda: ProcessPoolExecutor(jobs, start, initializer=_begin_work, initargs=(environment,)), lambda: jobs
        )
    finally:
        for child in set(multiprocessing.active_children()) - before:
            child.kill()


def _start_method() -> str:
    """Start the fork server, without the working folder, and without the signals of a terminal, which are for us."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return "spawn"
    from multiprocessing import forkserver, resource_tracker  # not available on every platform

    forkserver.set_forkserver_preload([WORKER])
    environment, blocked = dict(os.environ), signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGHUP])
    try:
        os.environ["PYTHONSAFEPATH"] = "1"
        resource_tracker.ensure_running()  # which unblocks SIGINT
        signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
        forkserver.ensure_running()
    finally:
        _set_environment(environment)
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
    return "forkserver"


def _set_environment(wanted: Mapping[str, str]) -> None:
    for name in os.environ.keys() - wanted.keys():
        del os.environ[name]
    os.environ.update(wanted)


def _begin_work(environment: Mapping[str, str]) -> None:
    """Take over the environment of the main process, and end together with it."""
    _set_environment(environment)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    gc.freeze()  # imports stay: a collection of the rest takes a quarter of a millisecond

    def end_with_parent() -> None:
        parent = multiprocessing.parent_process()
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=end_with_parent, daemon=True).start()


def usable_cores() -> int:
    """Return the number of cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _jobs(text: str) -> str:
    most = MOST_PER_CORE * usable_cores()
    try:
        jobs = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
    if not 1 <= jobs <= most:
        cores = "1 core" if usable_cores() == 1 else f"{usable_cores()} cores"
        raise argparse.ArgumentTypeError(f"expected a number from 1 to {most}; this machine has {cores} to use")
    return text


PROCESSES = WorkerKind(
    option="jobs",
    metavar="J",
    help="processes on this machine (default: one per core)",
    checked=_jobs,
    open=lambda value: local_processes(usable_cores() if value is None else int(value)),
)
