"""Executors: where trials run. Anything of `concurrent.futures` will do; two are ready to use."""

import multiprocessing
import os
import signal
from collections.abc import Callable, Generator
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass

from scenarios.studies.errors import StudyError

THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
PATIENCE = 10
"""How long to wait for a Dask scheduler [s]."""


@dataclass(frozen=True, slots=True)
class Workers:
    """Where tasks run.

    Attributes:
        open: Makes an executor; called again when a dying worker has broken the last one.
        count: Workers there are now, for how many tasks to hand out ahead.
        died: What a task's future raises when its worker has died.
    """

    open: Callable[[], Executor]
    count: Callable[[], int]
    died: type[Exception] = BrokenExecutor


@contextmanager
def local_processes(jobs: int) -> Generator[Workers]:
    """Processes of this machine, started fresh (`spawn`), BLAS on one thread each.

    They are ended on the way out, whatever they are doing.

    Args:
        jobs: How many.
    """
    before = set(multiprocessing.active_children())
    stated = {name: os.environ.get(name) for name in THREAD_VARIABLES}
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))  # read when a worker imports its BLAS
    context = multiprocessing.get_context("spawn")
    try:
        yield Workers(lambda: ProcessPoolExecutor(jobs, context, initializer=_ignore_interrupt), lambda: jobs)
    finally:
        for name, value in stated.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
        for child in set(multiprocessing.active_children()) - before:
            child.terminate()


@contextmanager
def dask_workers(address: str) -> Generator[Workers]:
    """Workers of a Dask cluster.

    Args:
        address: Of its scheduler, as `tcp://host:8786`, or the path of its scheduler file.

    Raises:
        StudyError: If Dask is not installed or no scheduler answers.
    """
    try:
        from distributed import Client, KilledWorker
    except ImportError as error:
        raise StudyError("Dask is not installed; install the extra: pip install '.[cluster]'") from error
    try:
        if address.endswith(".json"):
            client = Client(scheduler_file=address, timeout=PATIENCE)
        else:
            client = Client(address, timeout=PATIENCE)
    except (OSError, ValueError, TimeoutError) as error:
        raise StudyError(f"no Dask scheduler answers at {address}: {error}") from error
    with client:
        yield Workers(
            open=lambda: client.get_executor(pure=False),  # a task tried again is no repetition with a known result
            count=lambda: max(1, sum(client.ncores().values())),
            died=KilledWorker,
        )


def usable_cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _ignore_interrupt() -> None:
    """Ctrl-C reaches every process of the terminal; the one that asked for the work ends its workers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
