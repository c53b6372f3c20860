"""What a motion is at some instants: coarser than decimation, and a hundred times as fast.

Currents are filtered, the regressor is not: taken of filtered positions at single instants, it lacks what the filter of
the currents does to products and to the steps of friction, which are left out with the reversals.
"""

from dataclasses import dataclass

import numpy as np

from ident.numerics.signals import delayed, edge_samples, low_passed
from ident.observation.full_rate import filtered_motion
from ident.observation.observation import ObserveOptions
from ident.recordings.recording import Recording, resampled
from ident.support.arrays import Array, Mask

SLOW = 0.2
"""Speed below which an instant of a joint tells nothing sure of it, as a share of its rms speed."""


@dataclass(frozen=True, slots=True, eq=False)
class SubsampledStates:
    """What a log says of some instants of one motion, N of them.

    Attributes:
        q: Positions [rad], shape (N, n).
        dq: Velocities [rad/s], shape (N, n).
        ddq: Accelerations [rad/s^2], shape (N, n).
        v: Currents, low-passed [drive units], shape (N, n).
        moving: Which joints are away from a reversal, shape (N, n).
    """

    q: Array
    dq: Array
    ddq: Array
    v: Array
    moving: Mask


def subsampled_states(recording: Recording, most: int, options: ObserveOptions) -> SubsampledStates:
    """Look at a recording at instants spread evenly over it.

    Args:
        recording: One motion, long enough for the filters.
        most: Number of instants at most; closer ones than `options.rows_per_second` would repeat each other.
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
