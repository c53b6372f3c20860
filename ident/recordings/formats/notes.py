"""What one should know of how a log was read."""

from ident.recordings.formats import ur_rtde
from ident.recordings.formats.meaning import MEANINGS, TORQUE_FROM_CURRENT
from ident.recordings.formats.resolution import Resolved

TAKEN = {
    ur_rtde.NAME: f"v is actual_current_0 .. [A], as measured; --layout {ur_rtde.TARGET} takes target_current",
    ur_rtde.TARGET: "v is target_current_0 .. [A], as the controller asked for",
}
"""Where a layout had a choice."""


def notes_of(read: Resolved) -> tuple[str, ...]:
    """Notes on a log, one line each.

    Args:
        read: What was taken for what.
    """
    description = read.description
    taken = TAKEN.get(read.layout or "", "") if ur_rtde.taken(description.v.columns) else ""
    return tuple(note for note in (taken, _meaning_note(read)) if note)


def signal_of(read: Resolved) -> str:
    """What v of the recording is, with its unit."""
    description = read.description
    if description.signal is None:
        return "as logged [drive units]"
    if description.signal == TORQUE_FROM_CURRENT and description.v.constant:
        return "current, from torque by the constants stated [A]"
    return f"{MEANINGS[description.signal].words} [{MEANINGS[description.signal].unit}]"


def _meaning_note(read: Resolved) -> str:
    description = read.description
    if description.signal is None:
        return ""
    if description.signal == TORQUE_FROM_CURRENT and description.v.constant:
        return "v is the current: torque divided by the stated constants"
    return MEANINGS[description.signal].note
