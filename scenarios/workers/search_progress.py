"""How far a search is: a bar on a terminal, a line every ten seconds elsewhere; both on stderr."""

import time
from collections.abc import Callable, Generator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from scenarios.workers.progress import LINE_EVERY

EVERY = 1.0
"""Time between two looks at the best, on a terminal [s]."""
Tell = Callable[[int, Callable[[], str]], None]
"""Takes how much is done, and what gives the best so far in words."""


@contextmanager
def search_progress(label: str, total: int, console: Console) -> Generator[Tell]:
    """Show the progress of a search.

    Args:
        label: What is under way.
        total: Candidates that it tries.
        console: On stderr.
    """
    if not console.is_terminal:
        yield _lines(label, total, console)
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(elapsed_when_finished=True),
        TextColumn("{task.fields[best]}"),
    )
    with Progress(*columns, console=console, speed_estimate_period=300.0) as progress:
        task = progress.add_task(label, total=total, best="")
        yield _now_and_then(EVERY, lambda done, best: progress.update(task, completed=done, best=best))


def _lines(label: str, total: int, console: Console) -> Tell:
    def line(done: int, best: str) -> None:
        console.print(f"{label}: {done} of {total}, {best}", soft_wrap=True)

    return _now_and_then(LINE_EVERY, line)


def _now_and_then(period: float, say: Callable[[int, str], None]) -> Tell:
    """Say it if the last time is a while ago."""
    last = time.monotonic()

    def tell(done: int, best: Callable[[], str]) -> None:
        nonlocal last
        if time.monotonic() - last >= period:
            last = time.monotonic()
            say(done, best())

    return tell
