"""Run tasks on an executor, a few ahead of the workers, and survive workers that die.

A task whose worker dies may be the cause or a bystander (a process pool breaks as a whole). Each is therefore
tried once more with nothing beside it; one that fails alone too is given up, with the reason. Where the first few are
all given up and none has ever come back, the workers are to blame, and nothing more is tried.
"""

from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import closing
from dataclasses import dataclass
from typing import Generic, TypeVar

from scenarios.experiments.workers.kinds import SCHEDULER_GONE, Workers
from scenarios.support.errors import StudyError

AHEAD = 2
"""Tasks handed out per worker, so that none waits for its next one."""
TICK = 0.5
"""How often `tick` is called while nothing finishes [s]."""
HOPELESS = 3
"""Tasks given up, and none ever done, after which the workers are to blame."""

Task = TypeVar("Task")
Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class GivenUp:
    """Why a task has no result.

    Attributes:
        failure: `WorkerDied` or `WorkerFailed`.
        reason: In words.
    """

    failure: str
    reason: str


def completed(
    workers: Workers,
    function: Callable[[Task], Result],
    tasks: Iterable[Task],
    *,
    tick: Callable[[], None],
) -> Generator[tuple[Task, Result | GivenUp]]:
    """Run a function on every task.

    Args:
        workers: Where.
        function: What; it and its tasks can be pickled.
        tasks: Taken as workers become free.
        tick: Called now and then while waiting.

    Yields:
        Each task with its result, in the order they finish.

    Raises:
        StudyError: As the function does; if the workers cannot be reached any more; if they cannot import the function;
            if the first tasks are all given up.
    """
    done, given_up = 0, 0
    with closing(_each(workers, function, tasks, tick)) as outcomes:
        for task, outcome in outcomes:
            yield task, outcome
            if not isinstance(outcome, GivenUp):
                done += 1
                continue
            given_up += 1
            if given_up == HOPELESS and not done:
                raise StudyError(
                    f"of the first {HOPELESS} chunks of trials none returned: {outcome.reason}; fix the cause "
                    "and repeat the command"
                )


def _each(
    workers: Workers, function: Callable[[Task], Result], tasks: Iterable[Task], tick: Callable[[], None]
) -> Generator[tuple[Task, Result | GivenUp]]:
    """As `completed`, whatever comes back."""
    pool = _Pool[Task, Result](workers, function)
    queue, suspects = iter(tasks), deque[Task]()
    try:
        while True:
            if suspects and not pool.running:
                pool.submit(suspects.popleft(), alone=True)
            while not suspects and len(pool.running) < AHEAD * workers.count() and not pool.alone:
                task = next(queue, None)
                if task is None:
                    break
                pool.submit(task, alone=False)
            if not pool.running:
                return
            for task, outcome in pool.finished(tick):
                if isinstance(outcome, GivenUp) and not pool.alone:
                    suspects.append(task)
                else:
                    yield task, outcome
            if not pool.running:
                pool.alone = False
    finally:
        pool.close()


class _Pool(Generic[Task, Result]):
    """The executor in use and the tasks under way on it."""

    def __init__(self, workers: Workers, function: Callable[[Task], Result]) -> None:
        self._workers, self._function = workers, function
        self._executor: Executor | None = None
        self.running: dict[Future[Result], Task] = {}
        self.alone = False

    def submit(self, task: Task, *, alone: bool) -> None:
        self.alone = alone
        try:
            if self._executor is None:
                self._executor = self._workers.open()
            future = self._executor.submit(self._function, task)
        except BrokenExecutor:  # a worker died between two tasks
            future = Future[Result]()
            future.set_exception(BrokenExecutor("a worker died"))
        self.running[future] = task

    def finished(self, tick: Callable[[], None]) -> list[tuple[Task, Result | GivenUp]]:
        """Wait until some tasks finish."""
        while not (done := wait(self.running, timeout=TICK, return_when=FIRST_COMPLETED).done):
            if not self._workers.reachable():
                raise StudyError(SCHEDULER_GONE)
            tick()
        outcomes: list[tuple[Task, Result | GivenUp]] = []
        for future in done:
            outcomes.append((self.running.pop(future), self._outcome(future)))
        return outcomes

    def close(self) -> None:
        if self._executor is not None:
            self._workers.close(self._executor)
            self._executor = None

    def _outcome(self, future: Future[Result]) -> Result | GivenUp:
        try:
            return future.result()
        except StudyError:
            raise
        except CancelledError as error:  # by nobody here
            raise StudyError(SCHEDULER_GONE) from error
        except self._workers.died as error:
            if isinstance(error, BrokenExecutor):
                self.close()
            return GivenUp("WorkerDied", "its worker died")
        except Exception as error:
            absent = error if isinstance(error, ImportError) else error.__cause__
            if isinstance(absent, ImportError):
                raise StudyError(
                    f"a worker or scheduler cannot run trials: {absent}; install this version there"
                ) from error
            return GivenUp("WorkerFailed", f"its worker failed: {type(error).__name__}: {error}".splitlines()[0])
