"""Progress of a study or search on stderr: a bar on a terminal, otherwise occasional lines."""

import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress, TaskID

FIRST_LINE, LINE_EVERY = 2.0, 10.0
"""Time before the first line without a terminal, and interval of further lines [s]."""

NARROW = 60
"""Width of a terminal below which name, bar and rate are omitted."""


@contextmanager
def reporter(label: str, total: int, done: int, console: "Console", workers: int) -> "Generator[Reporter]":
    """Show the progress of a study."""
    count = _Count(total, done, [time.monotonic()] * workers)
    if not console.is_terminal:
        yield _Lines(label, console, count)
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    wide = console.width >= NARROW
    told = (TextColumn(f"{{task.fields[{name}]}}") for name in (("rate",) if wide else ()) + ("left", "failed"))
    before = (TextColumn("{task.description}"), BarColumn()) if wide else ()
    with Progress(*before, MofNCompleteColumn(), *told, console=console) as progress:
        task = progress.add_task(label, total=total, completed=done, rate="", left="", failed="")
        yield _Bar(progress, task, count)


@dataclass(slots=True)
class _Count:
    """Finished trials, their rate, and the remaining time.

    Trials finish in batches, one per worker. The time spent on running batches is included, up to the mean duration of
    a batch, so that the remaining time decreases steadily.

    Attributes:
        total: Number of trials of the study.
        before: Number of trials finished earlier.
        begun: Start times of running batches, the earliest first.
    """

    total: int
    before: int
    begun: list[float]
    finished: int = 0
    failed: int = 0
    spent: float = 0.0
    batch: int = 1
    started: float = field(default_factory=lambda: time.monotonic())

    @property
    def done(self) -> int:
        return self.before + self.finished

    @property
    def pace(self) -> float:
        """Return the time of one worker for one trial [s]."""
        return self.spent / max(self.finished, 1)

    def add(self, trials: int, failed: int) -> None:
        now = time.monotonic()
        self.spent += now - self.begun.pop(0)
        self.begun.append(now)
        self.finished += trials
        self.failed += failed
        self.batch = trials

    def rate(self) -> str:
        """Return the trials per second, or per minute if these are few, as text; empty before the first trial."""
        if not self.pace:
            return ""
        rate = len(self.begun) / self.pace
        return f"{rate:.1f} per second" if rate >= 1.0 else f"{60.0 * rate:.1f} per minute"

    def left(self) -> str:
        """Return the remaining time as text, empty before the first trial; at the end the total time."""
        if not self.finished:
            return ""
        if self.done == self.total:
            return f"in {duration(time.monotonic() - self.started)}"
        now, longest = time.monotonic(), self.batch * self.pace
        under_way = sum(min(now - each, longest) for each in self.begun)
        seconds = max((self.total - self.done) * self.pace - under_way, 0.0) / len(self.begun)
        return f"{duration(seconds)} left"


class Reporter:
    """Interface for reporting the progress of a study."""

    def __init__(self, count: _Count) -> None:
        self._count = count

    def advance(self, trials: int, failed: int) -> None:
        """Report finished trials, of which some failed."""
        self._count.add(trials, failed)
        self.tick()

    def tick(self) -> None:
        """Update the display."""


class _Bar(Reporter):
    def __init__(self, progress: "Progress", task: "TaskID", count: _Count) -> None:
        super().__init__(count)
        self._progress, self._task = progress, task

    def tick(self) -> None:
        count = self._count
        failed = f"{count.failed} failed"
        self._progress.update(self._task, completed=count.done, rate=count.rate(), left=count.left(), failed=failed)


class _Lines(Reporter):
    def __init__(self, label: str, console: "Console", count: _Count) -> None:
        super().__init__(count)
        self._label, self._console = label, console
        self._next = time.monotonic() + FIRST_LINE

    def tick(self) -> None:
        now, count = time.monotonic(), self._count
        if now < self._next:
            return
        self._next = now + LINE_EVERY
        told = [f"{count.done} of {count.total} trials", count.rate(), count.left(), f"{count.failed} failed"]
        self._console.print(f"{self._label}: {', '.join(filter(None, told))}", soft_wrap=True)


def duration(seconds: float) -> str:
    """Return seconds in suitable units."""
    hours, rest = divmod(round(seconds), 3600)
    minutes, seconds = divmod(rest, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {seconds} s" if minutes else f"{seconds} s"


EVERY = 1.0
"""Interval of updates of the best value, on a terminal [s]."""
Tell = Callable[[int, Callable[[], str]], None]
"""Receives the completed amount, and a function that returns the best result so far as text."""


@contextmanager
def search_progress(label: str, total: int, console: "Console", before: int = 0) -> Generator[Tell]:
    """Show the progress of a search."""
    if not console.is_terminal:
        yield _lines(label, total, console, before)
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(elapsed_when_finished=True),
        TextColumn("{task.fields[best]}"),
    )
    with Progress(*columns, console=console, speed_estimate_period=300.0) as progress:
        task = progress.add_task(label, total=total, completed=before, best="")
        yield _now_and_then(EVERY, EVERY, lambda done, best: progress.update(task, completed=done, best=best))


def _lines(label: str, total: int, console: "Console", before: int) -> Tell:
    began = time.monotonic()

    def line(done: int, best: str) -> None:
        pace = (time.monotonic() - began) / max(done - before, 1)
        left = duration(pace * max(total - done, 0))
        console.print(f"{label}: {done} of {total}, {left} left, {best}", soft_wrap=True)

    return _now_and_then(FIRST_LINE, LINE_EVERY, line)


def _now_and_then(first: float, period: float, say: Callable[[int, str], None]) -> Tell:
    """Print after a delay, then at intervals."""
    due = time.monotonic() + first

    def tell(done: int, best: Callable[[], str]) -> None:
        nonlocal due
        if time.monotonic() >= due:
            due = time.monotonic() + period
            say(done, best())

    return tell
