"""The motion behind a linear system at full rate, for columns that no linear combination of its own gives."""

from dataclasses import dataclass

import numpy as np

from ident.arrays import Array, Mask
from ident.signals import Decimator


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
    """

    q: Array
    dq: Array
    ddq: Array
    moving: Mask
    period: float
    cutoff_hz: float
    decimator: Decimator

    def decimated(self, x: Array, joint: int) -> Array:
        """A signal of a joint, cleared of reversals and decimated like its current, shape (rows,).

        Args:
            x: Signal at full rate, shape (N,).
            joint: The joint, from 0.
        """
        kernel, factor = self.decimator.kernel, self.decimator.factor
        kept = np.where(self.moving[:, joint], x, 0.0)
        return np.lib.stride_tricks.sliding_window_view(kept, len(kernel))[::factor] @ kernel
