"""Interface of workers, and their command-line option."""

from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor
from contextlib import AbstractContextManager
from dataclasses import dataclass

SCHEDULER_GONE = "the scheduler has exited; finished trials are kept; repeat the command"


@dataclass(frozen=True, slots=True)
class Workers:
    """Workers that run tasks.

    Attributes:
        open: Creates an executor; called again after a dying worker has broken the last one.
        count: Returns the current number of workers, for the length of the queue.
        died: Exceptions of a task's future if its worker has died.
        reachable: Returns whether the executor is still reachable.
        close: Shuts down an executor without waiting. Only the executor may cancel futures: the management thread of a
            process pool fails otherwise.
    """

    open: Callable[[], Executor]
    count: Callable[[], int]
    died: type[Exception] = BrokenExecutor
    reachable: Callable[[], bool] = lambda: True
    close: Callable[[Executor], None] = lambda executor: executor.shutdown(wait=False, cancel_futures=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkerKind:
    """A kind of workers and the command-line option that selects it.

    Attributes:
        option: Name of the option, without dashes; its value is a text.
        metavar: Name of the value in the help.
        help: Help text of the option.
        checked: Returns the text if it is valid, as a type of `argparse`.
        open: Context manager of the workers for a value, None if the option is not given.
        prepare: Called before the heavy imports of a study, so that workers start in the meantime.
    """

    option: str
    metavar: str
    help: str
    checked: Callable[[str], str]
    open: Callable[[str | None], AbstractContextManager[Workers]]
    prepare: Callable[[], object]
