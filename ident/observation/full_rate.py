"""The motion of a linear system at full rate, for columns that are not linear combinations of its own."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from ident.model.displacement import States
from ident.numerics.signals import SHARE_OF_RATE, Decimator, group_means, smooth_motion
from ident.recordings.recording import Recording
from ident.support.arrays import Array, Indices, Mask

TORQUE_RATE = 8.0
"""Rate at which torques are evaluated, in multiples of the position cut-off; splines interpolate."""
DATED = 0.1
"""Noise of the speeds that locate reversals in time, as a share of each joint's rms speed; rows omit as much."""
SHARPEST = 10.0
"""Highest cut-off of these speeds, in multiples of the position cut-off: it locates reversals ten times as
accurately."""


@dataclass(frozen=True, eq=False)
class FullRate:
    """Filtered samples of a motion, and their conversion to rows."""

    q: Array  # joint positions [rad or m], shape (N, n)
    dq: Array  # joint velocities, shape (N, n)
    ddq: Array  # joint accelerations, shape (N, n)
    moving: Mask  # mask of the samples at which each joint is away from reversals, shape (N, n)
    period: float  # time from one sample to the next [s]
    cutoff_hz: float  # low-pass of the positions [Hz]
    decimator: Decimator  # filter that converts samples to rows
    edge: int  # number of samples of the recording that are omitted at each end
    group: int  # number of samples of the recording that are averaged to one sample here
    noise: Array  # density of white noise in the recorded positions [rad^2/Hz or m^2/Hz], shape (n,)
    recording: Recording  # the filtered recording, on a uniform clock
    current_delay: float  # time from the stamp of its currents to the middle of their action [s]

    @cached_property
    def t(self) -> Array:
        """Time from the first sample [s], shape (N,)."""
        return np.asarray(self.period * np.arange(len(self.q)), np.float64)

    @cached_property
    def at(self) -> Indices:
        """Indices of the samples at which torques are evaluated, shape (S,)."""
        stride = max(1, int(1.0 / (TORQUE_RATE * self.cutoff_hz * self.period)))
        return np.append(np.arange(0, len(self.q) - 1, stride), len(self.q) - 1)

    @cached_property
    def states(self) -> States:
        """The motion at these samples."""
        return States(self.q[self.at], self.dq[self.at], self.ddq[self.at])

    @cached_property
    def dating(self) -> Array:
        """Speeds that locate reversals, at the rate of the recording, shape (samples, n).

        White noise of density N in positions gives them a variance of (2 pi)^2 N f^3 / 3 below the cut-off f.
        """
        allowed = 3.0 * DATED**2 * np.mean(self.dq**2, axis=0)
        noise = (2.0 * np.pi) ** 2 * self.noise
        quiet = float(np.min(np.cbrt(np.divide(allowed, noise, out=np.full_like(noise, np.inf), where=noise > 0.0))))
        highest = min(SHARPEST * self.cutoff_hz, SHARE_OF_RATE / self.recording.period)
        cutoff_hz = max(self.cutoff_hz, min(quiet, highest))
        return smooth_motion(self.recording.q, self.recording.period, cutoff_hz)[1]

    def sampled(self, x: Array) -> Array:
        """Convert a signal from the rate of the recording to the samples here, shape (N, ...)."""
        return group_means(x[self.edge : max(self.edge, len(x) - self.edge)], self.group)

    def spread(self, row_weights: Array, joint: int, samples: int) -> Array:
        """Weights of a recording's samples, shape (samples,), in a sum of a joint's rows with weights of shape (rows,).

        This is `sampled`, cleared of reversals and decimated, transposed; the joint is from 0.
        """
        of_samples = self.decimator.spread(row_weights)
        here = np.zeros(len(self.q))
        here[: len(of_samples)] = of_samples
        weights = np.zeros(samples)
        inner = np.repeat(np.where(self.moving[:, joint], here, 0.0) / self.group, self.group)
        weights[self.edge : self.edge + len(inner)] = inner
        return weights


@lru_cache(maxsize=2)  # of the logs that are used last
def filtered_motion(recording: Recording, cutoff_hz: float) -> tuple[Array, Array, Array]:
    """Return positions, velocities and accelerations of `smooth_motion`, read-only, each of shape (N, n)."""
    found = smooth_motion(recording.q, recording.period, cutoff_hz)
    for each in found:
        each.flags.writeable = False
    return found
