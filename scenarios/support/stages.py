"""Current stage of a command, with the remaining time if known; on stderr.

A bar on a terminal, removed at the end; otherwise a line after two seconds and every ten seconds. A separate thread
updates it, also during work that reports nothing.
"""

import threading
import time
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

from scenarios.support.progress import FIRST_LINE, LINE_EVERY, duration

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

T = TypeVar("T")
BAR = 15
"""Width of a bar in characters, for narrow terminals."""


class Stages:
    """Interface for reporting stages; this class reports nothing."""

    def begin(self, name: str, total: float | None = None) -> None:
        """Begin a stage. The total is in any unit, None if unknown."""

    def advance(self, amount: float) -> None:
        """Advance the stage."""


SILENT = Stages()
"""Stages that are not reported."""


def counted(items: Iterable[T], stages: Stages) -> Iterator[T]:
    """Yield the items, and advance by one after each."""
    for item in items:
        yield item
        stages.advance(1)


@contextmanager
def stages_of(name: str, console: "Console") -> Generator[Stages]:
    """Show what is under way until it is done."""
    if not console.is_terminal:
        with _lines(name, console) as stages:
            yield stages
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(BAR), TimeElapsedColumn(), TimeRemainingColumn(compact=True))
    with Progress(*columns, console=console, transient=True, redirect_stdout=False) as progress:
        yield _Bar(progress, name)


class _Bar(Stages):
    def __init__(self, progress: "Progress", name: str) -> None:
        self._progress, self._task = progress, progress.add_task(name, total=None)

    def begin(self, name: str, total: float | None = None) -> None:
        self._progress.remove_task(self._task)
        self._task = self._progress.add_task(name, total=total)

    def advance(self, amount: float) -> None:
        self._progress.advance(self._task, amount)


@dataclass(slots=True)
class Stage:
    """State of a stage, with its start time [s]; `total` is None if unknown."""

    name: str
    total: float | None
    began: float
    done: float = 0.0

    def line(self, now: float) -> str:
        """Return the stage as one line."""
        lasted = now - self.began
        if not self.total or not self.done:
            return f"{self.name}: for {duration(lasted)}"
        share = min(self.done / self.total, 1.0)
        return f"{self.name}: {100.0 * share:.0f} %, {duration(lasted * (1.0 - share) / share)} left"


class _Told(Stages):
    def __init__(self, name: str) -> None:
        self.now = Stage(name, None, time.monotonic())

    def begin(self, name: str, total: float | None = None) -> None:
        self.now = Stage(name, total, time.monotonic())

    def advance(self, amount: float) -> None:
        self.now.done += amount


@contextmanager
def _lines(name: str, console: "Console") -> Generator[Stages]:
    told, over = _Told(name), threading.Event()

    def live() -> None:
        wait = FIRST_LINE
        while not over.wait(wait):
            console.print(told.now.line(time.monotonic()), soft_wrap=True, highlight=False, markup=False)
            wait = LINE_EVERY

    thread = threading.Thread(target=live, daemon=True)
    thread.start()
    try:
        yield told
    finally:
        over.set()
        thread.join()
