"""A motion: what was recorded, and what was mounted; several in the order of their clocks."""

from collections.abc import Sequence
from dataclasses import dataclass

from ident.payload.payload import Payload
from ident.recordings.recording import Recording

ABSOLUTE = 1e8
"""Time stamps [s] from which a clock counts from 1970; one that starts with its motion would have run three years."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A recording, and what was mounted.

    Attributes:
        recording: One motion.
        payload: As weighed and drawn, None for a bare flange. Recordings of one mounting share one object: whatever of
            the payload is not known is the same for all of them.
    """

    recording: Recording
    payload: Payload | None = None


def in_order_of_time(motions: Sequence[Motion]) -> tuple[Motion, ...]:
    """Motions by the time of their first samples if all have absolute time, as they are given if not."""
    starts = [float(motion.recording.t[0]) for motion in motions]
    if not all(start >= ABSOLUTE for start in starts):
        return tuple(motions)
    return tuple(motion for _, motion in sorted(zip(starts, motions, strict=True), key=lambda each: each[0]))
