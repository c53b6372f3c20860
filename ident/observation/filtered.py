"""The filtered motion of a recording, found once for the checks and the observation that ask for it."""

from functools import lru_cache

from ident.numerics.signals import smooth_motion
from ident.recordings.recording import Recording
from ident.support.arrays import Array

KEPT = 4
"""Recordings whose motion is kept: those that are looked at together."""


@lru_cache(maxsize=KEPT)
def filtered_motion(recording: Recording, cutoff_hz: float) -> tuple[Array, Array, Array]:
    """Positions, velocities and accelerations as `smooth_motion` gives them, read-only, each of shape (N, n).

    Args:
        recording: On a uniform clock.
        cutoff_hz: Cut-off frequency [Hz].
    """
    found = smooth_motion(recording.q, recording.period, cutoff_hz)
    for each in found:
        each.flags.writeable = False
    return found
