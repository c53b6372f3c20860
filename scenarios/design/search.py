"""Search for a motion that minimises the largest predicted standard deviation of the gains.

The search starts with the best of 300 random motions, and continues with CMA-ES. The cost is not smooth where the
sample that limits the motion changes; gradient descent stops there with standard deviations 1.5 times as large.
"""

import pickle
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, TypeAlias

import cma
import numpy as np
from scipy import special

from ident.support.arrays import Array, Mask
from scenarios.design.excitation import Design, Problem, resting
from scenarios.design.limits import SHARES, Limits
from sim.errors import NoPositionError
from sim.trajectory import FourierTrajectory, at_rest

if TYPE_CHECKING:
    from scenarios.design.holds import Holds

FIRST = 300
"""Number of random motions at the start."""
STEP, SMALL_STEP = 0.2, 0.05
"""Initial step size, from a random motion and from the result of a search."""
LEAST_SHARE = 0.25
"""Smallest amplitude of a joint, as a share of the largest: a joint at rest gives no information on its parameters."""

POSITIONS, ADMISSIBLE = 2000, 30
"""Number of random positions if home is not feasible, and number of feasible ones that are used."""

Judge = Callable[[Sequence[Array]], list[float]]
"""Function that returns the costs of motions."""


Searchable: TypeAlias = "Series | Holds"
"""Parametrisation of motions in a search."""


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
    """State of a search.

    Attributes:
        x: Best point so far.
        cost: Its cost.
        tried: Number of motions tried, without the random ones at the start.
    """

    x: Array
    cost: float
    tried: int


def starts(design: Design, home: Array, rng: np.random.Generator) -> Array:
    """Return initial centres of motions. `home` is that of the robot's file [rad or m], shape (n,).

    Returns:
        Home if it is feasible at rest, otherwise random feasible positions within the ranges, shape (k, n).

    Raises:
        NoPositionError: If there are none.
    """
    if admissible(design, home[None])[0]:
        return home[None]
    limits = design.problem.limits
    center, half = 0.5 * (limits.upper + limits.lower), 0.5 * SHARES["range"] * (limits.upper - limits.lower)
    drawn = center + half * rng.uniform(-1.0, 1.0, (POSITIONS, len(home)))
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
    return np.array([not design.excess(design.rows(resting(each), 1.0)).any() for each in q], dtype=bool)


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
        tried = [np.asarray(x) for x in strategy.ask()]
        costs = judge(tried)
        strategy.tell(tried, costs)
        best = int(np.argmin(costs))
        better = costs[best] < found.cost
        found = Found(
            x=tried[best] if better else found.x,
            cost=costs[best] if better else found.cost,
            tried=found.tried + len(tried),
        )
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
