"""Executors: where trials run. Anything of `concurrent.futures` will do; two are ready to use."""

import logging
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Generator
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from scenarios.errors import StudyError

if TYPE_CHECKING:
    from distributed import Client

WORKER = "scenarios.workers.tasks"
"""What a worker imports."""
GONE = "the scheduler that hands out the work is gone; what is finished is kept, repeat the command"
FEWEST = 16
"""Dask workers that tasks are handed out for at least: a cluster that adapts to its load grows only if it sees some."""
PATIENCE = 10
"""How long to wait for a Dask scheduler [s]."""


@dataclass(frozen=True, slots=True)
class Workers:
    """Where tasks run.

    Attributes:
        open: Makes an executor; called again when a dying worker has broken the last one.
        count: Workers there are now, for how many tasks to hand out ahead.
        died: What a task's future raises when its worker has died.
        reachable: Whether the executor can still be spoken to.
        close: Ends an executor without waiting. Futures are the executor's own to cancel: the thread that looks after
            a process pool dies of one that others have.
    """

    open: Callable[[], Executor]
    count: Callable[[], int]
    died: type[Exception] = BrokenExecutor
    reachable: Callable[[], bool] = lambda: True
    close: Callable[[Executor], None] = lambda executor: executor.shutdown(wait=False, cancel_futures=True)


@contextmanager
def local_processes(jobs: int) -> Generator[Workers]:
    """Processes of this machine.

    They are ended on the way out, whatever they are doing, and end themselves if this process is killed.

    Args:
        jobs: How many.
    """
    before = set(multiprocessing.active_children())
    context = multiprocessing.get_context(prepare_processes())
    try:
        yield Workers(lambda: ProcessPoolExecutor(jobs, context, initializer=_begin_work), lambda: jobs)
    finally:
        for child in set(multiprocessing.active_children()) - before:
            child.terminate()


def prepare_processes() -> str:
    """Start the process that workers are forked from; it imports what they need, while the caller goes on.

    Returns:
        The start method to use: `forkserver`, or `spawn` where there is none.
    """
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return "spawn"
    from multiprocessing import forkserver  # not there on every platform

    multiprocessing.set_forkserver_preload([WORKER])
    first = threading.current_thread() is threading.main_thread()  # the only one that may handle signals
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN) if first else None  # inherited: Ctrl-C is for the caller
    forkserver.ensure_running()
    if first:
        signal.signal(signal.SIGINT, handler)
    return "forkserver"


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
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what it has to say is said in one line here
    if address.endswith(".json") and not Path(address).is_file():
        raise StudyError(f"{address}: no such scheduler file; start `dask scheduler --scheduler-file {address}` first")
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
            count=lambda: _cores_of(client),
            died=KilledWorker,
            reachable=lambda: client.status in ("running", "connecting"),
            close=lambda executor: executor.shutdown(wait=False),  # it cancels, and knows no word for it
        )


def _cores_of(client: "Client") -> int:
    try:
        return max(FEWEST, sum(client.ncores().values()))
    except OSError as error:
        raise StudyError(GONE) from error


def usable_cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _begin_work() -> None:
    """Leave Ctrl-C, which reaches every process of a terminal, to the one that asked for the work; end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
