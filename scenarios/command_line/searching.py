"""A search for a motion on the command line: options, processes, progress, interruption."""

import argparse
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import scenarios.command_line.arguments as arguments
from scenarios.command_line.output import console
from scenarios.experiments.workers.processes import PROCESSES
from scenarios.support.errors import ScenarioError

if TYPE_CHECKING:
    from scenarios.design.excitation import Design
    from scenarios.design.search import Found, Judge, Searchable
    from scenarios.design.searched_motion import Unfinished

FASTEST = 5.0
"""Highest harmonic [Hz] that the search samples twice per period."""
HARMONICS = arguments.count_from(
    2, 100, "a motion with 1 cannot begin and end at rest, a search cannot handle more than 100"
)
DURATION = arguments.number_from(5.0, 600.0, "s", "a shorter motion has too few rows, a longer one is not simulated")
EVALUATIONS = arguments.count_from(1, 10**7, "the largest number takes half a day")
FEW = 1000
"""Number of motions below which starting processes takes longer than the search."""


def add_search_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the common arguments of searches for a motion."""
    add = parser.add_argument
    add("--seed", type=arguments.seed, default=0, help="seed of the search (default 0)")
    add("--harmonics", type=HARMONICS, default=20, help="harmonics of the series (default 20)")
    add("--duration", type=DURATION, default=20.0, help="period [s] (default 20)")
    add("--evaluations", type=EVALUATIONS, default=40000, help="number of motions to try (default 40000)")
    add("--jobs", type=PROCESSES.checked, metavar=PROCESSES.metavar, help=PROCESSES.help)


def check_harmonics(options: argparse.Namespace) -> None:
    """Check that the sampling rate of the search is sufficient.

    Raises:
        ScenarioError: If the highest harmonic is too high.
    """
    if options.harmonics > FASTEST * options.duration:
        raise ScenarioError(
            f"--harmonics {options.harmonics} in --duration {options.duration:g}: the highest harmonic is at "
            f"{options.harmonics / options.duration:.3g} Hz; the search resolves up to {FASTEST:g} Hz"
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outcome:
    """Result of a search.

    Attributes:
        first: Initial motion, None if stopped before.
        found: The best motion.
        kept: Successively better motions, the best last; empty if there are none.
        interrupt: The interruption, None if completed.
    """

    first: "Found | None"
    found: "Found | None"
    kept: "tuple[Found, ...]"
    interrupt: KeyboardInterrupt | None


def searched(
    design: "Design", series: "Searchable", options: argparse.Namespace, before: "Unfinished | None"
) -> Outcome:
    """Search with the given options, with progress on stderr."""
    import numpy as np

    from scenarios.design.fitting import with_better
    from scenarios.design.search import SMALL_STEP, STEP, known_point, random_point, search, starts
    from scenarios.support.progress import progress_of

    first, found, kept = None, None, ()
    try:
        with _judge(design, series, options) as judge:
            if before is None:
                at = starts(design, design.problem.plant.robot.home, np.random.default_rng(options.seed))
                first, step = random_point(series, at, options.seed, judge), STEP
            else:
                first, step = known_point(series, before.motion, before.tried, judge), SMALL_STEP
            left = max(options.evaluations - first.tried, 1)
            done = 0 if before is None else before.tried
            with progress_of("motions", console(options), options.evaluations, done) as say:
                for found in search(first, step, options.seed + first.tried, left, judge):
                    kept = with_better(kept, found)
                    say.reach(
                        found.tried,
                        lambda x=found.x: f"{100.0 * design.worst(series.motion(x)):.3g} % on the worst joint",
                    )
    except KeyboardInterrupt as interrupt:
        return Outcome(first=first, found=found, kept=kept, interrupt=interrupt)
    return Outcome(first=first, found=found, kept=kept, interrupt=None)


def kept_of(outcome: Outcome) -> "tuple[Found, ...]":
    """Return successively better motions of a completed search.

    Raises:
        KeyboardInterrupt: If it was stopped.
    """
    if outcome.interrupt is not None or not outcome.kept:
        raise outcome.interrupt or AssertionError("a search that is not stopped finds a motion")
    return outcome.kept


@contextmanager
def _judge(design: "Design", series: "Searchable", options: argparse.Namespace) -> "Generator[Judge]":
    """Return the evaluation of motions, in this process if they are few, otherwise in others."""
    from scenarios.design.search import judge_here, judge_in

    if options.jobs == "1" or options.evaluations < FEW:
        yield judge_here(design, series)
        return
    with PROCESSES.open(options.jobs) as workers:
        pool = workers.open()
        try:
            yield judge_in(pool, workers.count(), design.problem, series)
        finally:
            workers.close(pool)
