"""The motion behind a linear system at full rate, for columns that no linear combination of its own gives."""

from dataclasses import dataclass

import numpy as np

from ident.numerics.signals import Decimator, group_means
from ident.recordings.recording import Recording
from ident.support.arrays import Array, Mask


@dataclass(frozen=True, slots=True, eq=False)
class FullRate:
    """Filtered samples of a motion, and how they become rows.

    Attributes:
        q: Joint positions [rad or m], shape (N, n).
        dq: Joint velocities, shape (N, n).
        ddq: Joint accelerations, shape (N, n).
        moving: Samples at which each joint is away from reversal, shape (N, n).
        period: Time from one sample to the next [s].
        cutoff_hz: Low-pass of the positions [Hz].
        decimator: What makes rows of samples.
        edge: Samples of the recording that are left out at either end.
        group: Samples of the recording that one sample here is the mean of.
        noise: Density of white noise in the recorded positions [rad^2/Hz or m^2/Hz], shape (n,).
        recording: What was filtered, on a uniform clock.
        current_delay: Time from the stamp of its currents to the middle of their action [s].
    """

    q: Array
    dq: Array
    ddq: Array
    moving: Mask
    period: float
    cutoff_hz: float
    decimator: Decimator
    edge: int
    group: int
    noise: Array
    recording: Recording
    current_delay: float

    def sampled(self, x: Array) -> Array:
        """A signal at the rate of the recording as the samples here have it, shape (N, ...)."""
        return group_means(x[self.edge : max(self.edge, len(x) - self.edge)], self.group)

    def spread(self, row_weights: Array, joint: int, samples: int) -> Array:
        """Weights of a recording's samples in a weighted sum of a joint's rows: `decimated` of `sampled`, transposed.

        Args:
            row_weights: Shape (rows,).
            joint: The joint, from 0.
            samples: Of the recording.

        Returns:
            Shape (samples,).
        """
        felt = self.decimator.spread(row_weights)
        here = np.zeros(len(self.q))
        here[: len(felt)] = felt
        weights = np.zeros(samples)
        inner = np.repeat(np.where(self.moving[:, joint], here, 0.0) / self.group, self.group)
        weights[self.edge : self.edge + len(inner)] = inner
        return weights

    def decimated(self, x: Array, joint: int) -> Array:
        """A signal of a joint, cleared of reversals and decimated like its current, shape (rows,).

        Args:
            x: Signal at full rate, shape (N,).
            joint: The joint, from 0.
        """
        return self.decimator.applied(np.where(self.moving[:, joint], x, 0.0))
