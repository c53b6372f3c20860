"""Progress of long work on stderr: a bar on a terminal, otherwise a line after two seconds and every ten seconds.

A separate thread writes the lines, also during work that reports nothing.
"""

import threading
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from rich.console import Console

T = TypeVar("T")
Note = str | Callable[[], str]
"""A remark on the state of the work; a function is called at most once a second, as it may be slow."""
FIRST_LINE, LINE_EVERY, NOTE_EVERY = 2.0, 10.0, 1.0
"""Time before the first line without a terminal, interval of further lines, and interval of notes [s]."""
BAR, NARROW = 15, 60
"""Width of a bar in characters, and width of a terminal below which the label of counted work is omitted."""


class Progress:
    """State of the work; this class reports nothing.

    Attributes:
        total: Amount of work in any unit, None if unknown.
        done: Finished amount, including that finished earlier.
    """

    def __init__(self, name: str = "", total: float | None = None, done: float = 0.0) -> None:
        self.begin(name, total, done)

    def begin(self, name: str, total: float | None = None, done: float = 0.0) -> None:
        """Begin a stage."""
        self.name, self.total, self.done, self.note = name, total, done, ""
        self.before, self.began, self._noted = done, time.monotonic(), 0.0

    def advance(self, amount: float, note: Note = "") -> None:
        """Advance the stage."""
        self.reach(self.done + amount, note)

    def reach(self, done: float, note: Note = "") -> None:
        """Set the finished amount."""
        self.done = done
        if isinstance(note, str):
            self.note = note
        elif time.monotonic() >= self._noted + NOTE_EVERY or done == self.total:
            self.note, self._noted = note(), time.monotonic()

    def line(self, *, counted: bool) -> str:
        """Return the state as one line; `counted` work as a count, other work in percent."""
        lasted = time.monotonic() - self.began
        if not self.total or self.done <= self.before:
            known = f"{self.done:g} of {self.total:g}, " if counted and self.total else ""
            return f"{self.name}: {known}for {duration(lasted)}"
        left = duration(lasted * max(self.total - self.done, 0.0) / (self.done - self.before))
        share = f"{self.done:g} of {self.total:g}" if counted else f"{100.0 * min(self.done / self.total, 1.0):.0f} %"
        return f"{self.name}: {share}, {left} left{', ' if self.note else ''}{self.note}"


SILENT = Progress()
"""Progress that is not reported."""


def counted(items: Iterable[T], progress: Progress) -> Iterator[T]:
    """Yield the items, and advance by one after each."""
    for item in items:
        yield item
        progress.advance(1)


@contextmanager
def progress_of(name: str, console: "Console", total: int | None = None, done: int = 0) -> Generator[Progress]:
    """Show what is under way until it is done; work with a total is counted, and its bar stays at the end."""
    if console.is_terminal:
        with _bar(name, console, total, done) as shown:
            yield shown
        return
    now, over = Progress(name, total, done), threading.Event()

    def live() -> None:
        wait = FIRST_LINE
        while not over.wait(wait):
            console.print(now.line(counted=total is not None), soft_wrap=True, highlight=False, markup=False)
            wait = LINE_EVERY

    thread = threading.Thread(target=live, daemon=True)
    thread.start()
    try:
        yield now
    finally:
        over.set()
        thread.join()


@contextmanager
def _bar(name: str, console: "Console", total: int | None, done: int) -> Generator[Progress]:
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
    from rich.progress import Progress as Bars

    label, note = TextColumn("{task.description}"), TextColumn("{task.fields[note]}")
    if total is None:
        columns = (label, BarColumn(BAR), TimeElapsedColumn(), TimeRemainingColumn(compact=True))
    else:
        wide = (label, BarColumn()) if console.width >= NARROW else ()
        columns = (*wide, MofNCompleteColumn(), TimeRemainingColumn(elapsed_when_finished=True), note)
    with Bars(*columns, console=console, transient=total is None, redirect_stdout=False) as bars:

        class Shown(Progress):
            def begin(self, name: str, total: float | None = None, done: float = 0.0) -> None:
                super().begin(name, total, done)
                for task in bars.task_ids:
                    bars.remove_task(task)
                self._task = bars.add_task(name, total=total, completed=done, note="")  # type: ignore[arg-type]

            def reach(self, done: float, note: Note = "") -> None:
                super().reach(done, note)
                bars.update(self._task, completed=done, note=self.note)

        yield Shown(name, total, done)


def duration(seconds: float) -> str:
    """Return seconds in suitable units."""
    hours, rest = divmod(round(seconds), 3600)
    minutes, seconds = divmod(rest, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {seconds} s" if minutes else f"{seconds} s"
