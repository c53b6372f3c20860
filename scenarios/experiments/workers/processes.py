"""Processes of this machine.

A worker imports what the process that started it imports, whatever lies in the working folder: Python would look there
first in the helper process that workers are forked from, and a `sim.py` of the user's would be taken for the package.
"""

import argparse
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Generator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from typing import ParamSpec, TypeVar

from scenarios.experiments.workers.kinds import WorkerKind, Workers

WORKER = "scenarios.experiments.workers.tasks"
"""What a worker imports."""
NO_COMPLAINT = "ignore:resource_tracker:UserWarning"
"""The process that gives back semaphores says so on standard error."""
MOST_PER_CORE = 4
"""Workers that a core may have; each takes 400 MB, and more than one a core gain nothing."""
P = ParamSpec("P")
T = TypeVar("T")


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
        yield Workers(lambda: _Pool(jobs, context, initializer=_begin_work), lambda: jobs)
    finally:
        for child in set(multiprocessing.active_children()) - before:
            child.kill()  # who ignores a request to end has passed that on to its workers


def prepare_processes() -> str:
    """Start the process that workers are forked from; it imports what they need, while the caller goes on.

    Returns:
        The start method to use: `forkserver`, or `spawn` where there is none.
    """
    if "forkserver" not in multiprocessing.get_all_start_methods():
        os.environ["PYTHONSAFEPATH"] = "1"  # each worker starts by itself, later
        return "spawn"
    from multiprocessing import forkserver  # not there on every platform

    multiprocessing.set_forkserver_preload([WORKER])
    with _ignored_signals(), _own_environment():
        forkserver.ensure_running()
    return "forkserver"


class _Pool(ProcessPoolExecutor):
    """A pool whose workers start undisturbed: one whose start is cut off half-way complains with a traceback."""

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """As a pool does; a signal that arrives meanwhile is handled afterwards."""
        with _deferred_signals():
            return super().submit(fn, *args, **kwargs)


@contextmanager
def _deferred_signals() -> Generator[None]:
    """Signals that end a study are handled on the way out."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    heard: list[int] = []
    ending = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    handlers = {number: signal.getsignal(number) for number in ending}
    handled = [number for number in ending if callable(handlers[number])]
    for number in handled:
        signal.signal(number, lambda number, frame: heard.append(number))
    try:
        yield
    finally:
        for number in handled:
            signal.signal(number, handlers[number])
        for number in heard:
            signal.raise_signal(number)


@contextmanager
def _own_environment() -> Generator[None]:
    """Processes started meanwhile import as this one does, and do not complain of what one that ends at once held.

    They look where this one looks: the working folder is on the path only if named.
    """
    changed = {
        "PYTHONSAFEPATH": "1",
        "PYTHONPATH": os.pathsep.join(path or os.getcwd() for path in sys.path),
        "PYTHONWARNINGS": ",".join(filter(None, [os.environ.get("PYTHONWARNINGS"), NO_COMPLAINT])),
    }
    before = {name: os.environ.get(name) for name in changed}
    os.environ.update(changed)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextmanager
def _ignored_signals() -> Generator[None]:
    """Processes started meanwhile leave Ctrl-C and a closed terminal to the one that asked for the work."""
    if threading.current_thread() is not threading.main_thread():  # the only one that may handle signals
        yield
        return
    handlers = {number: signal.signal(number, signal.SIG_IGN) for number in _of_the_caller()}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)


def _of_the_caller() -> list[signal.Signals]:
    """Signals that a terminal sends to every process."""
    return [getattr(signal, name) for name in ("SIGINT", "SIGHUP") if hasattr(signal, name)]


def usable_cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _begin_work() -> None:
    """Leave those signals to the one that asked for the work; end with it."""
    for number in _of_the_caller():
        signal.signal(number, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _jobs(text: str) -> str:
    most = MOST_PER_CORE * usable_cores()
    try:
        jobs = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
    if not 1 <= jobs <= most:
        cores = "1 core" if usable_cores() == 1 else f"{usable_cores()} cores"
        raise argparse.ArgumentTypeError(f"expected a number from 1 to {most}, this machine has {cores} to use")
    return text


PROCESSES = WorkerKind(
    option="jobs",
    metavar="J",
    help="processes on this machine (default: one a core)",
    checked=_jobs,
    open=lambda value: local_processes(usable_cores() if value is None else int(value)),
    prepare=prepare_processes,
)
