"""Progress of long work: a bar on a terminal with cursor control, elsewhere nothing."""

import time
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from rich.console import Console

T = TypeVar("T")
Note = str | Callable[[], str]
"""A remark on the state of the work; a function is called at most once a second, as it may be slow."""
NOTE_EVERY = 1.0
"""Interval of notes [s]."""
BAR, NARROW = 15, 60
"""Width of a bar in characters, and width of a terminal below which the label of counted work is omitted."""


class Progress:
    """State of the work, of an amount in any unit; this class reports nothing."""

    done = 0.0

    def begin(self, name: str, total: float | None = None, done: float = 0.0) -> None:
        """Begin a stage; `total` is None if unknown, `done` was finished earlier."""
        self.done = done

    def advance(self, amount: float, note: Note = "") -> None:
        """Advance the stage."""
        self.reach(self.done + amount, note)

    def reach(self, done: float, note: Note = "") -> None:
        """Set the finished amount."""
        self.done = done


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
    if not console.is_terminal:
        yield SILENT
        return
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
            noted = 0.0

            def begin(self, name: str, total: float | None = None, done: float = 0.0) -> None:
                super().begin(name, total, done)
                for task in bars.task_ids:
                    bars.remove_task(task)
                bars.add_task(name, total=total, completed=done, note="")  # type: ignore[arg-type]

            def reach(self, done: float, note: Note = "") -> None:
                super().reach(done, note)
                (task,) = bars.tasks
                if not isinstance(note, str):
                    due = time.monotonic() >= self.noted + NOTE_EVERY or done == task.total
                    note, self.noted = (note(), time.monotonic()) if due else (task.fields["note"], self.noted)
                bars.update(task.id, completed=done, note=note)

        shown = Shown()
        shown.begin(name, total, done)
        yield shown
