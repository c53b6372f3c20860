"""A command in a process of its own, with limits of time, memory and words."""

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from ident.support.naming import one_line
from scenarios.benchmark.methods.environment import environment
from scenarios.benchmark.methods.fork_server import can_fork, forked, ready_helper
from scenarios.benchmark.methods.method import INSIDE
from scenarios.support.errors import MethodCrashed, MethodNotStarted, MethodOutOfMemory, MethodTimedOut, NoAnswer

LOOK_EVERY = 0.2
"""Time between two looks at what a process has printed [s]."""
LARGEST_ANSWER = 10_000_000
"""Bytes of an answer."""
TAIL = 4000
"""Bytes at the end of what it complains that are read."""
GRACE = 10.0
"""Time that a process which has been killed may take to end [s]."""
CPU_SLACK = 5.0
"""Processor time beyond the limit after which the system itself ends a process that nobody watches any more [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What one call of a method may take.

    Attributes:
        time_s: Wall time [s], start of the process included.
        memory_gb: Memory of each of its processes [GB]; held on Linux.
    """

    time_s: float = 60.0
    memory_gb: float = 4.0


@dataclass(frozen=True, slots=True)
class Said:
    """What a process printed, and how long it took [s]."""

    text: str
    seconds: float


class Running(Protocol):
    """A process that has started, in a session of its own."""

    pid: int

    def wait(self, timeout: float) -> int | None:
        """Its exit status, negative for a signal; None if it has not ended in time [s]."""
        ...


class _Started:
    """A process of a command."""

    def __init__(self, words: Sequence[str], out: Path, err: Path) -> None:
        try:
            with out.open("wb") as said, err.open("wb") as complained:
                self._process = subprocess.Popen(
                    list(words),
                    stdin=subprocess.DEVNULL,
                    stdout=said,
                    stderr=complained,
                    start_new_session=True,
                    env=environment(),
                )
        except OSError as error:
            raise MethodNotStarted(f"{one_line(words[0])}: {error.strerror}") from error
        self.pid = self._process.pid

    def wait(self, timeout: float) -> int | None:
        """As `Running`."""
        try:
            return self._process.wait(timeout)
        except subprocess.TimeoutExpired:
            return None


def run_limited(words: Sequence[str], limits: Limits) -> Said:
    """Run a command; when it has ended, nothing that it started in its own session is left.

    Args:
        words: The command.
        limits: What it may take.

    Raises:
        MethodNotStarted: If there is no such program.
        MethodTimedOut, MethodOutOfMemory, MethodCrashed: As it ended.
        NoAnswer: If it printed too much, or no text.
    """
    with tempfile.TemporaryDirectory() as folder:
        out, err = (Path(folder) / name for name in ("out", "err"))
        out.touch()
        err.touch()
        if _forks(words):
            ready_helper()
        started = time.perf_counter()
        running = _running(words, out, err)
        try:
            _limit(running.pid, limits)
            status = _ended(running, out, started + limits.time_s, limits)
        finally:
            _end(running)
        seconds = time.perf_counter() - started
        if status:
            raise _failure(status, _tail(err), limits)
        return Said(_text(out), seconds)


def _running(words: Sequence[str], out: Path, err: Path) -> Running:
    """Start a command; what Python would import anew each time is forked instead where that can be."""
    if _forks(words):
        return forked(words[len(INSIDE) :], out, err)
    return _Started(words, out, err)


def _forks(words: Sequence[str]) -> bool:
    return tuple(words[: len(INSIDE)]) == INSIDE and can_fork()


def _limit(pid: int, limits: Limits) -> None:
    """Limits that the system itself keeps, and that children inherit."""
    if sys.platform != "linux":
        return
    import resource

    size, time_s = int(limits.memory_gb * 1e9), int(limits.time_s + CPU_SLACK)
    with contextlib.suppress(ProcessLookupError, PermissionError):  # it has ended already
        resource.prlimit(pid, resource.RLIMIT_DATA, (size, size))
        resource.prlimit(pid, resource.RLIMIT_CPU, (time_s, time_s))


def _ended(running: Running, out: Path, until: float, limits: Limits) -> int:
    """The exit status of a process that ends in time."""
    while True:
        left = until - time.perf_counter()
        status = running.wait(max(0.0, min(LOOK_EVERY, left)))
        if status is not None:
            return status
        if left <= 0.0:
            raise MethodTimedOut(f"no answer after {limits.time_s:g} s")
        if out.stat().st_size > LARGEST_ANSWER:
            raise NoAnswer(f"it printed more than {LARGEST_ANSWER} bytes")


def _end(running: Running) -> None:
    """End the process and what it started, and wait for its end."""
    if hasattr(os, "killpg"):
        with contextlib.suppress(ProcessLookupError, PermissionError):  # nothing is left of it
            os.killpg(running.pid, signal.SIGKILL)
    else:
        with contextlib.suppress(OSError):
            os.kill(running.pid, signal.SIGTERM)
    running.wait(GRACE)


def _failure(status: int, complaint: str, limits: Limits) -> MethodCrashed | MethodOutOfMemory | MethodTimedOut:
    last = one_line(complaint.strip().splitlines()[-1]) if complaint.strip() else "it printed no message"
    if "MemoryError" in last or "bad_alloc" in complaint or "annot allocate memory" in last:
        return MethodOutOfMemory(f"it requested more than {limits.memory_gb:g} GB: {last}")
    if status < 0:
        if -status == getattr(signal, "SIGXCPU", 0):
            return MethodTimedOut(f"more than {limits.time_s:g} s of processor time")
        return MethodCrashed(f"ended by {_signal_name(-status)}: {last}")
    return MethodCrashed(f"exit status {status}: {last}")


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _tail(path: Path) -> str:
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - TAIL))
        return file.read(TAIL).decode("utf-8", "replace")


def _text(path: Path) -> str:
    size = path.stat().st_size
    if size > LARGEST_ANSWER:
        raise NoAnswer(f"it printed {size} bytes; an answer has {LARGEST_ANSWER} at most")
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise NoAnswer("its output is not UTF-8 text") from error
