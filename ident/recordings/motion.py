"""A motion: what was recorded, and what was mounted; several in the order of their clocks."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ident.payload.files import read_payload
from ident.payload.payload import Payload
from ident.recordings.files import read_unrepaired
from ident.recordings.formats.description import LogDescription
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


def read(
    path: str | Path, payload: str | Path | Payload | None = None, description: LogDescription | None = None
) -> Motion:
    """Read a motion, ready for `identify`, which repairs what needs no guess and refuses what is wrong with it.

    Args:
        path: The log, of any format of `formats.LOGS`.
        payload: What was mounted: a file of it, or what `read_payload` gave; None for a bare flange. Several motions
            of one mounting are given one `Payload`.
        description: What the log's columns are, where they are not ours or of a layout that is known.

    Raises:
        RecordingError: If the log is missing or unreadable, or is none.
        PayloadError: If the payload's file is missing, or describes none.
    """
    recording = read_unrepaired(path, description or LogDescription()).recording
    return Motion(recording, payload if payload is None or isinstance(payload, Payload) else read_payload(payload))


def in_order_of_time(motions: Sequence[Motion]) -> tuple[Motion, ...]:
    """Motions by the time of their first samples if all have absolute time, as they are given if not."""
    starts = [float(motion.recording.t[0]) for motion in motions]
    if not all(start >= ABSOLUTE for start in starts):
        return tuple(motions)
    return tuple(motion for _, motion in sorted(zip(starts, motions, strict=True), key=lambda each: each[0]))
