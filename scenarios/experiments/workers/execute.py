"""Run tasks on an executor, with a small queue, and recover from dying workers.

A process pool breaks as a whole, so a task whose worker dies need not be the cause. Each such task is repeated alone
once; if it fails again, it is abandoned, with the reason. If the first few tasks are all abandoned and none has
succeeded, the workers are considered faulty, and the study ends.
"""

from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import closing
from dataclasses import dataclass
from typing import TypeVar

from scenarios.experiments.workers.kinds import SCHEDULER_GONE, Workers
from scenarios.support.errors import StudyError

AHEAD = 2
"""Tasks submitted per worker, so that no worker is idle."""
TICK = 0.5
"""Interval between calls of `tick` while waiting [s]."""
HOPELESS = 3
"""Number of abandoned tasks without a success after which the workers are considered faulty."""

Task = TypeVar("Task")
Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class GivenUp:
    """Failure of a task: `WorkerDied` or `WorkerFailed`, and the reason."""

    failure: str
    reason: str


def completed(
    workers: Workers, function: Callable[[Task], Result], tasks: Iterable[Task], *, tick: Callable[[], None]
) -> Generator[tuple[Task, Result | GivenUp]]:
    """Run a function on every task.

    The function and its tasks must be picklable; tasks are taken as workers become free; `tick` is called while
    waiting.

    Yields:
        Each task with its result, in order of completion.

    Raises:
        StudyError: As the function; if the workers are unreachable or cannot import the function; if the first tasks
            are all abandoned.
    """
    queue, suspects = iter(tasks), deque[Task]()
    done = given_up = 0
    while True:
        alone = bool(suspects)
        with closing(_outcomes(workers, function, iter([suspects.popleft()]) if alone else queue, tick)) as outcomes:
            for task, outcome in outcomes:
                if not isinstance(outcome, GivenUp):
                    done += 1
                    yield task, outcome
                elif not alone:
                    suspects.append(task)
                else:
                    given_up += 1
                    yield task, outcome
                    if given_up == HOPELESS and not done:
                        raise StudyError(
                            f"none of the first {HOPELESS} chunks of trials returned: {outcome.reason}; fix the cause "
                            "and repeat the command"
                        )
        if not alone and not suspects:
            return


def _outcomes(
    workers: Workers, function: Callable[[Task], Result], tasks: Iterator[Task], tick: Callable[[], None]
) -> Generator[tuple[Task, Result | GivenUp]]:
    """Run tasks on a new executor until one fails; running tasks are completed."""
    executor, running, failed = workers.open(), dict[Future[Result], Task](), False
    try:
        while True:
            while not failed and len(running) < AHEAD * workers.count() and (task := next(tasks, None)) is not None:
                running[_submitted(executor, function, task)] = task
            if not running:
                return
            while not (finished := wait(running, timeout=TICK, return_when=FIRST_COMPLETED).done):
                if not workers.reachable():
                    raise StudyError(SCHEDULER_GONE)
                tick()
            for future in finished:
                outcome = _outcome(future, workers.died)
                failed |= isinstance(outcome, GivenUp)
                yield running.pop(future), outcome
    finally:
        workers.close(executor)


def _submitted(executor: Executor, function: Callable[[Task], Result], task: Task) -> Future[Result]:
    try:
        return executor.submit(function, task)
    except BrokenExecutor as error:  # a worker died between two tasks
        future = Future[Result]()
        future.set_exception(error)
        return future


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
