"""How far a search is: a bar on a terminal, a line now and then elsewhere; both on stderr."""

import time
from collections.abc import Callable, Generator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from scenarios.support.progress import FIRST_LINE, LINE_EVERY, duration

EVERY = 1.0
"""Time between two looks at the best, on a terminal [s]."""
Tell = Callable[[int, Callable[[], str]], None]
"""Takes how much is done, and what gives the best so far in words."""


@contextmanager
def search_progress(label: str, total: int, console: Console, before: int = 0) -> Generator[Tell]:
    """Show the progress of a search.

    Args:
        label: What is under way.
        total: Candidates that it tries.
        console: On stderr.
        before: How many a stopped search has tried.
    """
    if not console.is_terminal:
        yield _lines(label, total, console, before)
        return
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


def _lines(label: str, total: int, console: Console, before: int) -> Tell:
    began = time.monotonic()

    def line(done: int, best: str) -> None:
        pace = (time.monotonic() - began) / max(done - before, 1)
        left = duration(pace * max(total - done, 0))
        console.print(f"{label}: {done} of {total}, {left} left, {best}", soft_wrap=True)

    return _now_and_then(FIRST_LINE, LINE_EVERY, line)


def _now_and_then(first: float, period: float, say: Callable[[int, str], None]) -> Tell:
    """Say it for the first time after a while, and again if the last time is a while ago."""
    due = time.monotonic() + first

    def tell(done: int, best: Callable[[], str]) -> None:
        nonlocal due
        if time.monotonic() >= due:
            due = time.monotonic() + period
            say(done, best())

    return tell
