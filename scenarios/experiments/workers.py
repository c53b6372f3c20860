"""Workers that run tasks: processes of this machine, or a Dask cluster; and recovery from dying workers.

A process pool breaks as a whole, so a task whose worker dies need not be the cause. Each task that was lost is repeated
alone once; if it fails again, it is abandoned, with the reason. If the first few tasks are all abandoned and none has
succeeded, the workers are considered faulty, and the study ends.

Processes are forked from a server that has imported the modules of the workers. They import the same modules as their
parent process, also where the working folder has a `sim.py` of the user.
"""

import argparse
import gc
import json
import logging
import multiprocessing
import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable, Mapping
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, ParamSpec, TypeVar

from ident.support.naming import needed_extra
from scenarios.support.errors import ScenarioError

SCHEDULER_GONE = "the scheduler has exited; finished trials are kept; repeat the command"
AHEAD = 2
"""Tasks submitted per worker, so that no worker is idle."""
TICK = 0.5
"""Interval between tests whether the workers are reachable [s]."""
HOPELESS = 3
"""Number of abandoned tasks without a success after which the workers are considered faulty."""
WORKER = "scenarios.experiments.trials"
"""Module that a worker imports."""
MOST_PER_CORE = 4
"""Largest number of workers per core; each takes 350 MB, and more than one per core save no time."""
FEWEST = 16
"""Least number of Dask workers for which tasks are submitted: an adaptive cluster grows only with waiting tasks."""
LOGGERS = ("distributed", "tornado", "asyncio")
"""Loggers that report a dying scheduler."""
PATIENCE = 10.0
"""Timeout for connecting to a scheduler [s]."""

Task = TypeVar("Task")
Result = TypeVar("Result")
P = ParamSpec("P")


@dataclass(frozen=True, slots=True)
class Workers:
    """Workers that run tasks."""

    open: Callable[[], Executor]  # creates an executor; again after a dying worker has broken the last one
    count: Callable[[], int]  # current number of workers; raises `ScenarioError` if they are no longer reachable
    died: type[Exception] = BrokenExecutor  # exceptions of a task's future if its worker has died
    close: Callable[[Executor], None] = lambda executor: executor.shutdown(wait=False, cancel_futures=True)


def completed(
    workers: Workers, function: Callable[[Task], Result], tasks: Iterable[Task]
) -> Generator[tuple[Task, Result | ScenarioError]]:
    """Run a picklable function on every task; yield each, as it ends, with its result or its worker's failure.

    Raises `ScenarioError` as the function does, if workers are unreachable, and if the first tasks are all abandoned.
    """
    queue, suspects = iter(tasks), deque[Task]()
    returned, given_up, alone, pending = 0, 0, False, True
    while pending:
        source = iter([suspects.popleft()]) if alone else queue
        executor, running, broken = workers.open(), dict[Future[Result], Task](), False
        try:
            while True:
                while not broken and len(running) < AHEAD * workers.count():
                    if (task := next(source, None)) is None:
                        break
                    try:
                        running[executor.submit(function, task)] = task
                    except BrokenExecutor:  # a worker died between two tasks
                        suspects.append(task)
                        broken = True
                if not running:
                    break
                while not (finished := wait(running, timeout=TICK, return_when=FIRST_COMPLETED).done):
                    workers.count()  # raises if they are no longer reachable
                for future in finished:
                    task, outcome = running.pop(future), _outcome(future, workers.died)
                    if not isinstance(outcome, ScenarioError):
                        returned += 1
                    elif alone:
                        given_up += 1
                    else:
                        suspects.append(task)
                        broken = True
                        continue
                    yield task, outcome
                    if given_up == HOPELESS and not returned:
                        raise ScenarioError(
                            f"none of the first {HOPELESS} chunks of trials returned: {outcome}; fix the cause and "
                            "repeat the command"
                        )
        finally:
            workers.close(executor)
        pending, alone = alone or broken, bool(suspects)


def _outcome(future: Future[Result], died: type[Exception]) -> Result | ScenarioError:
    try:
        return future.result()
    except ScenarioError:
        raise
    except CancelledError as error:  # not by this process
        raise ScenarioError(SCHEDULER_GONE) from error
    except died:
        return ScenarioError("its worker died", kind="WorkerDied")
    except Exception as error:
        absent = error if isinstance(error, ImportError) else error.__cause__
        if isinstance(absent, ImportError):
            said = f"workers or scheduler cannot run trials: {absent}; install this version there"
            raise ScenarioError(said) from error
        return ScenarioError(f"its worker failed: {type(error).__name__}: {error}".splitlines()[0], kind="WorkerFailed")


class _Pool(ProcessPoolExecutor):
    """A pool whose workers do not import the main script, which might start the study again."""

    def submit(self, fn: Callable[P, Result], /, *args: P.args, **kwargs: P.kwargs) -> Future[Result]:
        """Submit a task; this starts workers."""
        main, sys.modules["__main__"] = sys.modules["__main__"], ModuleType("__main__")
        try:
            return super().submit(fn, *args, **kwargs)
        finally:
            sys.modules["__main__"] = main


@contextmanager
def local_processes(jobs: int) -> Generator[Workers]:
    """Processes of this machine, terminated at exit; they end themselves if this process is killed."""
    before, environment = set(multiprocessing.active_children()), dict(os.environ)
    start = multiprocessing.get_context(_start_method())

    def opened() -> _Pool:
        try:
            return _Pool(jobs, start, initializer=_begin_work, initargs=(environment,))
        except OSError as error:  # of its semaphores
            said = f"no worker can be started: {error.strerror}; make /dev/shm writable, or use --dask"
            raise ScenarioError(said) from error

    try:
        yield Workers(opened, lambda: jobs)
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
    os.environ.clear()
    os.environ.update(wanted)


def _begin_work(environment: Mapping[str, str]) -> None:
    """Take over the environment of the main process, and end together with it."""
    _set_environment(environment)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    gc.freeze()  # imports stay: a collection of the rest takes a quarter of a millisecond
    parent = multiprocessing.parent_process()

    def end_with_it() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=end_with_it, daemon=True).start()


@contextmanager
def dask_workers(address: str) -> Generator[Workers]:
    """Workers of a Dask cluster, by the address of its scheduler, as `tcp://host:8786`, or its scheduler file.

    Raises `ScenarioError` if Dask is not installed, or no scheduler answers.
    """
    try:
        from distributed import Client, KilledWorker
        from distributed.utils import LoopRunner
    except ImportError as error:
        raise ScenarioError(str(needed_extra("distributed"))) from error
    for name in (*LOGGERS, *logging.root.manager.loggerDict):  # each logger of Dask has its own level
        if name.partition(".")[0] in LOGGERS:  # a lost connection is reported here in one line
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    found = _address_in(Path(address)) if address.endswith(".json") else address
    try:
        LoopRunner().run_sync(_greet, found)
        client = Client(found, timeout=PATIENCE)
    except TimeoutError as error:
        raise ScenarioError(f"no Dask scheduler answers at {address} within {PATIENCE:g} s") from error
    except (OSError, ValueError, TypeError, ImportError) as error:  # the last two: no certificate, no such transport
        raise ScenarioError(f"no Dask scheduler answers at {address}: {error}") from error

    def count() -> int:
        if client.status not in ("running", "connecting"):
            raise ScenarioError(SCHEDULER_GONE)
        try:
            return max(FEWEST, sum(client.ncores().values()))
        except OSError as error:
            raise ScenarioError(SCHEDULER_GONE) from error

    with client:
        yield Workers(
            open=lambda: client.get_executor(pure=False),  # a repeated task must be run again
            count=count,
            died=KilledWorker,
            close=lambda executor: executor.shutdown(wait=False),  # which cancels
        )


def _address_in(file: Path) -> str:
    if not file.is_file():
        raise ScenarioError(f"{file}: no such scheduler file; start `dask scheduler --scheduler-file {file}` first")
    try:
        return str(json.loads(file.read_bytes())["address"])
    except (ValueError, KeyError, TypeError) as error:
        raise ScenarioError(
            f"{file}: not a scheduler file: it states no address; write one with `dask scheduler --scheduler-file FILE`"
        ) from error


async def _greet(address: str) -> None:
    """Test the connection: a client would wait for the first answer without a timeout."""
    import asyncio  # slow import

    from distributed.comm.core import connect
    from distributed.security import Security

    security: dict[str, Any] = Security().get_connection_args("client")
    comm = await asyncio.wait_for(connect(address, timeout=PATIENCE, **security), PATIENCE)
    await comm.close()


def usable_cores() -> int:
    """Return the number of cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _jobs(text: str) -> int:
    cores = usable_cores()
    if not text.isdecimal() or not 1 <= int(text) <= MOST_PER_CORE * cores:
        said = f"expected a number from 1 to {MOST_PER_CORE * cores}, not {text!r}"
        raise argparse.ArgumentTypeError(f"{said}; this machine has {cores} core{'s' * (cores > 1)} to use")
    return int(text)


def add_worker_options(parser: argparse.ArgumentParser, *, dask: bool = True) -> None:
    """Add one option per kind of workers; at most one may be used."""
    add = parser.add_mutually_exclusive_group().add_argument
    add("--jobs", type=_jobs, metavar="J", help="processes on this machine (default: one per core)")
    if dask:
        add("--dask", metavar="ADDRESS", help="scheduler of a Dask cluster, tcp://HOST:PORT or its file")


def open_workers(options: argparse.Namespace) -> AbstractContextManager[Workers]:
    """Return the workers of parsed options."""
    address: str | None = getattr(options, "dask", None)
    return local_processes(options.jobs or usable_cores()) if address is None else dask_workers(address)
