"""What a place to run tasks must offer, and what the command line must know of it."""

from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor
from contextlib import AbstractContextManager
from dataclasses import dataclass

SCHEDULER_GONE = "the scheduler has exited; finished trials are kept; repeat the command"


@dataclass(frozen=True, slots=True)
class Workers:
    """Where tasks run.

    Attributes:
        open: Makes an executor; called again when a dying worker has broken the last one.
        count: Workers there are now, for how many tasks to hand out ahead.
        died: What a task's future raises when its worker has died.
        reachable: Whether the executor can still be spoken to.
        close: Ends an executor without waiting. Futures are the executor's own to cancel: the thread that looks after
            a process pool dies of one that others have.
    """

    open: Callable[[], Executor]
    count: Callable[[], int]
    died: type[Exception] = BrokenExecutor
    reachable: Callable[[], bool] = lambda: True
    close: Callable[[Executor], None] = lambda executor: executor.shutdown(wait=False, cancel_futures=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkerKind:
    """A kind of workers and the option of the command line that asks for it.

    Attributes:
        option: The option's name, without dashes; its value is a text.
        metavar: What the value is called in the help.
        help: What the option does.
        checked: Returns the text if it is a value of the option, as a type of `argparse` does.
        open: Makes the workers that a value asks for; None where the option is not given.
        prepare: Called before the heavy imports of a study, so that workers start meanwhile.
    """

    option: str
    metavar: str
    help: str
    checked: Callable[[str], str]
    open: Callable[[str | None], AbstractContextManager[Workers]]
    prepare: Callable[[], object]
