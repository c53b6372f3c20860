"""One call of a method on one problem, in a separate process: answers or a failure, and the time.

The process of a Python method is forked from one that has already imported the modules of an identification, in 20 ms
instead of seconds; other output of the method goes to standard error.
"""

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from functools import cache
from multiprocessing import Process
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from ident.estimation.estimators import ESTIMATORS
from ident.support.errors import IdentificationError
from ident.support.naming import one_line
from scenarios.benchmark.methods import estimator, function
from scenarios.benchmark.methods.answer import read_answer
from scenarios.benchmark.methods.method import Method
from scenarios.experiments.judge import Claim
from scenarios.results.gains import Result
from scenarios.results.problem_folder import read_problem
from scenarios.support.errors import (
    MethodCrashed,
    MethodError,
    MethodNotStarted,
    MethodOutOfMemory,
    MethodTimedOut,
    NoAnswer,
)

if TYPE_CHECKING:
    from multiprocessing.popen_forkserver import Popen

    Running: TypeAlias = Popen | subprocess.Popen[bytes]

IMPORTED = (
    __name__,
    "pyarrow.compute",
    "pyarrow.parquet",
    "pinocchio",
    *(f"scipy.{name}" for name in ("interpolate", "ndimage", "signal", "stats")),
)
"""Modules of the fork server; the last ones are otherwise imported at first use."""
ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
LOOK_EVERY = 0.2
"""Interval of polling the output of a process [s]."""
LARGEST_ANSWER = 10_000_000
"""Largest number of bytes of an answer."""
TAIL = 4000
"""Number of bytes read from the end of standard error."""
GRACE = 10.0
"""Timeout for the end of a killed process [s]."""
CPU_SLACK = 5.0
"""Processor time beyond the limit after which the system ends an unsupervised process [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Limits of one call of a method.

    Attributes:
        time_s: Wall time [s], including the start of the program.
        memory_gb: Memory of each of its processes [GB]; enforced on Linux.
    """

    time_s: float = 60.0
    memory_gb: float = 4.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Call:
    """Outcome of a call.

    Attributes:
        outcome: One answer per joint, or the error.
        seconds: Wall time, including the start of the program [s].
    """

    outcome: tuple[Claim, ...] | MethodError
    seconds: float


def call(method: Method, folder: Path, joints: int, limits: Limits) -> Call:
    """Call a method. There is always an outcome, and all processes of its session are ended."""
    with tempfile.TemporaryDirectory() as place:
        out, err = (Path(place) / name for name in ("out", "err"))
        started = time.perf_counter()
        try:
            process = _started(method, folder.absolute(), limits, out, err)
            started = time.perf_counter()
            try:
                status = _ended(process, out, started + limits.time_s, limits)
            finally:
                _end(process)
            outcome = _failure(status, _tail(err), limits) if status else read_answer(_text(out), joints)
        except MethodError as error:
            outcome = error
        return Call(outcome=outcome, seconds=time.perf_counter() - started)


def _started(method: Method, folder: Path, limits: Limits, out: Path, err: Path) -> "Running":
    """Start a process in a new session, with standard output and error in two files."""
    environment = {
        **os.environ,
        **ONE_THREAD,
        "PYTHONPATH": os.pathsep.join(path or os.getcwd() for path in sys.path),
        "PYTHONWARNINGS": "ignore",
    }
    out.touch()
    err.touch()
    if not method.words:
        from multiprocessing.popen_forkserver import Popen  # not available on every platform

        _prepare(os.getpid())
        called = Process(target=_live, args=(method.text, folder, limits, out, err, os.getcwd()), daemon=False)
        try:
            return Popen(called)  # `Process.start` refuses in daemon processes, such as Dask's workers
        except (OSError, EOFError) as error:
            raise MethodNotStarted("the process that Python methods are forked from has died") from error
    try:
        with out.open("wb") as said, err.open("wb") as complained:
            process = subprocess.Popen(
                [*method.words, str(folder)],
                stdin=subprocess.DEVNULL,
                stdout=said,
                stderr=complained,
                start_new_session=True,
                env=environment,
            )
    except OSError as error:
        raise MethodNotStarted(f"{one_line(method.words[0])}: {error.strerror}") from error
    _limit(process.pid, limits)
    return process


@cache
def _prepare(process: int) -> None:
    """Start the fork server of methods."""
    from multiprocessing import forkserver  # not available on every platform

    forkserver.set_forkserver_preload(list(IMPORTED))
    before = dict(os.environ)
    os.environ |= {**ONE_THREAD, "PYTHONSAFEPATH": "1"}
    try:
        forkserver.ensure_running()
    finally:
        os.environ.clear()
        os.environ |= before


def _live(text: str, folder: Path, limits: Limits, out: Path, err: Path, work: str) -> None:
    """Run a method in Python, in its own process."""
    os.setsid()
    complaint = os.open(err, os.O_WRONLY | os.O_APPEND)
    for number, file in ((0, os.open(os.devnull, os.O_RDONLY)), (1, complaint), (2, complaint)):
        os.dup2(file, number)  # also for compiled code
    os.chdir(work)
    _limit(0, limits)
    answer = python_answer(text, folder)
    with out.open("w", encoding="utf-8") as output:
        json.dump(answer, output)  # the reader checks for numbers that are not finite


def python_answer(text: str, folder: Path) -> object:
    """Return the answer of a method in Python: as printed by `rx90 identify --json`, or as returned by the function."""
    started, problem = time.perf_counter(), read_problem(folder)
    try:
        if text.partition(",")[0] not in ESTIMATORS:
            return function.answered(text, problem)
        found = estimator.identified(text, problem)
        return Result.of_identification(found, time.perf_counter() - started).model_dump(mode="json")
    except IdentificationError as error:  # refused data mean that every joint is refused
        refused = {"std": None, "estimate": None, "identifiable": False, "reason": str(error)}
        return {"gains": [{"joint": joint, **refused} for joint in range(1, problem.arm.n + 1)]}


def _limit(process: int, limits: Limits) -> None:
    """Set limits that the system enforces and that children inherit; process 0 is this one."""
    if sys.platform != "linux":
        return
    import resource

    size, time_s = int(limits.memory_gb * 1e9), int(limits.time_s + CPU_SLACK)
    with contextlib.suppress(ProcessLookupError, PermissionError):  # it has ended already
        resource.prlimit(process, resource.RLIMIT_DATA, (size, size))
        resource.prlimit(process, resource.RLIMIT_CPU, (time_s, time_s))


def _ended(process: "Running", out: Path, until: float, limits: Limits) -> int:
    """Return the exit status of a process that ends in time, negative for a signal."""
    while True:
        left = until - time.perf_counter()
        status = _status(process, max(0.0, min(LOOK_EVERY, left)))
        if out.stat().st_size > LARGEST_ANSWER:
            raise NoAnswer(f"it printed more than {LARGEST_ANSWER // 10**6} MB; print one JSON object")
        if status is not None:
            return status
        if left <= 0.0:
            raise MethodTimedOut(f"no answer after {limits.time_s:g} s")


def _status(process: "Running", timeout: float) -> int | None:
    try:
        return process.wait(timeout)  # None for a forked process that has not ended
    except subprocess.TimeoutExpired:
        return None


def _end(process: "Running") -> None:
    """End the process and its children, and wait for its end."""
    with contextlib.suppress(ProcessLookupError, PermissionError):  # no process is left
        os.killpg(process.pid, signal.SIGKILL)
    _status(process, GRACE)


def _failure(status: int, complaint: str, limits: Limits) -> MethodError:
    last = one_line(complaint.strip().splitlines()[-1]) if complaint.strip() else "it printed no message"
    if "MemoryError" in last or "bad_alloc" in complaint or "annot allocate memory" in last:
        return MethodOutOfMemory(f"it requested more than {limits.memory_gb:g} GB: {last}")
    if status == -signal.SIGXCPU:
        return MethodTimedOut(f"more than {limits.time_s:g} s of processor time")
    if -status in set(signal.Signals):
        return MethodCrashed(f"ended by {signal.Signals(-status).name}: {last}")
    return MethodCrashed(f"exit status {status}: {last}" if status > 0 else f"ended by signal {-status}: {last}")


def _tail(path: Path) -> str:
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - TAIL))
        return file.read(TAIL).decode("utf-8", "replace")


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise NoAnswer("its output is not UTF-8 text") from error
