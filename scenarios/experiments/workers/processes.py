"""Processes of this machine.

A worker imports the same modules as its parent process, regardless of the working folder. Otherwise Python would search
the working folder first in the fork server, and a user's `sim.py` would replace the package.
"""

import argparse
import gc
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from importlib.abc import MetaPathFinder
from types import FrameType
from typing import ParamSpec, TypeVar

from scenarios.experiments.workers.kinds import WorkerKind, Workers

WORKER = "scenarios.experiments.trials"
"""Modules that a worker imports."""
NO_COMPLAINT = "ignore:resource_tracker:UserWarning"
"""Warning of the resource tracker on standard error, which is suppressed."""
MOST_PER_CORE = 4
"""Largest number of workers per core; each takes 300 MB, and more than one per core save no time."""
FROM_TERMINAL = ("SIGINT", "SIGHUP")
"""Signals that a terminal sends to all processes; by name, as not every platform has all of them."""
P = ParamSpec("P")
T = TypeVar("T")


@contextmanager
def local_processes(jobs: int) -> Generator[Workers]:
    """Processes of this machine.

    They are terminated at exit, and end themselves if this process is killed.
    """
    before = set(multiprocessing.active_children())
    context = multiprocessing.get_context(prepare_processes())
    own = dict(os.environ)
    try:
        yield Workers(lambda: _Pool(jobs, context, initializer=_begin_work, initargs=(own,)), lambda: jobs)
    finally:
        for child in set(multiprocessing.active_children()) - before:
            child.kill()  # not `terminate`: workers inherit an ignored SIGTERM


def prepare_processes(modules: Sequence[str] = (WORKER,), **environment: str) -> str:
    """Start the fork server, which imports the modules of the workers in the background.

    Args:
        modules: Modules to import; no effect if the server is already running.
        environment: Additional environment variables.

    Returns:
        The start method: `forkserver`, or `spawn` if not available.
    """
    if "forkserver" not in multiprocessing.get_all_start_methods():
        os.environ["PYTHONSAFEPATH"] = "1"  # each worker starts later, separately
        return "spawn"
    from multiprocessing import forkserver  # not available on every platform

    multiprocessing.set_forkserver_preload(list(modules))
    before = dict(os.environ)
    os.environ |= environment | {
        "PYTHONSAFEPATH": "1",
        "PYTHONPATH": import_path(),
        "PYTHONWARNINGS": ",".join(filter(None, [os.environ.get("PYTHONWARNINGS"), NO_COMPLAINT])),
    }
    try:
        with _handled(FROM_TERMINAL, signal.SIG_IGN):  # they are handled by the main process
            forkserver.ensure_running()
    finally:
        _set_environment(before)
    return "forkserver"


def import_path() -> str:
    """Return the module search path of this process as `PYTHONPATH`; the working folder only if named."""
    return os.pathsep.join(path or os.getcwd() for path in sys.path)


def usable_cores() -> int:
    """Return the number of cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class _Pool(ProcessPoolExecutor):
    """A pool that blocks signals while workers start: an interrupted start would print a traceback."""

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Submit a task; signals that arrive meanwhile are handled afterwards."""
        heard: list[int] = []
        try:
            with _handled((*FROM_TERMINAL, "SIGTERM"), lambda number, frame: heard.append(number)):
                return super().submit(fn, *args, **kwargs)
        finally:
            for number in heard:
                signal.raise_signal(number)


@contextmanager
def _handled(
    names: Sequence[str], handler: signal.Handlers | Callable[[int, FrameType | None], object]
) -> Generator[None]:
    """Set the handling of signals temporarily; only in the main thread, which alone may do so."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]
    before = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        for number, earlier in before.items():
            signal.signal(number, earlier)


def _set_environment(wanted: Mapping[str, str]) -> None:
    for name in os.environ.keys() - wanted.keys():
        del os.environ[name]
    os.environ.update(wanted)


def _begin_work(environment: Mapping[str, str]) -> None:
    """Set the environment of the main process, ignore terminal signals, and end together with it."""
    _set_environment(environment)
    _leave_pandas_out()
    gc.freeze()  # imports stay: a collection of the rest takes a quarter of a millisecond
    for name in FROM_TERMINAL:
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _leave_pandas_out() -> None:
    """Hide pandas from PyArrow's first array, which would import it, 45 MB, only to know its types.

    Later imports of pandas work.
    """
    pyarrow = sys.modules.get("pyarrow")  # imported already by all that use it
    if pyarrow is None:
        return
    no_pandas = _NoPandas()
    sys.meta_path.insert(0, no_pandas)
    try:
        pyarrow.array([0.0])
    finally:
        sys.meta_path.remove(no_pandas)


class _NoPandas(MetaPathFinder):
    """Import finder that reports pandas as missing."""

    def find_spec(self, fullname: str, path: object, target: object = None) -> None:
        if fullname == "pandas":
            raise ModuleNotFoundError(fullname)


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
        raise argparse.ArgumentTypeError(f"expected a number from 1 to {most}; this machine has {cores} to use")
    return text


PROCESSES = WorkerKind(
    option="jobs",
    metavar="J",
    help="processes on this machine (default: one per core)",
    checked=_jobs,
    open=lambda value: local_processes(usable_cores() if value is None else int(value)),
    prepare=prepare_processes,
)
