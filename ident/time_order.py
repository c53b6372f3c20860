"""The order of motions in time, from their clocks."""

from collections.abc import Sequence

from ident.identification import Recorded

ABSOLUTE = 1e8
"""Time stamps [s] from which a clock counts from 1970; one that starts with its motion would have run three years."""


def in_order_of_time(motions: Sequence[Recorded]) -> tuple[Recorded, ...]:
    """Motions by the time of their first samples if all have absolute time, as they are given if not."""
    starts = [float(motion.recording.t[0]) for motion in motions]
    if not all(start >= ABSOLUTE for start in starts):
        return tuple(motions)
    return tuple(motion for _, motion in sorted(zip(starts, motions, strict=True), key=lambda each: each[0]))
