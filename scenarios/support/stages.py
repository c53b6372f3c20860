"""What a command is doing now, stage by stage, with the time left where that is known; on stderr.

A bar on a terminal, gone when the work is done; elsewhere a line when it has lasted two seconds, and every ten seconds
after. A thread of its own tells it, so that work which reports nothing shows life too.
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
"""Characters of a bar, so that it fits narrow terminals."""


class Stages:
    """What work tells of its stages; this one tells nobody."""

    def begin(self, name: str, total: float | None = None) -> None:
        """A stage begins. The total is in a unit of one's own, None where nobody knows."""

    def advance(self, amount: float) -> None:
        """So much more of the stage is done."""


SILENT = Stages()
"""Nobody is told."""


def counted(items: Iterable[T], stages: Stages) -> Iterator[T]:
    """The items; each counts as one done when the next is asked for."""
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
    """How far a stage is, which began at a time of a clock of seconds; `total` is None where nobody knows it."""

    name: str
    total: float | None
    began: float
    done: float = 0.0

    def line(self, now: float) -> str:
        """The stage in a line."""
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
