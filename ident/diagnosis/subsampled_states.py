"""States of a motion at some samples: less accurate than decimation, and a hundred times as fast.

Currents are filtered, the regressor is not: from filtered positions at single samples, it lacks the effect of the
currents' filter on products and on friction steps; the latter are masked with the reversals.
"""

from dataclasses import dataclass

import numpy as np

from ident.numerics.signals import delayed, edge_samples, low_passed
from ident.observation.full_rate import filtered_motion
from ident.observation.observation import ObserveOptions
from ident.recordings.recording import Recording, resampled
from ident.support.arrays import Array, Mask

SLOW = 0.2
"""Speed below which a joint's sample is not used, as a share of its rms speed."""


@dataclass(frozen=True, slots=True, eq=False)
class SubsampledStates:
    """States of one motion at N samples.

    Attributes:
        q: Positions [rad], shape (N, n).
        dq: Velocities [rad/s], shape (N, n).
        ddq: Accelerations [rad/s^2], shape (N, n).
        v: Currents, low-passed [drive units], shape (N, n).
        moving: Mask of joints away from a reversal, shape (N, n).
    """

    q: Array
    dq: Array
    ddq: Array
    v: Array
    moving: Mask


def subsampled_states(recording: Recording, most: int, options: ObserveOptions) -> SubsampledStates:
    """Return states at samples distributed evenly over a recording.

    Args:
        recording: One motion, long enough for the filters.
        most: Largest number of samples; samples closer than `options.rows_per_second` would be redundant.
        options: Filters.
    """
    recording = resampled(recording)
    edge = edge_samples(recording.period, min(options.cutoff_hz, options.decimation_cutoff_hz))
    inner = slice(edge, len(recording.t) - edge)
    samples = inner.stop - inner.start
    step = max(1, -(-samples // most), round(1.0 / (recording.period * options.rows_per_second)))
    chosen = slice(inner.start, inner.stop, step)
    q, dq, ddq = filtered_motion(recording, options.cutoff_hz)
    v = delayed(recording.v, options.current_delay / recording.period)
    v = low_passed(v, recording.period, options.decimation_cutoff_hz)
    slow = SLOW * np.sqrt(np.mean(dq[inner] ** 2, axis=0))
    return SubsampledStates(q[chosen], dq[chosen], ddq[chosen], v[chosen], np.abs(dq[chosen]) > slow)
