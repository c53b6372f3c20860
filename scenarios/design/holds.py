"""Hold and creep: slow sweeps between poses that are held, there and back the same way, as a Fourier series.

The way has `LEGS` straight legs, with a hold at either end and one in the middle of each. Made there and back, every
position is passed in both directions, and the hold in the middle of a leg is approached from both sides. Kinks are
smoothed by a Gaussian, so that a series of `HARMONICS` cosines is the motion (`docs/derivations.md`).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np

from ident.model.regressor import regressor
from ident.model.structure import PROBE_SEED, Structure
from ident.support.arrays import Array, Mask
from scenarios.design.excitation import Problem
from scenarios.design.limits import SHARES, Limits
from scenarios.prediction.deviations import Carried, Deviations, MotionRows, Prediction
from scenarios.support.errors import ScenarioError
from sim.trajectory import FourierTrajectory, at_rest

LEGS = 3
"""Straight legs of the way there; 24 numbers of six joints are to be searched."""
HOLD = 0.5
"""Time of a hold in times of a sweep."""
SMOOTH = 0.2
"""Deviation of the Gaussian that smooths kinks, in times of a hold: the middle of a hold is at rest."""
HARMONICS = 108
"""Of the series: faster than these the Gaussian leaves a thousandth of what is already small."""
GRID = 4096
"""Samples of a period that the coefficients are found from."""
FAST, SLOW = (0.5, 0.1), (0.1, 0.02)
"""Speeds of a joint that turns [rad/s] and of one that slides [m/s], assumed: the largest, which any arm follows and a
log of 30 Hz resolves, and that at which a row counts half, since slower ones leave the sign of friction to the encoder.
"""
TORQUE_SHARE = 0.7
"""Share of a joint's torque at the current limit that arm and payload may take, assumed. It leaves room for a gain 15 %
low, 10 % more torque against load-dependent friction and 5 % against other friction: 0.7 x 1.15 / 0.85 = 0.95.
"""
LEAST_LOAD = 1e-6
"""Share of the payload's largest torque at rest under which a joint counts as one that gravity does not load."""
STILL = 1e-6
"""Of a row of a joint that is held, so that no column is empty."""
Predicting = Callable[[Carried], Deviations]
SEARCHED_HZ = 4.0
"""Samples a second while a motion so slow is searched."""
SHORTEST = 36.0
"""Shortest motion [s]: sweeps of 2 s, holds of 1 s."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Holds:
    """Motions as points of a search: the poses at the ends of the legs, from -1 to 1 in the joints' ranges.

    Attributes:
        limits: Give the ranges.
        duration: Period [s].
    """

    limits: Limits
    duration: float

    def __post_init__(self) -> None:
        """Check the duration.

        Raises:
            ScenarioError: If sweeps and holds would be too short.
        """
        if self.duration < SHORTEST:
            raise ScenarioError(
                f"--duration {self.duration:g}: {4 * LEGS} slow sweeps and as many holds need {SHORTEST:g} s or more"
            )

    @property
    def n(self) -> int:
        """Joints."""
        return len(self.limits.lower)

    def motion(self, x: Array) -> FourierTrajectory:
        """The motion of a point, shape ((LEGS + 1) n,)."""
        lower, upper = self.limits.lower, self.limits.upper
        poses = 0.5 * (upper + lower) + 0.5 * (upper - lower) * x.reshape(LEGS + 1, self.n)
        series = poses.T @ _cosines()
        return at_rest(series[:, 0], np.zeros((self.n, HARMONICS)), series[:, 1:], self.duration)

    def drawn(self, start: Array, rng: np.random.Generator) -> Array:
        """The point of a random motion about a position, small or large."""
        lower, upper = self.limits.lower, self.limits.upper
        about = (start - 0.5 * (upper + lower)) / (0.5 * (upper - lower))
        largest = SHARES["range"] * rng.uniform(0.1, 1.0)
        return np.clip(about + largest * rng.uniform(-1.0, 1.0, (LEGS + 1, self.n)), -1.0, 1.0).ravel()

    def point(self, motion: FourierTrajectory) -> Array:
        """The point of a motion that is of this kind; that of the nearest one if it is not."""
        lower, upper = self.limits.lower, self.limits.upper
        series = np.column_stack((motion.center, motion.cosine[:, :HARMONICS]))
        kept = _cosines()[:, : series.shape[1]]
        poses = np.linalg.lstsq(kept.T, series.T)[0]
        return ((poses - 0.5 * (upper + lower)) / (0.5 * (upper - lower))).ravel()


@lru_cache(maxsize=1)
def _cosines() -> Array:
    """Mean and cosines of the whole motion per pose at the end of a leg, shape (LEGS + 1, 1 + HARMONICS)."""
    there = np.linspace(0.0, LEGS, 2 * LEGS + 1)
    visits = np.concatenate((there, there[-2::-1]))  # in legs from the first pose
    begin = (1.0 + HOLD) * np.arange(len(visits)) - 0.5 * HOLD  # of each hold, in times of a sweep
    period = begin[-1] + 0.5 * HOLD
    t = period * np.arange(GRID) / GRID
    way = np.interp(t, np.column_stack((begin, begin + HOLD)).ravel(), np.repeat(visits, 2))
    ends = np.maximum(1.0 - np.abs(way - np.arange(LEGS + 1)[:, None]), 0.0)  # straight between neighbours
    f = np.arange(HARMONICS + 1) / period
    series = np.fft.rfft(ends)[:, : HARMONICS + 1].real / GRID * np.exp(-2.0 * (np.pi * SMOOTH * HOLD * f) ** 2)
    return np.concatenate((series[:, :1], 2.0 * series[:, 1:]), axis=1)


def hold_problem(problem: Problem) -> tuple[Problem, Mask]:
    """A design problem as holds and slow sweeps can solve it, and which joints gravity does not load, shape (n,).

    Joints move slowly, what is wanted is loaded by the payload at rest, and rows of a joint that is held do not count.

    Raises:
        ScenarioError: If the payload loads no wanted joint at rest.
    """
    structure = problem.structure
    fast, slow = (np.where(structure.arm.revolute, *speeds) for speeds in (FAST, SLOW))
    unloaded = ~_loaded_at_rest(structure, problem.carried)
    wanted = problem.joints[~unloaded[problem.joints]]
    if not len(wanted):
        raise ScenarioError("at rest the payload puts no torque on any joint to identify; use --protocol motion")
    speed = np.minimum(problem.limits.velocity, fast / SHARES["speed"])
    limits = replace(problem.limits, velocity=speed, torque_share=TORQUE_SHARE)
    prediction = partial(_counted, problem.prediction, slow)
    return replace(problem, limits=limits, joints=wanted, prediction=prediction, searched_hz=SEARCHED_HZ), unloaded


def _loaded_at_rest(structure: Structure, what: Carried) -> Mask:
    """Which joints the payload loads in some pose, shape (n,)."""
    q = np.random.default_rng(PROBE_SEED).uniform(-np.pi, np.pi, (64, structure.arm.n))
    still = np.zeros_like(q)
    torque = np.abs(regressor(structure.arm, q, still, still)[:, :, structure.payload_columns] @ what.chi).max(axis=0)
    return torque > LEAST_LOAD * torque.max()


def _counted(prediction: Prediction, slow: Array, rows: MotionRows, structure: Structure) -> Predicting:
    """The prediction with rows that count by the speed of their joint, one half at `slow`, shape (n,)."""
    speed = rows.motion[1] ** 2
    share = np.maximum(speed / (speed + slow**2), STILL)
    W, Y, rigid = rows.W * share[:, :, None], rows.Y * share[:, :, None], rows.rigid * share
    return prediction(replace(rows, W=W, Y=Y, rigid=rigid), structure)
