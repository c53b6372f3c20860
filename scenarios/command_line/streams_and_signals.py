"""Handling of signals, and of closed, full or broken streams."""

import contextlib
import io
import os
import signal
import sys
import threading
from collections.abc import Callable, Generator
from types import FrameType

from scenarios.command_line.status import Status

ENDINGS = {name: status for name, status in (("SIGTERM", Status.ENDED), ("SIGHUP", Status.HUNG_UP))}
"""Signals that end a command, by name since not every platform has all."""


class Ended(KeyboardInterrupt):
    """A signal that ends the command, raised as an interrupt with the same cleanup as Ctrl-C."""

    def __init__(self, status: Status) -> None:
        super().__init__()
        self.status = status


class NoOutput(OSError):
    """Standard output is closed."""


def ending(interrupt: KeyboardInterrupt) -> Status:
    """The exit status after Ctrl-C or a signal."""
    return interrupt.status if isinstance(interrupt, Ended) else Status.INTERRUPTED


@contextlib.contextmanager
def signals_as_interrupts() -> Generator[None]:
    """Raise `Ended` on SIGTERM and SIGHUP, unless ignored as under nohup; a second one ends immediately."""
    if threading.current_thread() is not threading.main_thread():  # only the main thread may handle signals
        yield
        return
    ours: list[int] = []
    for name, status in ENDINGS.items():
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) == signal.SIG_DFL:
            signal.signal(number, _raiser(status))
            ours.append(number)
    try:
        yield
    finally:
        for number in ours:
            signal.signal(number, signal.SIG_DFL)


def _raiser(status: Status) -> Callable[[int, FrameType | None], None]:
    def ended(number: int, frame: FrameType | None) -> None:
        signal.signal(number, signal.SIG_DFL)
        raise Ended(status)

    return ended


def open_streams() -> None:
    """Replace closed streams, and make the others accept any character.

    Otherwise a file with the descriptor of standard output would receive output of libraries.

    Raises:
        NoOutput: If standard output is closed, as no result could be written.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the lowest free descriptor is this one
    if sys.stderr is None:  # pyright: ignore[reportUnnecessaryComparison] # it is, where it was closed
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    if sys.stdout is None:  # pyright: ignore[reportUnnecessaryComparison]
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
        raise NoOutput("standard output is closed")
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def tell(text: str) -> None:
    """Write text to standard output and flush.

    Raises:
        NoOutput: If it cannot be written.
        BrokenPipeError: If its reader has ended.
    """
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except BrokenPipeError:
        raise
    except OSError as error:
        raise NoOutput(f"standard output: {error.strerror or error}") from error


def abandon_output() -> None:
    """Redirect standard output to the null device, as buffered output cannot be written."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
