"""Parametrisations of motions for a search: Fourier series, and holds with slow sweeps.

Holds and slow sweeps are a path of `LEGS` straight legs, with a hold at each end and in the middle of each leg. It is
followed forward and back, so every position is passed in both directions. Corners are smoothed by a Gaussian, so that a
series of `HARMONICS` cosines represents the motion (`docs/derivations.md`).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np
from scipy import special

from ident.model.regressor import regressor
from ident.model.structure import PROBE_SEED, Structure
from ident.support.arrays import Array, Mask
from scenarios.design.excitation import SHARES, Design, Limits
from scenarios.prediction.deviations import Carried, Deviations, MotionRows, Prediction
from scenarios.support.errors import ScenarioError
from sim.trajectory import FourierTrajectory, at_rest

LEAST_SHARE = 0.25
"""Smallest amplitude of a joint, as a share of the largest: a joint at rest gives no information on its parameters."""
LEGS = 3
"""Number of straight legs of the forward path; a search then has 24 variables for six joints."""
HOLD = 0.5
"""Ratio of the duration of a hold to that of a sweep."""
SMOOTH = 0.2
"""Standard deviation of the smoothing Gaussian, relative to the duration of a hold: the middle of a hold is at rest."""
HARMONICS = 108
"""Number of harmonics; the smoothing attenuates higher ones to a thousandth."""
GRID = 4096
"""Number of samples of a period for computing the coefficients."""
FAST, SLOW = (0.5, 0.1), (0.1, 0.02)
"""Assumed speeds of revolute [rad/s] and prismatic joints [m/s]: the largest one, and that of a row weight of 1/2.
"""
TORQUE_SHARE = 0.7
"""Share of a joint's torque at the current limit that arm and payload may take, assumed. It leaves room for a gain 15 %
low, 10 % more torque against load-dependent friction and 5 % against other friction: 0.7 x 1.15 / 0.85 = 0.95.
"""
LEAST_LOAD = 1e-6
"""Share of the payload's largest torque at rest below which gravity does not load a joint."""
STILL = 1e-6
"""Weight of a row at rest, so that no column is zero."""
SEARCHED_HZ = 4.0
"""Sampling rate during the search for such slow motions [Hz]."""
SHORTEST = 36.0
"""Shortest motion [s]: sweeps of 2 s, holds of 1 s."""


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
class Holds:
    """Parametrisation of the search: poses at the ends of the legs, from -1 to 1 in the joints' ranges.

    Attributes:
        limits: The ranges.
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
        """Number of joints."""
        return len(self.limits.lower)

    def motion(self, x: Array) -> FourierTrajectory:
        """Return the motion of a point, shape ((LEGS + 1) n,)."""
        poses = self.limits.center + self.limits.half * x.reshape(LEGS + 1, self.n)
        series = poses.T @ _cosines()
        return at_rest(series[:, 0], np.zeros((self.n, HARMONICS)), series[:, 1:], self.duration)

    def drawn(self, start: Array, rng: np.random.Generator) -> Array:
        """Return the point of a random motion about a position."""
        about = (start - self.limits.center) / self.limits.half
        largest = SHARES["range"] * rng.uniform(0.1, 1.0)
        return np.clip(about + largest * rng.uniform(-1.0, 1.0, (LEGS + 1, self.n)), -1.0, 1.0).ravel()

    def point(self, motion: FourierTrajectory) -> Array:
        """Return the point of a motion, or of the nearest motion of this kind."""
        series = np.column_stack((motion.center, motion.cosine[:, :HARMONICS]))
        poses = np.linalg.lstsq(_cosines()[:, : series.shape[1]].T, series.T)[0]
        return ((poses - self.limits.center) / self.limits.half).ravel()


@lru_cache(maxsize=1)
def _cosines() -> Array:
    """Return mean and cosine coefficients per pose at the ends of legs, shape (LEGS + 1, 1 + HARMONICS)."""
    there = np.linspace(0.0, LEGS, 2 * LEGS + 1)
    visits = np.concatenate((there, there[-2::-1]))  # in legs from the first pose
    begin = (1.0 + HOLD) * np.arange(len(visits)) - 0.5 * HOLD  # duration of each hold relative to a sweep
    period = begin[-1] + 0.5 * HOLD
    t = period * np.arange(GRID) / GRID
    way = np.interp(t, np.column_stack((begin, begin + HOLD)).ravel(), np.repeat(visits, 2))
    ends = np.maximum(1.0 - np.abs(way - np.arange(LEGS + 1)[:, None]), 0.0)  # linear between neighbours
    f = np.arange(HARMONICS + 1) / period
    series = np.fft.rfft(ends)[:, : HARMONICS + 1].real / GRID * np.exp(-2.0 * (np.pi * SMOOTH * HOLD * f) ** 2)
    return np.concatenate((series[:, :1], 2.0 * series[:, 1:]), axis=1)


def hold_design(design: Design) -> tuple[Design, Mask]:
    """Return a design problem for holds and slow sweeps, and a mask of joints without gravity load, shape (n,).

    Joints move slowly, only joints with payload torque at rest are to be identified, and rows of a joint at rest have
    no weight.

    Raises:
        ScenarioError: If the payload loads none of these joints at rest.
    """
    structure = design.structure
    q = np.random.default_rng(PROBE_SEED).uniform(-np.pi, np.pi, (64, structure.arm.n))
    still = np.zeros_like(q)
    columns = regressor(structure.arm, q, still, still)[:, :, structure.payload_columns]
    torque = np.abs(columns @ design.carried.chi).max(axis=0)
    unloaded = torque <= LEAST_LOAD * torque.max()
    wanted = design.joints[~unloaded[design.joints]]
    if not len(wanted):
        raise ScenarioError("at rest the payload puts no torque on any joint to identify; use --protocol motion")
    fast, slow = (np.where(structure.arm.revolute, *speeds) for speeds in (FAST, SLOW))
    speed = np.minimum(design.limits.velocity, fast / SHARES["speed"])
    limits = replace(design.limits, velocity=speed, torque_share=TORQUE_SHARE)
    prediction = partial(_weighted, design.prediction, slow)
    return replace(design, limits=limits, joints=wanted, prediction=prediction, searched_hz=SEARCHED_HZ), unloaded


def _weighted(
    prediction: Prediction, slow: Array, rows: MotionRows, structure: Structure
) -> Callable[[Carried], Deviations]:
    """Return the prediction with row weights by joint speed, 1/2 at `slow`, shape (n,)."""
    speed = rows.motion[1] ** 2
    share = np.maximum(speed / (speed + slow**2), STILL)
    W, Y, rigid = rows.W * share[:, :, None], rows.Y * share[:, :, None], rows.rigid * share
    return prediction(replace(rows, W=W, Y=Y, rigid=rigid), structure)


Searchable = Series | Holds
"""Parametrisation: `motion` of a point, `point` of a motion, and a random point `drawn` about a position."""
