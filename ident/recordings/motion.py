"""Motions: recordings with payloads, and their order in time."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ident.payload.payload import Payload, read_payload
from ident.recordings.description import LogDescription
from ident.recordings.files import read_unrepaired
from ident.recordings.recording import Recording

ABSOLUTE = 1e8
"""Smallest time stamp [s] of an absolute clock, from 1970; three years for a clock that starts with its motion."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A recording and its payload.

    Attributes:
        recording: Recording of one motion.
        payload: The specified payload, None for a bare flange. Recordings of one mounting share one object, and thus
            its unknown parameters.
    """

    recording: Recording
    payload: Payload | None = None


def read(
    path: str | Path, payload: str | Path | Payload | None = None, description: LogDescription | None = None
) -> Motion:
    """Read a motion for `identify`, which makes unambiguous repairs and refuses faults.

    Args:
        path: The log, of any format of `formats.LOGS`.
        payload: Payload file, or result of `read_payload`; None for a bare flange. Use one `Payload` object for all
            motions of one mounting.
        description: Description of the log's columns, unless they have standard names or a known layout.

    Raises:
        RecordingError: If the log is missing, unreadable or not valid.
        PayloadError: If the payload file is missing or not valid.
    """
    recording = read_unrepaired(path, description).recording
    return Motion(recording, payload if payload is None or isinstance(payload, Payload) else read_payload(payload))


def in_order_of_time(motions: Sequence[Motion]) -> tuple[Motion, ...]:
    """Return motions sorted by their first samples if all have absolute time, otherwise in the given order."""
    absolute = all(motion.recording.t[0] >= ABSOLUTE for motion in motions)
    return tuple(sorted(motions, key=lambda motion: motion.recording.t[0]) if absolute else motions)
