"""Search for the motion with the lowest cost, and the best of its motions that meets all limits.

The search starts with the best of 300 random motions, and continues with CMA-ES. The cost is not smooth where the
sample that limits the motion changes; gradient descent stops there with standard deviations 1.5 times as large.
"""

import pickle
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

import cma
import numpy as np
from pydantic import Field

from ident.support.arrays import Array
from scenarios.design.excitation import SHARES, Design
from scenarios.design.parametrisations import Series
from scenarios.rendering.result import ResultModel
from sim.errors import NO_POSITION, TrajectoryError
from sim.trajectory import FourierTrajectory

FIRST = 300
"""Number of random motions at the start."""
STEP, SMALL_STEP = 0.2, 0.05
"""Initial step size, from a random motion and from the result of a search."""
POSITIONS, ADMISSIBLE = 2000, 30
"""Number of random positions if home is not feasible, and number of feasible ones that are used."""
APART = 0.01
"""Smallest cost difference of motions that are fitted: 1 % of a standard deviation. Closer ones usually fail together.
"""

Judge = Callable[[Sequence[Array]], list[float]]
"""Function that returns the costs of motions."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """State of a search: the best point, its cost, and the number of motions tried without the random ones."""

    x: Array
    cost: float
    tried: int


class Searched(ResultModel):
    """What `rx90 excite --json` prints."""

    out: str = Field(description="The motion file that was written")
    tried: int = Field(description="Number of motions")
    cost_of_start: float = Field(description="Cost of the initial motion of the search, a logarithm as `cost`")
    cost: float = Field(
        description="Cost that the search minimises: mainly the logarithm of the largest relative standard deviation"
    )
    predicted_rel_std: list[float | None] = Field(
        description="Relative standard deviation of each gain, null if the motion does not determine the gain"
    )


def starts(design: Design, home: Array, rng: np.random.Generator) -> Array:
    """Return initial centres of motions, shape (k, n): home, if it is feasible at rest, else random feasible positions.

    `home` is that of the robot's file [rad or m], shape (n,). Raises `TrajectoryError` if there are none, of the
    kind `NO_POSITION`.
    """
    if design.at_rest(home[None])[0] == 0.0:
        return home[None]
    limits = design.limits
    drawn = limits.center + SHARES["range"] * limits.half * rng.uniform(-1.0, 1.0, (POSITIONS, len(home)))
    over = design.at_rest(drawn)
    if (over > 0.0).all():
        why = design.broken(design.resting(drawn[[over.argmin()]]))
        raise TrajectoryError(
            f"robot {design.plant.robot.name}: neither home nor any of {POSITIONS} random positions is feasible; at "
            f"rest, the most feasible one {why}; check these shapes and torques, or take a lighter payload",
            kind=NO_POSITION,
        )
    return drawn[over == 0.0][:ADMISSIBLE]


def random_point(series: Series, starts: Array, seed: int, judge: Judge) -> Found:
    """Return the best of `FIRST` random motions, about each start in turn."""
    rng = np.random.default_rng(seed)
    points = [series.drawn(starts[k % len(starts)], rng) for k in range(FIRST)]
    costs = judge(points)
    best = int(np.argmin(costs))
    return Found(x=points[best], cost=costs[best], tried=0)


def search(first: Found, step: float, seed: int, evaluations: int, judge: Judge) -> Iterator[Found]:
    """Yield successively better motions, one per generation of CMA-ES; the same seed gives the same ones.

    `step` is the initial step size, `evaluations` the number of motions to try, without the random ones at the start.
    """
    found = first
    yield found
    options = {"seed": seed + 1, "maxfevals": evaluations, "verbose": -9}
    strategy = cma.CMAEvolutionStrategy(first.x, step, options)
    while not strategy.stop():
        points = [np.asarray(x) for x in strategy.ask()]
        costs = judge(points)
        strategy.tell(points, costs)
        best, tried = int(np.argmin(costs)), found.tried + len(points)
        better = costs[best] < found.cost
        found = Found(x=points[best] if better else found.x, cost=min(costs[best], found.cost), tried=tried)
        yield found


def judge_in(pool: Executor, workers: int, design: Design, series: Series) -> Judge:
    """Evaluate motions in the processes of a pool; the costs are those of `Design.cost`."""
    stated = pickle.dumps((replace(design), series))  # without what it has prepared

    def judge(points: Sequence[Array]) -> list[float]:
        bounds = np.linspace(0, len(points), workers + 1).astype(int)
        parts = [points[a:b] for a, b in pairwise(bounds) if b > a]
        return [cost for part in [pool.submit(costs_of, stated, part) for part in parts] for cost in part.result()]

    return judge


def costs_of(stated: bytes, points: Sequence[Array]) -> list[float]:
    """Return costs of some motions, in a worker."""
    design, series = _prepared(stated)
    return [design.cost(series.motion(x)) for x in points]


@lru_cache(maxsize=1)
def _prepared(stated: bytes) -> tuple[Design, Series]:
    return pickle.loads(stated)


def best_fitted(design: Design, series: Series, kept: Sequence[Found]) -> FourierTrajectory:
    """Return the motion of a search with the lowest cost after it is scaled to the limits.

    Scaling hardly ever lowers a cost, so motions that cost more than the best scaled one are not tried. `kept` has
    at least one motion, successively better ones, the best last. Raises `TrajectoryError` if none can be scaled to
    the limits; the message states the violation of the best.
    """
    best, least, reason, tried = None, np.inf, "", -np.inf
    for found in reversed(kept):
        if found.cost >= least:
            break
        if found.cost < tried + APART:
            continue
        tried = found.cost
        try:
            motion = design.fitted(series.motion(found.x))
        except TrajectoryError as error:
            reason = reason or str(error)
            continue
        if (cost := design.cost(motion)) < least:
            best, least = motion, cost
    if best is None:
        raise TrajectoryError(f"no motion found can be scaled to the robot's limits; the best one: {reason}")
    return best
