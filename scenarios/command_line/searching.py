"""A search for a motion on the command line: processes, progress, interruption."""

import argparse
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from scenarios.command_line.output import console
from scenarios.experiments.workers import PROCESSES

if TYPE_CHECKING:
    from scenarios.design.excitation import Design
    from scenarios.design.parametrisations import Searchable
    from scenarios.design.search import Found, Judge
    from sim.trajectory import FourierTrajectory

FEW = 1000
"""Number of motions below which starting processes takes longer than the search."""


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
    kept: "list[Found]"
    interrupt: KeyboardInterrupt | None


def searched(
    design: "Design",
    series: "Searchable",
    options: argparse.Namespace,
    before: "tuple[FourierTrajectory, int] | None" = None,
) -> Outcome:
    """Search with the given options, with progress on stderr; `before` is a motion to continue from, and its number."""
    import numpy as np

    from scenarios.design.search import SMALL_STEP, STEP, Found, random_point, search, starts
    from scenarios.support.progress import progress_of

    first, found, kept = None, None, list[Found]()
    try:
        with _judge(design, series, options) as judge:
            if before is None:
                at = starts(design, design.plant.robot.home, np.random.default_rng(options.seed))
                first, step = random_point(series, at, options.seed, judge), STEP
            else:
                x = series.point(before[0])
                first, step = Found(x=x, cost=judge([x])[0], tried=before[1]), SMALL_STEP
            left = max(options.evaluations - first.tried, 1)
            with progress_of("motions", console(options), options.evaluations, first.tried) as say:
                for found in search(first, step, options.seed + first.tried, left, judge):
                    if not kept or found.cost < kept[-1].cost:
                        kept.append(found)
                    say.reach(
                        found.tried,
                        lambda x=found.x: f"{100.0 * design.worst(series.motion(x)):.3g} % on the worst joint",
                    )
    except KeyboardInterrupt as interrupt:
        return Outcome(first=first, found=found, kept=kept, interrupt=interrupt)
    return Outcome(first=first, found=found, kept=kept, interrupt=None)


@contextmanager
def _judge(design: "Design", series: "Searchable", options: argparse.Namespace) -> "Generator[Judge]":
    """Return the evaluation of motions, in this process if they are few, otherwise in others."""
    from scenarios.design.search import judge_in

    if options.jobs == "1" or options.evaluations < FEW:
        yield lambda points: [design.cost(series.motion(x)) for x in points]
        return
    with PROCESSES.open(options.jobs) as workers:
        pool = workers.open()
        try:
            yield judge_in(pool, workers.count(), design, series)
        finally:
            workers.close(pool)
