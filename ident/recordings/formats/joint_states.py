"""Columns of `sensor_msgs/JointState` messages: `stamp`, and `NAME.position`, `NAME.effort` of each joint.

Joints stand in a message in whatever order its publisher has, so that they are taken by name alone.
"""

from collections.abc import Sequence
from pathlib import Path

from ident.recordings.formats.columns import listed
from ident.recordings.formats.description import Channels, LogDescription
from ident.support.errors import RecordingError
from ident.support.naming import nearest, one_line, shown

NAME = "joint-states"
STAMP, POSITION, EFFORT = "stamp", ".position", ".effort"


def layout(path: Path, names: Sequence[str], description: LogDescription) -> LogDescription | None:
    """Positions and efforts of the joints by their names; what an effort is has to be said.

    Raises:
        RecordingError: If the names of the arm's joints are not known, or the log lacks one.
    """
    there = [name.removesuffix(POSITION) for name in names if name.endswith(POSITION)]
    if STAMP not in names or not there:
        return None
    joints = description.joints
    if joints is None:
        raise RecordingError(
            f"{one_line(path)}: the order of the joints is not declared; give it, base to flange "
            f"(--joints, or --model): there are {listed(there)}"
        )
    for joint in joints:
        if joint not in there:
            raise RecordingError(
                f"{one_line(path)}: no joint {shown(joint)}{nearest(joint, there)}; there are "
                f"{listed(there)}; give the log's joint names, base to flange (--joints)"
            )
        if joint + EFFORT not in names and not description.v.columns:
            raise RecordingError(f"{one_line(path)}: joint {shown(joint)} has no effort in these messages")
    return LogDescription(
        t=Channels(columns=(STAMP,), unit=("s",)),
        q=Channels(columns=tuple(joint + POSITION for joint in joints), unit=("rad",)),
        v=Channels(columns=tuple(joint + EFFORT for joint in joints)),
    )
