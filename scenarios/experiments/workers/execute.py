"""Run tasks on any executor: a short queue, and recovery from dying workers.

A process pool breaks as a whole, so a task whose worker dies need not be the cause. Each task that was lost is repeated
alone once; if it fails again, it is abandoned, with the reason. If the first few tasks are all abandoned and none has
succeeded, the workers are considered faulty, and the study ends.
"""

from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TypeVar

from scenarios.support.errors import StudyError

SCHEDULER_GONE = "the scheduler has exited; finished trials are kept; repeat the command"
AHEAD = 2
"""Tasks submitted per worker, so that no worker is idle."""
TICK = 0.5
"""Interval between tests whether the workers are reachable [s]."""
HOPELESS = 3
"""Number of abandoned tasks without a success after which the workers are considered faulty."""

Task = TypeVar("Task")
Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class Workers:
    """Workers that run tasks.

    Attributes:
        open: Creates an executor; called again after a dying worker has broken the last one.
        count: Returns the current number of workers, for the length of the queue; raises `StudyError` if they are no
            longer reachable.
        died: Exceptions of a task's future if its worker has died.
        close: Shuts down an executor without waiting for its tasks.
    """

    open: Callable[[], Executor]
    count: Callable[[], int]
    died: type[Exception] = BrokenExecutor
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
    """

    option: str
    metavar: str
    help: str
    checked: Callable[[str], str]
    open: Callable[[str | None], AbstractContextManager[Workers]]


@dataclass(frozen=True, slots=True)
class GivenUp:
    """Failure of a task: `WorkerDied` or `WorkerFailed`, and the reason."""

    failure: str
    reason: str


def completed(
    workers: Workers, function: Callable[[Task], Result], tasks: Iterable[Task]
) -> Generator[tuple[Task, Result | GivenUp]]:
    """Run a function on every task.

    The function and its tasks must be picklable; tasks are taken as workers become free.

    Yields:
        Each task with its result, in order of completion.

    Raises:
        StudyError: As the function; if the workers are unreachable or cannot import the function; if the first tasks
            are all abandoned.
    """
    queue, suspects = iter(tasks), deque[Task]()
    returned = given_up = 0
    alone, pending = False, True
    while pending:
        source = iter([suspects.popleft()]) if alone else queue
        executor, running, broken = workers.open(), dict[Future[Result], Task](), False
        try:
            while True:
                while (
                    not broken and len(running) < AHEAD * workers.count() and (task := next(source, None)) is not None
                ):
                    try:
                        running[executor.submit(function, task)] = task
                    except BrokenExecutor:  # a worker died between two tasks
                        suspects.append(task)
                        broken = True
                if not running:
                    break
                while not (finished := wait(running, timeout=TICK, return_when=FIRST_COMPLETED).done):
                    workers.count()  # raises if they are no longer reachable
                for future in finished:
                    task, outcome = running.pop(future), _outcome(future, workers.died)
                    if isinstance(outcome, GivenUp) and not alone:
                        suspects.append(task)
                        broken = True
                        continue
                    given_up += isinstance(outcome, GivenUp)
                    returned += not isinstance(outcome, GivenUp)
                    yield task, outcome
                    if isinstance(outcome, GivenUp) and given_up == HOPELESS and not returned:
                        raise StudyError(
                            f"none of the first {HOPELESS} chunks of trials returned: {outcome.reason}; fix the cause "
                            "and repeat the command"
                        )
        finally:
            workers.close(executor)
        pending, alone = alone or broken, bool(suspects)


def _outcome(future: Future[Result], died: type[Exception]) -> Result | GivenUp:
    try:
        return future.result()
    except StudyError:
        raise
    except CancelledError as error:  # not by this process
        raise StudyError(SCHEDULER_GONE) from error
    except died:
        return GivenUp("WorkerDied", "its worker died")
    except Exception as error:
        absent = error if isinstance(error, ImportError) else error.__cause__
        if isinstance(absent, ImportError):
            raise StudyError(f"workers or scheduler cannot run trials: {absent}; install this version there") from error
        return GivenUp("WorkerFailed", f"its worker failed: {type(error).__name__}: {error}".splitlines()[0])
