"""Known layouts of logs, recognised by their columns: the standard one and those of other systems; `LAYOUTS`.

own             `t`, `q1` .. `qn`, `v1` .. `vn` in seconds, radians or metres, and drive units
ur-rtde         Universal Robots' real-time data exchange, as its clients write it: `timestamp`, `actual_q_0`, ..;
                currents are those that were measured, `actual_current_0`, ..
ur-rtde-target  the same with commanded currents, selected by name or if measured ones are missing
joint-states    `sensor_msgs/JointState`: `stamp`, and `NAME.position`, `NAME.effort` of each joint, taken by name, as
                joints may be in any order in a message
lerobot         a dataset of LeRobot: `timestamp`, a position and a current of each joint by the names of features, in
                the order of the dataset or of the declared joints
"""

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeAlias

from ident.recordings.formats.columns import OURS, listed
from ident.recordings.formats.description import Channels, LogDescription
from ident.recordings.formats.lerobot_info import INFO, STATE, DatasetInfo, Entries, read_info
from ident.recordings.formats.meaning import TIME, TORQUE_FROM_CURRENT
from ident.support.errors import RecordingError
from ident.support.naming import nearest, one_line, shown

Layout: TypeAlias = Callable[[Path, Sequence[str], LogDescription], LogDescription | None]
"""Function of file name, column names and description that returns the description of undeclared columns.

Returns None for another layout. Raises `RecordingError` if the file has this layout but is not usable.
"""
OWN, UR, UR_TARGET, JOINT_STATES, LEROBOT = "own", "ur-rtde", "ur-rtde-target", "joint-states", "lerobot"
UR_JOINTS = 6
UR_CURRENT = re.compile("(?:actual|target)_current_[0-5]")
UR_COLUMNS = r"timestamp|(?:actual|target)_(?:q|current)_[0-5]"
"""Pattern of names that identify such a file."""
STAMP, POSITION, EFFORT = "stamp", ".position", ".effort"
_TIME = re.compile(r"(?i)t[^a-z]|time|stamp|sec|elapsed|clock")
"""Beginnings of names of time columns."""


def own(path: Path, names: Sequence[str], description: LogDescription) -> LogDescription | None:
    """Return the standard columns, unless others are declared.

    Raises:
        RecordingError: If such a column is missing, duplicate or misspelt.
    """
    kinds = {name[0] for name in names if OURS.fullmatch(name)}
    wanted = {kind for kind in "tqv" if not getattr(description, kind).columns}
    if not kinds & wanted - {"t"} and not kinds >= wanted == {"t"}:
        return None
    return own_columns(path, names, wanted)


def own_columns(path: Path, names: Sequence[str], wanted: set[str]) -> LogDescription:
    """Return the columns of some kinds of `t`, `q` and `v`.

    Raises:
        RecordingError: If one is missing, duplicate or misspelt.
    """
    used, place = used_columns(path, names), one_line(path)
    if "t" in wanted and "t" not in used:
        raise RecordingError(f"{place}: column t is missing{_likely_time(names)}; found {listed(used)}")
    numbers = {kind: _joint_numbers(place, used, kind) for kind in "qv" if kind in wanted}
    if len(numbers) == 2 and numbers["q"] != numbers["v"]:
        first = min(set(numbers["q"]) ^ set(numbers["v"]))
        raise RecordingError(f"{place}: joint {first} has only one of the columns q{first} and v{first}")
    for kind, found in numbers.items():
        if found != list(range(1, len(found) + 1)):
            gap = next(j for j in range(1, found[-1]) if j not in found)
            missing = f"columns q{gap} and v{gap} are" if len(numbers) == 2 else f"column {kind}{gap} is"
            raise RecordingError(f"{place}: {missing} missing; joints are numbered 1 to n")
    q, v = (tuple(f"{kind}{j}" for j in numbers.get(kind, ())) for kind in "qv")
    return LogDescription(
        t=Channels(columns=("t",), unit=("s",)), q=Channels(columns=q, unit=("rad",)), v=Channels(columns=v)
    )


def _likely_time(names: Sequence[str]) -> str:
    """Return advice on the time column."""
    likely = next((name for name in names if _TIME.match(name)), None)
    if likely is None:
        return "; declare it: --columns t=NAME[unit]"
    ending = re.split(r"[^a-z]+", likely.lower().rstrip("])"))[-1]
    unit = f"[{ending}]" if ending in TIME else "[unit]"
    return f"; is it {shown(likely)}? --columns 't={one_line(likely)}{unit}'"


def _joint_numbers(place: str, used: Sequence[str], kind: str) -> list[int]:
    numbers = sorted(int(name[1:]) for name in used if name[0] == kind)
    if not numbers:
        raise RecordingError(f"{place}: columns {kind}1, {kind}2, .. are missing; found {listed(used)}")
    return numbers


def used_columns(path: Path, header: Sequence[str]) -> list[str]:
    """Return the columns of a file that form a recording, in order.

    Raises:
        RecordingError: If a name is duplicate, counts joints from 0, or differs in case; or there are none.
    """
    used = [name for name in header if OURS.fullmatch(name)]
    if len(set(used)) < len(used):
        doubled = next(name for name in used if used.count(name) > 1)
        raise RecordingError(f"{one_line(path)}: column {doubled} appears twice")
    for name in header:
        if name in ("q0", "v0"):
            raise RecordingError(
                f"{one_line(path)}: column {name}: joints are numbered from 1; rename them q1, q2, .., v1, v2, .."
            )
        if name not in used and OURS.fullmatch(name.lower()) and name.lower() not in used:
            raise RecordingError(
                f"{one_line(path)}: column {shown(name)}: names are lower case; rename it {name.lower()}"
            )
    if not used:
        raise RecordingError(
            f"{one_line(path)}: the file names no column t, q1.. or v1..; found {listed(header)}; declare the columns "
            f"(--columns, --log-description)"
        )
    return used


def ur_rtde(current: str) -> Layout:
    """Return joints 0 to 5 with one of the currents [A] of such a log."""
    known = LogDescription(
        signal="current",
        t=Channels(columns=("timestamp",), unit=("s",)),
        q=Channels(columns=tuple(f"actual_q_{j}" for j in range(UR_JOINTS)), unit=("rad",)),
        v=Channels(columns=tuple(f"{current}_{j}" for j in range(UR_JOINTS)), unit=("A",)),
    )

    def layout(path: Path, names: Sequence[str], description: LogDescription) -> LogDescription | None:
        needed = [getattr(known, kind).columns for kind in "tqv" if not getattr(description, kind).columns]
        return known if all(set(columns) <= set(names) for columns in needed) else None

    return layout


def joint_states(path: Path, names: Sequence[str], description: LogDescription) -> LogDescription | None:
    """Return positions and efforts of the joints by name; the quantity of the effort must be declared.

    Raises:
        RecordingError: If the names of the arm's joints are unknown, or the log lacks one.
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
        _check_joint(path, joint, there)
        if joint + EFFORT not in names and not description.v.columns:
            raise RecordingError(f"{one_line(path)}: joint {shown(joint)} has no effort in these messages")
    return LogDescription(
        t=Channels(columns=(STAMP,), unit=("s",)),
        q=Channels(columns=tuple(joint + POSITION for joint in joints), unit=("rad",)),
        v=Channels(columns=tuple(joint + EFFORT for joint in joints)),
    )


def _check_joint(path: Path, joint: str, there: Sequence[str]) -> None:
    if joint not in there:
        raise RecordingError(
            f"{one_line(path)}: no joint {shown(joint)}{nearest(joint, there)}; there are "
            f"{listed(there)}; give the log's joint names, base to flange (--joints)"
        )


def lerobot(path: Path, names: Sequence[str], description: LogDescription) -> LogDescription | None:
    """Return positions and currents of the joints of a dataset by feature names, unless others are declared.

    Raises:
        RecordingError: If it has no positions, no currents or several kinds of current, or lacks a joint.
    """
    if not (path / INFO).is_file():
        return None
    info = read_info(path)
    positions = info.positions()
    if not positions and not description.q.columns:
        raise RecordingError(
            f"{one_line(path)}: entries of {STATE} have no names of joints; declare which of them are positions and "
            f"currents: --columns 'q=NAME[{{0..5}}][unit]' 'v=..'; {_features(info)}"
        )
    joints = description.joints or tuple(positions)
    currents = {} if description.v.columns else _currents(path, info)
    q, v = list[tuple[str, str]](), list[tuple[str, str]]()
    for joint in joints if not (description.q.columns and description.v.columns) else ():
        if not description.q.columns:
            _check_joint(path, joint, list(positions))
            q.append(positions[joint])
        if not description.v.columns:
            if joint not in currents:
                raise RecordingError(
                    f"{one_line(path)}: joint {shown(joint)} has no current; those that have one are "
                    f"{listed(list(currents))}; name the others (--joints)"
                )
            v.append(currents[joint])
    signal = description.signal or info.signal
    own_constant = () if info.signal == TORQUE_FROM_CURRENT == signal else None
    return LogDescription(
        signal=info.signal,
        joints=joints,
        t=Channels(columns=("timestamp",), unit=("s",)),
        q=_channels(q, None),
        v=_channels(v, own_constant),
    )


def _channels(entries: Sequence[tuple[str, str]], constant: tuple[float, ...] | None) -> Channels:
    units = tuple(unit for _, unit in entries)
    return Channels(columns=tuple(column for column, _ in entries), unit=units if all(units) else (), constant=constant)


def _currents(path: Path, info: DatasetInfo) -> Entries:
    """Return the only kind of current of a dataset."""
    kinds = info.currents()
    if not kinds:
        raise RecordingError(
            f"{one_line(path)}: the dataset has no currents, which identification needs: no name ends in "
            f".current, .torque or .effort; {_features(info)}"
        )
    if len(kinds) > 1:
        raise RecordingError(
            f"{one_line(path)}: several kinds of current: {listed(list(kinds))}; choose one, --columns "
            f"'v={next(iter(kinds))}', and name the joints (--joints, or --model)"
        )
    return next(iter(kinds.values()))


def _features(info: DatasetInfo) -> str:
    there = [f"{each.name} ({listed(each.names, 3)})" if each.names else each.name for each in info.features]
    return f"its features are {listed([*there, *info.others], 12)}"


LAYOUTS: dict[str, Layout] = {
    OWN: own,
    UR: ur_rtde("actual_current"),
    UR_TARGET: ur_rtde("target_current"),
    JOINT_STATES: joint_states,
    LEROBOT: lerobot,
}
"""In the order in which they are tried."""
