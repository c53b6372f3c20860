"""How far a study is: a bar on a terminal, a line now and then elsewhere; both on stderr."""

import time
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress, TaskID

FIRST_LINE, LINE_EVERY = 2.0, 10.0
"""Time until the first line without a terminal, and between two of them [s]."""


class Reporter(Protocol):
    """What a study tells of its progress."""

    def advance(self, trials: int, failed: int) -> None:
        """Some trials have finished, of which some failed."""

    def tick(self) -> None:
        """Time has passed."""


@contextmanager
def reporter(label: str, total: int, done: int, console: "Console") -> Generator[Reporter]:
    """Show the progress of a study.

    Args:
        label: What is under way.
        total: Trials of the study.
        done: Those finished before.
        console: On stderr.
    """
    if not console.is_terminal:
        yield _Lines(label, total, done, console)
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(elapsed_when_finished=True),
        TextColumn("{task.fields[failed]} failed"),
    )
    with Progress(*columns, console=console, speed_estimate_period=300.0) as progress:
        task = progress.add_task(label, total=total, completed=done, rate="", failed=0)
        yield _Bar(progress, task, _Count(total, done, time.monotonic()))


@dataclass(slots=True)
class _Count:
    """Trials finished so far and how fast."""

    total: int
    before: int
    started: float
    finished: int = 0
    failed: int = 0

    @property
    def done(self) -> int:
        return self.before + self.finished

    @property
    def rate(self) -> float:
        """Trials a second since the start, 0 before the first."""
        return self.finished / max(time.monotonic() - self.started, 1e-9)

    def add(self, trials: int, failed: int) -> None:
        self.finished += trials
        self.failed += failed


class _Bar:
    def __init__(self, progress: "Progress", task: "TaskID", count: _Count) -> None:
        self._progress, self._task, self._count = progress, task, count

    def advance(self, trials: int, failed: int) -> None:
        self._count.add(trials, failed)
        rate = f"{self._count.rate:.1f} per second"
        self._progress.update(self._task, completed=self._count.done, rate=rate, failed=self._count.failed)

    def tick(self) -> None:
        """The bar redraws itself."""


class _Lines:
    def __init__(self, label: str, total: int, done: int, console: "Console") -> None:
        self._label, self._console, self._count = label, console, _Count(total, done, time.monotonic())
        self._next = time.monotonic() + FIRST_LINE

    def advance(self, trials: int, failed: int) -> None:
        self._count.add(trials, failed)
        self.tick()

    def tick(self) -> None:
        now, count = time.monotonic(), self._count
        if now < self._next:
            return
        self._next = now + LINE_EVERY
        left = f", {duration((count.total - count.done) / count.rate)} left" if count.finished else ""
        done = f"{count.done} of {count.total} trials, {count.rate:.1f} per second{left}, {count.failed} failed"
        self._console.print(f"{self._label}: {done}", soft_wrap=True)


def duration(seconds: float) -> str:
    """Seconds in units that one can grasp."""
    hours, rest = divmod(round(seconds), 3600)
    minutes, seconds = divmod(rest, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {seconds} s" if minutes else f"{seconds} s"
