"""`rx90` as a process: exit statuses, signals, closed or full streams, the OpenGL backend."""

import contextlib
import errno
import io
import os
import signal
import sys
import threading
from collections.abc import Generator
from enum import IntEnum
from types import FrameType
from typing import TextIO

from ident.support.naming import one_line


class Status(IntEnum):
    """Exit status of a command, and its meaning."""

    meaning: str

    def __new__(cls, value: int, meaning: str) -> "Status":
        """Make a member of a number and its meaning."""
        status = int.__new__(cls, value)
        status._value_, status.meaning = value, meaning
        return status

    PASSED = 0, "passed"
    MISSED = 1, "a tolerance was exceeded, or a check found a fault"
    BAD_INPUT = 2, "bad input: a line on stderr states the fault, its place and the remedy"
    UNFORESEEN = 70, "internal error: please report it (RX90_TRACEBACK=1 shows where)"
    NO_OUTPUT = 74, "standard output is closed or not writable"
    HUNG_UP = 129, "the terminal was closed (SIGHUP)"
    INTERRUPTED = 130, "Ctrl-C"
    NOBODY_READS = 141, "broken pipe: the reader closed the output, as in rx90 list | head -1"
    ENDED = 143, "terminated (SIGTERM)"


OUTPUT = "standard output"
"""Name of the file of an `OSError` if nothing can be written there."""
OPENGL, ASKED = "MUJOCO_GL", "RX90_MUJOCO_GL"
"""Variable for the OpenGL backend of MuJoCo, read at import, and the one that keeps its value for child processes."""


def ending(interrupt: KeyboardInterrupt) -> Status:
    """Return the exit status after Ctrl-C, or after a signal, whose interrupt states it."""
    return interrupt.args[0] if interrupt.args else Status.INTERRUPTED


@contextlib.contextmanager
def own_process() -> Generator[None]:
    """Settle streams and signals, and import MuJoCo without OpenGL; `OSError` if standard output is closed."""
    open_streams()
    with signals_as_interrupts(), without_opengl():
        yield


@contextlib.contextmanager
def signals_as_interrupts() -> Generator[None]:
    """Interrupt on SIGTERM and SIGHUP as on Ctrl-C, unless ignored as under nohup; a second one ends immediately."""
    known = {"SIGTERM": Status.ENDED, "SIGHUP": Status.HUNG_UP}  # not every platform has all
    ours = {getattr(signal, name): status for name, status in known.items() if hasattr(signal, name)}
    main_thread = threading.current_thread() is threading.main_thread()  # only this one may handle signals
    handled = [number for number in ours if main_thread and signal.getsignal(number) == signal.SIG_DFL]

    def ended(number: int, frame: FrameType | None) -> None:
        signal.signal(number, signal.SIG_DFL)
        raise KeyboardInterrupt(ours[number])

    try:
        for number in handled:
            signal.signal(number, ended)
        yield
    finally:
        for number in handled:
            signal.signal(number, signal.SIG_DFL)


def open_streams() -> None:
    """Replace closed streams, and make the others accept any character; `OSError` if standard output is closed.

    Otherwise a file with the descriptor of standard output would receive output of libraries.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the lowest free descriptor is this one
    closed = [name for name in ("stdout", "stderr") if getattr(sys, name) is None]
    for name in closed:
        setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    if "stdout" in closed:
        raise OSError(errno.EBADF, "closed", OUTPUT)


def write(text: str) -> None:
    """Write text to standard output and flush; raises `OSError` if it cannot be written, or its reader has ended."""
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except BrokenPipeError:
        raise
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), OUTPUT) from error


def abandon(stream: TextIO) -> None:
    """Redirect a stream to the null device, as what it has buffered cannot be written; Python would exit with 120."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def complain(message: str, program: str = "rx90") -> None:
    """Write a message in one line to stderr."""
    try:
        print(f"{program}: {one_line(message)}", file=sys.stderr, flush=True)  # noqa: T201
    except OSError:  # the reader may have ended
        abandon(sys.stderr)


@contextlib.contextmanager
def without_opengl() -> Generator[None]:
    """Import MuJoCo without OpenGL, which is needed only for rendering."""
    asked = os.environ.get(ASKED, os.environ.get(OPENGL, ""))  # the former in a child process
    os.environ[OPENGL], os.environ[ASKED] = "disable", asked
    try:
        yield
    finally:
        os.environ[ASKED] = asked
        with_opengl()


def with_opengl() -> None:
    """Restore the OpenGL backend of the shell before MuJoCo is imported."""
    asked = os.environ.pop(ASKED, None)
    if asked:
        os.environ[OPENGL] = asked
    elif asked is not None:
        os.environ.pop(OPENGL, None)
