"""Search for the motion with the lowest cost, and the best of its motions that meets all limits.

A motion is a point: weights of shapes, each a Fourier series, with amplitudes within limits. The shapes are single
harmonics, or holds with slow sweeps between: a path of `LEGS` straight legs, with a hold at each end and in the middle
of each leg. It is followed forward and back, so every position is passed in both directions. Corners are smoothed by a
Gaussian, so that a series of `HARMONICS` cosines represents it (`docs/derivations.md`).

The search starts with the best of 300 random motions, and continues with CMA-ES. The cost is not smooth where the
sample that limits the motion changes; gradient descent stops there with standard deviations 1.5 times as large.
"""

import pickle
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import cma
import numpy as np
from pydantic import Field
from scipy import special

from ident.model.regressor import regressor
from ident.model.structure import PROBE_SEED
from ident.support.arrays import Array, Mask
from scenarios.design.excitation import SHARES, Design, Limits
from scenarios.rendering.content import Paragraph, Part, column, table
from scenarios.rendering.result import ResultModel
from scenarios.rendering.wording import percent
from scenarios.support.errors import ScenarioError
from sim.errors import NO_POSITION, TrajectoryError
from sim.trajectory import FourierTrajectory, at_rest

LEAST_SHARE = 0.25
"""Smallest amplitude of a joint, as a share of the largest: a joint at rest gives no information on its parameters."""
LEGS = 3
"""Number of straight legs of the forward path; a search then has 24 variables for six joints."""
HOLD = 0.5
"""Ratio of the duration of a hold to that of a sweep."""
HARMONICS = 108
"""Number of harmonics; the smoothing attenuates higher ones to a thousandth."""
GRID = 4096
"""Number of samples of a period for computing the coefficients."""
FAST, SLOW = (0.5, 0.1), (0.1, 0.02)
"""Assumed speeds of revolute [rad/s] and prismatic joints [m/s]: the largest one, and that of a row weight of 1/2."""
TORQUE_SHARE = 0.7
"""Share of a joint's torque at the current limit that arm and payload may take, assumed. It leaves room for a gain 15 %
low, 10 % more torque against load-dependent friction and 5 % against other friction: 0.7 x 1.15 / 0.85 = 0.95.
"""
SEARCHED_HZ = 4.0
"""Sampling rate during the search for such slow motions [Hz]."""
SHORTEST = 36.0
"""Shortest motion [s]: sweeps of 2 s, holds of 1 s."""
FIRST = 300
"""Number of random motions at the start."""
STEP, SMALL_STEP = 0.2, 0.05
"""Initial step size, from a random motion and from the result of a search."""
POSITIONS, ADMISSIBLE = 2000, 30
"""Number of random positions if home is not feasible, and number of feasible ones that are used."""
APART = 0.01
"""Smallest cost difference of motions that are fitted: 1 % of a deviation. Closer ones usually fail together."""

Judge = Callable[[Sequence[Array]], list[float]]
"""Function that returns the costs of motions."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Series:
    """Parametrisation: centres, shares of the largest feasible amplitude, weights of shapes up to scale."""

    limits: Limits
    shapes: Array  # sine and cosine coefficients of K shapes in B blocks, shape (B, K, 2 H)
    usual: Array  # standard deviation of each weight of a random motion, shape (K,)
    duration: float  # period [s]
    times: int = 1  # how often the path is passed in a period

    @classmethod
    def harmonic(cls, limits: Limits, harmonics: int, duration: float, times: int = 1) -> "Series":
        """Return the parametrisation by sines and cosines of single harmonics, of a path passed several times."""
        shapes = np.eye(2 * harmonics).reshape(2, harmonics, 2 * harmonics)
        usual = np.arange(1.0, harmonics + 1.0) ** -0.5
        return cls(limits=limits, shapes=shapes, usual=usual, duration=duration, times=times)

    @classmethod
    def holds(cls, limits: Limits, duration: float) -> "Series":
        """Return the parametrisation by the poses at the ends of the legs, to which the weights are proportional."""
        if duration < SHORTEST:
            raise ScenarioError(
                f"--duration {duration:g}: {4 * LEGS} slow sweeps and as many holds need {SHORTEST:g} s or more"
            )
        there = np.linspace(0.0, LEGS, 2 * LEGS + 1)
        visits = np.concatenate((there, there[-2::-1]))  # in legs from the first pose
        begin = (1.0 + HOLD) * np.arange(len(visits)) - 0.5 * HOLD  # duration of each hold relative to a sweep
        period = begin[-1] + 0.5 * HOLD
        t = period * np.arange(GRID) / GRID
        way = np.interp(t, np.column_stack((begin, begin + HOLD)).ravel(), np.repeat(visits, 2))
        ends = np.maximum(1.0 - np.abs(way - np.arange(LEGS + 1)[:, None]), 0.0)  # linear between neighbours
        f = np.arange(1, HARMONICS + 1) / period
        cosine = 2.0 / GRID * np.fft.rfft(ends)[:, 1 : HARMONICS + 1].real
        cosine *= np.exp(-2.0 * (np.pi * 0.2 * HOLD * f) ** 2)  # by a fifth of a hold, whose middle stays at rest
        shapes = np.concatenate((np.zeros_like(cosine), cosine), axis=1)[None]
        return cls(limits=limits, shapes=shapes, usual=np.ones(LEGS + 1), duration=duration)

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.limits.lower)

    @property
    def harmonics(self) -> int:
        """Number of harmonics of a passage."""
        return self.shapes.shape[2] // 2

    def motion(self, x: Array) -> FourierTrajectory:
        """Return the motion of a point, shape (2 n + B n K,)."""
        n, (blocks, count, _) = self.n, self.shapes.shape
        sine, cosine = np.split((x[2 * n :].reshape(blocks, n, count) @ self.shapes).sum(axis=0), 2, axis=1)
        once, last = at_rest(x[:n], sine, cosine, self.duration), np.eye(1, self.times, self.times - 1)
        raw = replace(once, sine=np.kron(once.sine, last), cosine=np.kron(once.cosine, last))
        share = LEAST_SHARE + (1.0 - LEAST_SHARE) * special.expit(x[n : 2 * n])
        scale = (share * self.limits.largest_scale(raw))[:, None]
        return replace(raw, sine=scale * raw.sine, cosine=scale * raw.cosine)

    def drawn(self, start: Array, rng: np.random.Generator) -> Array:
        """Return the point of a random motion about a position."""
        shares = rng.uniform(-1.0, 2.0, self.n)
        weights = self.usual * rng.standard_normal((len(self.shapes), self.n, len(self.usual)))
        return np.concatenate((start, shares, weights.ravel()))

    def point(self, motion: FourierTrajectory) -> Array:
        """Return the point of a motion with at most these harmonics; amplitudes are at least the smallest share."""
        room = self.limits.largest_scale(motion)
        share = (np.clip(1.0 / room, LEAST_SHARE + 1e-3, 1.0 - 1e-3) - LEAST_SHARE) / (1.0 - LEAST_SHARE)
        blocks, count, width = self.shapes.shape
        series = np.zeros((self.n, 2, self.harmonics))
        series[..., : motion.sine.shape[1]] = np.stack((motion.sine, motion.cosine), axis=1)
        weights = series.reshape(self.n, width) @ np.linalg.pinv(self.shapes.reshape(-1, width))
        weights *= np.sqrt(np.mean(self.usual**2) / np.mean(weights**2, axis=1, keepdims=True))
        parts = weights.reshape(self.n, blocks, count).swapaxes(0, 1)
        return np.concatenate((motion.center, special.logit(share), parts.ravel()))


def hold_design(design: Design) -> tuple[Design, Mask]:
    """Return the problem for holds and slow sweeps, of joints that the payload loads at rest, and a mask of the others.

    Rows of a joint at rest have no weight. Raises `ScenarioError` if the payload loads no joint at rest.
    """
    structure = design.structure
    q = np.random.default_rng(PROBE_SEED).uniform(-np.pi, np.pi, (64, structure.arm.n))
    still = np.zeros_like(q)
    columns = regressor(structure.arm, q, still, still)[:, :, structure.payload_columns]
    torque = np.abs(columns @ design.carried.chi).max(axis=0)
    unloaded = torque <= 1e-6 * torque.max()  # by gravity
    wanted = design.joints[~unloaded[design.joints]]
    if not len(wanted):
        raise ScenarioError("at rest the payload puts no torque on any joint to identify; use --protocol motion")
    fast, slow = (np.where(structure.arm.revolute, *speeds) for speeds in (FAST, SLOW))
    limits = replace(
        design.limits,
        velocity=np.minimum(design.limits.velocity, fast / SHARES["speed"]),
        torque=TORQUE_SHARE / SHARES["torque"] * design.limits.torque,
    )
    return replace(design, limits=limits, joints=wanted, slow=slow, searched_hz=SEARCHED_HZ), unloaded


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """State of a search: the best point, its cost, and the number of motions tried without the random ones."""

    x: Array
    cost: float
    tried: int


class Searched(ResultModel):
    """What `rx90 excite --json` prints."""

    out: str  # the motion file that was written
    tried: int  # number of motions
    cost_of_start: float  # cost of the initial motion of the search, a logarithm as `cost`
    cost: float  # cost that the search minimises: mainly the logarithm of the largest relative standard deviation
    predicted_rel_std: list[float | None] = Field(
        description="Relative standard deviation of each gain, null if the motion does not determine the gain"
    )
    worst_of_start: float | None  # largest relative standard deviation of the gains to identify, initial motion
    worst: float | None  # relative one of the motion found; null if a motion does not determine one of these gains

    def parts(self) -> Iterator[Part]:
        """Return the largest deviation beside that of the start, and those of all joints."""
        start, found = self.worst_of_start, self.worst
        change = f" ({100.0 * (found / start - 1.0):+.0f} %)" if start and found else ""
        sizes = f"at the start {percent(start, '.3g')} %, now {percent(found, '.3g')} %{change}"
        yield Paragraph(f"Largest predicted standard deviation of a gain: {sizes}.", strong=True)
        yield table(
            enumerate(self.predicted_rel_std, 1),
            column("Joint", lambda each: each[0]),
            column("Standard deviation [%]", lambda each: percent(each[1], ".2g")),
        )


def starts(design: Design, home: Array, rng: np.random.Generator) -> Array:
    """Return initial centres of motions, (k, n): home [rad or m] if it is feasible at rest, else random feasible ones.

    Raises `TrajectoryError` of the kind `NO_POSITION` if there are none.
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
    """Yield the best motion so far, one per generation of CMA-ES, of an initial step and a number of motions to try."""
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

    return lambda points: list(pool.map(partial(_cost, stated), points, chunksize=-(-len(points) // workers)))


_prepared = lru_cache(maxsize=1)(pickle.loads)  # in a worker


def _cost(stated: bytes, x: Array) -> float:
    design, series = _prepared(stated)
    return design.cost(series.motion(x))


def best_fitted(design: Design, series: Series, kept: Sequence[Found]) -> FourierTrajectory:
    """Return the motion, of successively better ones, with the lowest cost after it is scaled to the limits.

    Raises `TrajectoryError` with the violation of the best if none can be scaled.
    """
    best, least, reason, tried = None, np.inf, "", -np.inf
    for found in reversed(kept):
        if found.cost >= least:  # scaling hardly ever lowers a cost
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
