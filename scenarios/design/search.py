"""Search for a motion that minimises the largest predicted standard deviation of the gains, and its selection.

The search starts with the best of 300 random motions, and continues with CMA-ES. The cost is not smooth where the
sample that limits the motion changes; gradient descent stops there with standard deviations 1.5 times as large. The
motion to carry out is the best one of the search if it meets its limits also between the samples after a reduction by
at most 10 %, otherwise the same motion with a smaller amplitude, or an earlier one.
"""

import pickle
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Protocol

import cma
import numpy as np
from pydantic import Field
from scipy import special

from ident.support.arrays import Array, Mask
from scenarios.design.excitation import SEARCHED_HZ, SHARES, Design, Limits, Problem, scaled
from scenarios.rendering.result import ResultModel
from sim.errors import NoPositionError, TrajectoryError
from sim.trajectory import FourierTrajectory, at_rest

FIRST = 300
"""Number of random motions at the start."""
STEP, SMALL_STEP = 0.2, 0.05
"""Initial step size, from a random motion and from the result of a search."""
LEAST_SHARE = 0.25
"""Smallest amplitude of a joint, as a share of the largest: a joint at rest gives no information on its parameters."""
POSITIONS, ADMISSIBLE = 2000, 30
"""Number of random positions if home is not feasible, and number of feasible ones that are used."""
APART = 0.01
"""Smallest cost difference of stored motions: 1 % of a standard deviation. Closer motions usually fail together."""
SMALL_SIZES = np.arange(0.9, 0.3, -0.02)
"""Factors on a motion for which a reduction by 10 % is not enough; smaller motions give little information."""
LEAST_SIZES = (0.3, 0.25, 0.2, 0.15, 0.1)
"""Further factors for a motion that can be scaled only about one of its positions."""
QUICKEST = 1.5
"""Highest harmonic of an accelerated motion [Hz]: position loops of arms follow it, and filters of logs pass it."""

Judge = Callable[[Sequence[Array]], list[float]]
"""Function that returns the costs of motions."""


class Searchable(Protocol):
    """Parametrisation of motions in a search."""

    def motion(self, x: Array) -> FourierTrajectory:
        """Return the motion of a point."""
        ...

    def drawn(self, start: Array, rng: np.random.Generator) -> Array:
        """Return the point of a random motion about a position."""
        ...

    def point(self, motion: FourierTrajectory) -> Array:
        """Return the point of a motion."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Series:
    """Parametrisation: centres, shares of the largest feasible amplitude, coefficients up to scale.

    Attributes:
        limits: Limits that scale the amplitudes.
        harmonics: Number of harmonics.
        duration: Period [s].
    """

    limits: Limits
    harmonics: int
    duration: float

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.limits.lower)

    def motion(self, x: Array) -> FourierTrajectory:
        """Return the motion of a point, shape (2 n + 2 n harmonics,)."""
        n = self.n
        sine, cosine = x[2 * n :].reshape(2, n, self.harmonics)
        raw = at_rest(x[:n], sine, cosine, self.duration)
        share = LEAST_SHARE + (1.0 - LEAST_SHARE) * special.expit(x[n : 2 * n])
        scale = (share * self.limits.largest_scale(raw))[:, None]
        return FourierTrajectory(raw.center, scale * raw.sine, scale * raw.cosine, self.duration)

    def drawn(self, start: Array, rng: np.random.Generator) -> Array:
        """Return the point of a random motion about a position."""
        fade = 1.0 / np.sqrt(np.arange(1, self.harmonics + 1))
        shares = rng.uniform(-1.0, 2.0, self.n)
        return np.concatenate((start, shares, (fade * rng.standard_normal((2, self.n, self.harmonics))).ravel()))

    def point(self, motion: FourierTrajectory) -> Array:
        """Return the point of a motion with at most these harmonics; amplitudes are at least the smallest share."""
        room = self.limits.largest_scale(motion)
        share = (np.clip(1.0 / room, LEAST_SHARE + 1e-3, 1.0 - 1e-3) - LEAST_SHARE) / (1.0 - LEAST_SHARE)
        coefficients = np.zeros((2, self.n, self.harmonics))
        coefficients[..., : motion.sine.shape[1]] = motion.sine, motion.cosine
        size = np.sqrt(np.mean(coefficients**2, axis=(0, 2), keepdims=True))
        usual = np.sqrt(np.mean(1.0 / np.arange(1, self.harmonics + 1)))
        return np.concatenate((motion.center, special.logit(share), (usual * coefficients / size).ravel()))


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
    cost_of_start: float = Field(description="Cost of the initial motion of the search, a sum of logarithms as `cost`")
    cost: float = Field(
        description=(
            "Cost that the search minimises: a sum of logarithms of the relative standard deviations of the gains to "
            "identify, dominated by the largest, plus a penalty for exceeded limits"
        )
    )
    predicted_rel_std: list[float | None] = Field(
        description="Relative standard deviation of each gain, null if the motion does not determine the gain"
    )


def starts(design: Design, home: Array, rng: np.random.Generator) -> Array:
    """Return initial centres of motions. `home` is that of the robot's file [rad or m], shape (n,).

    Returns:
        Home if it is feasible at rest, otherwise random feasible positions within the ranges, shape (k, n).

    Raises:
        NoPositionError: If there are none.
    """
    if design.can_hold(home):
        return home[None]
    limits = design.problem.limits
    half = SHARES["range"] * limits.half
    drawn = limits.center + half * rng.uniform(-1.0, 1.0, (POSITIONS, len(home)))
    found = drawn[admissible(design, drawn)][:ADMISSIBLE]
    if not len(found):
        raise NoPositionError(
            f"robot {design.problem.plant.robot.name}: neither home nor any of "
            f"{POSITIONS} random positions is feasible: "
            f"{design.obstacles(drawn)}; check these shapes and torques, or take a lighter payload"
        )
    return found


def admissible(design: Design, q: Array) -> Mask:
    """Return a mask of positions (k, n) that meet all limits at rest, shape (k,)."""
    return np.array([design.can_hold(each) for each in q], dtype=bool)


def random_point(series: Searchable, starts: Array, seed: int, judge: Judge) -> Found:
    """Return the best of `FIRST` random motions, about each start in turn."""
    rng = np.random.default_rng(seed)
    points = [series.drawn(starts[k % len(starts)], rng) for k in range(FIRST)]
    costs = judge(points)
    best = int(np.argmin(costs))
    return Found(x=points[best], cost=costs[best], tried=0)


def known_point(series: Searchable, motion: FourierTrajectory, tried: int, judge: Judge) -> Found:
    """Return the state for continuing from a motion."""
    x = series.point(motion)
    return Found(x=x, cost=judge([x])[0], tried=tried)


def search(first: Found, step: float, seed: int, evaluations: int, judge: Judge) -> Iterator[Found]:
    """Yield successively better motions, one per generation of CMA-ES.

    Args:
        first: Initial state.
        step: Initial step size.
        seed: Seed of the random numbers; the same seed gives the same motion.
        evaluations: Number of motions to try, without the random ones at the start.
        judge: Returns their costs.
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


def judge_here(design: Design, series: Searchable) -> Judge:
    """Evaluate motions one after another."""
    return lambda points: [design.cost(series.motion(x)) for x in points]


def judge_in(pool: Executor, workers: int, problem: Problem, series: Searchable) -> Judge:
    """Evaluate motions in the processes of a pool; the costs are the same."""
    stated = pickle.dumps((problem, series))

    def judge(points: Sequence[Array]) -> list[float]:
        bounds = np.linspace(0, len(points), workers + 1).astype(int)
        parts = [points[a:b] for a, b in pairwise(bounds) if b > a]
        return [cost for part in [pool.submit(costs_of, stated, part) for part in parts] for cost in part.result()]

    return judge


def costs_of(stated: bytes, points: Sequence[Array]) -> list[float]:
    """Return costs of some motions, in a worker."""
    return _judge(stated)(points)


@lru_cache(maxsize=1)
def _judge(stated: bytes) -> Judge:
    problem, series = pickle.loads(stated)
    return judge_here(Design(problem), series)


def with_better(kept: Sequence[Found], found: Found) -> tuple[Found, ...]:
    """Return the stored motions, best last, with a new one if it is better."""
    if not kept:
        return (found,)
    if found.cost >= kept[-1].cost:
        return tuple(kept)
    crowded = len(kept) > 1 and kept[-2].cost - kept[-1].cost < APART
    return (*(kept[:-1] if crowded else kept), found)


def best_fitted(design: Design, series: Searchable, kept: Sequence[Found]) -> tuple[FourierTrajectory, str]:
    """Return the best motion of a search if a reduction by 10 % is enough, otherwise the best alternative.

    Alternatives are the same motion with a smaller amplitude, or an earlier one that costs less. Also returned is why
    it is not the best, or an empty text. `kept` has at least one motion, the best last.

    Raises:
        TrajectoryError: If none can be scaled to the limits; the message states the violation of the best.
    """
    best = series.motion(kept[-1].x)
    try:
        return design.fitted(best), ""
    except TrajectoryError as error:
        reason = str(error)
    others = _each_fitted(design, [best], SMALL_SIZES)
    most = min(map(design.cost, others), default=np.inf)
    earlier = (series.motion(found.x) for found in reversed(kept[:-1]) if found.cost < most)
    others += _each_fitted(design, earlier)
    if not others:
        raise TrajectoryError(f"no motion found can be scaled to the robot's limits; the best one: {reason}")
    return min(others, key=design.cost), reason


def _each_fitted(design: Design, motions: Iterable[FourierTrajectory], *sizes: Array) -> list[FourierTrajectory]:
    """Return the first of some motions that can be scaled to the limits; empty if none can."""
    for motion in motions:
        try:
            return [design.fitted(motion, *sizes)]
        except TrajectoryError:
            continue
    return []


def first_fitted(design: Design, series: Searchable, searches: Iterable[Sequence[Found]]) -> FourierTrajectory:
    """Return the best motion of the first search for which a reduction by 10 % is enough, or the best alternative.

    Searches are started only as needed.

    Raises:
        TrajectoryError: If none can be scaled to the limits; the message states the violation of the best of the last
            search.
    """
    reason, motions = "", list[FourierTrajectory]()
    for kept in searches:
        try:
            motion, why = best_fitted(design, series, kept)
        except TrajectoryError as error:
            reason = str(error)
            continue
        if not why:
            return motion
        motions.append(motion)
    if not motions:
        raise TrajectoryError(reason)
    return min(motions, key=design.cost)


def quickened(design: Design, motion: FourierTrajectory) -> FourierTrajectory:
    """Return the motion, or the same path repeated faster within the period, whichever is more accurate.

    Ranges and distances limit a search in few slow harmonics, far below the rated speeds of the joints. Repeated k
    times, harmonic h of a path becomes harmonic k h.
    """
    best, harmonics = motion, motion.sine.shape[1]
    for times in range(2, int(QUICKEST * motion.duration / harmonics) + 1):
        sine, cosine = (np.zeros((motion.n, times * harmonics)) for _ in range(2))
        sine[:, times - 1 :: times], cosine[:, times - 1 :: times] = motion.sine, motion.cosine
        quick = FourierTrajectory(motion.center, sine, cosine, motion.duration)
        if not design.keeps_limits(quick):
            break
        best = min(best, quick, key=design.cost)
    return best


def about_a_pose(design: Design, motion: FourierTrajectory) -> list[FourierTrajectory]:
    """Return the motion scaled about the middle of its feasible positions; empty if there are none."""
    held = [q for q in design.rows(motion, SEARCHED_HZ).motion[0] if design.can_hold(q)]
    if not held:
        return []
    sizes = (*SMALL_SIZES, *LEAST_SIZES)
    return _each_fitted(design, (scaled(motion, size, held[len(held) // 2]) for size in sizes), np.ones(1))
