"""The meaning of a log's columns: from its description, completed by its layout, which is recognised by its columns.

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
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TypeAlias

from ident.recordings.description import (
    ISO,
    MEANINGS,
    POSITION,
    TICKS,
    TIME,
    TORQUE_FROM_CURRENT,
    Channels,
    LogDescription,
)
from ident.recordings.formats.lerobot import CURRENT, INFO, STATE, DatasetInfo, Entries, read_info
from ident.recordings.formats.ros import EFFORT, STAMP
from ident.recordings.formats.ros import POSITION as ANGLE
from ident.recordings.formats.table import MOST_COLUMNS, OURS, entry, listed
from ident.support.errors import RecordingError
from ident.support.naming import nearest, one_line, shown

Layout: TypeAlias = Callable[[Path, Sequence[str], LogDescription], LogDescription | None]
"""Function of file name, column names and description that returns the description of undeclared columns.

Returns None for another layout. Raises `RecordingError` if the file has this layout but is not usable.
"""
OWN, UR, UR_TARGET, JOINT_STATES, LEROBOT = "own", "ur-rtde", "ur-rtde-target", "joint-states", "lerobot"
TAKEN = {
    UR: f"v is actual_current_0 .. [A], as measured; --layout {UR_TARGET} selects target_current",
    UR_TARGET: "v is target_current_0 .. [A], as commanded by the controller",
}
"""Notes on choices of a layout."""
UR_CURRENT = re.compile("(?:actual|target)_current_[0-5]")
MOST_JOINTS = 64
"""Largest number of joints of a recording."""
_TIME = re.compile(r"(?i)t[^a-z]|time|stamp|sec|elapsed|clock")
"""Beginnings of names of time columns."""


@dataclass(frozen=True, slots=True)
class Resolved:
    """Meaning of a file's columns.

    Attributes:
        description: Columns with their names in the file, one per joint; units; quantity of v, None for drive units.
        layout: Name of the recognised layout, None if everything was declared.
        t_unit: Declared unit of time; None if not declared, or for dates.
    """

    description: LogDescription
    layout: str | None
    t_unit: str | None

    @property
    def signal(self) -> str | None:
        """Quantity of v in the recording, a name of `MEANINGS`; None for drive units."""
        return "current" if self._divided else self.description.signal

    @property
    def v(self) -> str:
        """Quantity of v in the recording in words, with its unit."""
        if self._divided:
            return "current, from torque by the specified constants [A]"
        meaning = MEANINGS.get(self.description.signal or "")
        return f"{meaning.words} [{meaning.unit}]" if meaning else "as logged [drive units]"

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on the interpretation, one line each."""
        taken = TAKEN.get(self.layout or "", "") if all(map(UR_CURRENT.fullmatch, self.description.v.columns)) else ""
        meaning = MEANINGS.get(self.description.signal or "")
        divided = "v is the current: torque divided by the specified constants"
        return tuple(filter(None, (taken, divided if self._divided else meaning.note if meaning else "")))

    @property
    def _divided(self) -> bool:
        return self.description.signal == TORQUE_FROM_CURRENT and bool(self.description.v.constant)


def resolved(path: Path, names: Sequence[str], description: LogDescription) -> Resolved:
    """Determine the meaning of a file's columns.

    Raises:
        RecordingError: If the layout is unknown, a column is missing or ambiguous, or a declaration is missing.
    """
    place = one_line(path)
    if len(names) > MOST_COLUMNS:
        raise RecordingError(f"{place}: {len(names)} columns; files of up to {MOST_COLUMNS} are read")
    declared = [bool(getattr(description, kind).columns) for kind in "tqv"]
    layout, known = description.layout, LogDescription() if all(declared) else None
    if layout is not None:
        known = LAYOUTS[layout](path, names, description)
        if known is None:
            raise RecordingError(f"{place}: not of the layout {layout}; found {listed(names)}")
    for name, each in LAYOUTS.items() if known is None else ():
        known = each(path, names, description)
        if known is not None:
            layout = name
            break
    if known is None:
        known = LogDescription() if any(declared) else _own_columns(place, names, set("tqv"))  # raises
    t, q, v = (getattr(description, kind).over(getattr(known, kind)) for kind in "tqv")
    found = replace(
        description,
        signal=description.signal or (None if description.v.columns else known.signal),
        joints=description.joints or known.joints,
        t=replace(t, columns=_columns(place, names, t.columns, description.joints)),
        q=replace(q, columns=_columns(place, names, q.columns, description.joints)),
        v=replace(v, columns=_columns(place, names, v.columns, description.joints)),
    )
    if layout == JOINT_STATES and found.signal is not None and not found.v.unit and not description.v.columns:
        found = replace(found, v=replace(found.v, unit=(MEANINGS[found.signal].unit,)))  # by ROS's REP 103
    for name, _ in description.only:
        _column(place, names, name)
    plain = layout == OWN or (layout == LEROBOT and all(map(CURRENT.search, found.v.columns)))
    missing = list(_missing(found, plain=plain and not description.v.columns))
    if missing:
        raise RecordingError(f"{place}: {'; '.join(missing)}")
    _check(place, found)
    return Resolved(found, layout, next((unit for unit in description.t.unit if unit != ISO), None))


def _columns(place: str, names: Sequence[str], wanted: Sequence[str], joints: Sequence[str] | None) -> tuple[str, ...]:
    """Return names in the file for requested ones, with joint names inserted and columns of arrays expanded."""
    found: list[str] = []
    for name in wanted:
        if "{joint}" in name:
            if joints is None:
                raise RecordingError(
                    f"{place}: column {shown(name)}: the joints' names are unknown; give them (--joints, or --model)"
                )
            found += [_column(place, names, name.replace("{joint}", joint)) for joint in joints]
        elif name not in names and entry(name, 0) in names:
            entries = {entry(name, k) for k in range(len(names))}
            found += [each for each in names if each in entries]
        else:
            found.append(_column(place, names, name))
    return tuple(found)


def _column(place: str, names: Sequence[str], name: str) -> str:
    many = names.count(name)
    if many == 1:
        return name
    if many > 1:
        raise RecordingError(f"{place}: column {shown(name)} appears twice")
    ours = "; this log already has columns t, q1, v1, ..; convert only logs with other names"
    advice = f"{ours} (rx90 convert LOG --columns ..)" if {"t", "q1", "v1"} <= set(names) else ""
    raise RecordingError(f"{place}: no column {shown(name)}{nearest(name, names)}; found {listed(names)}{advice}")


def _missing(found: LogDescription, *, plain: bool) -> Iterator[str]:
    """Return all missing declarations together; the unit of v may be unknown if it is `plain` that it is a current."""
    unstated = found.signal is None and (bool(found.v.unit) or not plain)
    for kind, what in (("t", "time"), ("q", "positions"), ("v", "currents")):
        channels: Channels = getattr(found, kind)
        if not channels.columns:
            yield f"no column is declared for {what}: {kind}=NAME.. of --columns, or [{kind}] of a log description"
        elif not channels.unit and not (kind == "v" and found.signal is None and not unstated):
            yield (
                f"the unit of {what} is not declared: {kind}=NAME..[unit] of --columns, or unit of [{kind}] in a log "
                "description"
            )
    if unstated and found.v.columns:
        yield (
            f"the quantity in {listed(found.v.columns, 3)} is not declared; state it with --signal or in a log "
            f"description: {', '.join(MEANINGS)}"
        )


def _check(place: str, found: LogDescription) -> None:
    """Check quantity, units, and that all joints have all values."""
    t, q, v = found.t.columns, found.q.columns, found.v.columns
    meaning = MEANINGS.get(found.signal or "")
    if meaning and meaning.refused:
        raise RecordingError(f"{place}: v is {found.signal}: {meaning.refused}")
    for kind, known in (("t", TIME), ("q", POSITION), ("v", meaning.units if meaning else {})):
        for unit in getattr(found, kind).unit:
            if unit not in known:
                what = f"{kind}, {found.signal}," if kind == "v" else kind
                raise RecordingError(f"{place}: unit {shown(unit)} of {what} is unknown; known: {', '.join(known)}")
    if TICKS in found.q.unit and not found.q.counts_per_turn:
        raise RecordingError(
            f"{place}: positions are in ticks; state counts_per_turn, of the joint, in [q] of a log description"
        )
    if found.signal == TORQUE_FROM_CURRENT and found.v.constant is None:
        raise RecordingError(
            f"{place}: v is a torque from current; state the constants it was computed with, in N m/A "
            '(--constant, or constant of [v] in a log description), or "unknown"'
        )
    if found.v.constant is not None and found.signal != TORQUE_FROM_CURRENT:
        raise RecordingError(f"{place}: constants are given for v, but v is not a {TORQUE_FROM_CURRENT}")
    if len(t) != 1:
        raise RecordingError(f"{place}: time is one column, not {len(t)}")
    if len(q) != len(v):
        raise RecordingError(
            f"{place}: {len(q)} columns of positions ({listed(q, 3)}), {len(v)} of currents ({listed(v, 3)}); a joint "
            "has one of each"
        )
    if len(q) > MOST_JOINTS:
        raise RecordingError(f"{place}: {len(q)} joints; recordings of up to {MOST_JOINTS} are read")
    doubled = next((name for name in (*q, *v) if (*t, *q, *v).count(name) > 1), None)
    if doubled is not None:
        raise RecordingError(f"{place}: column {shown(doubled)} is declared twice")
    for kind, channels in (("q", found.q), ("v", found.v)):
        for key in ("unit", "counts_per_turn", "sign", "zero", "constant"):
            many = len(getattr(channels, key) or ())
            if many not in (0, 1, len(q)):
                raise RecordingError(f"{place}: {key} of {kind} has {many} entries for {len(q)} joints")


def _own(path: Path, names: Sequence[str], description: LogDescription) -> LogDescription | None:
    kinds = {name[0] for name in names if OURS.fullmatch(name)}
    wanted = {kind for kind in "tqv" if not getattr(description, kind).columns}
    if not kinds & wanted - {"t"} and not kinds >= wanted == {"t"}:
        return None
    return _own_columns(one_line(path), names, wanted)


def _own_columns(place: str, names: Sequence[str], wanted: set[str]) -> LogDescription:
    """Return the standard columns of some kinds; raises `RecordingError` if one is missing, duplicate or misspelt."""
    used = [name for name in names if OURS.fullmatch(name)]
    doubled = next((name for name in used if used.count(name) > 1), None)
    if doubled is not None:
        raise RecordingError(f"{place}: column {doubled} appears twice")
    for name in names:
        if name in ("q0", "v0"):
            raise RecordingError(
                f"{place}: column {name}: joints are numbered from 1; rename them q1, q2, .., v1, v2, .."
            )
        if name not in used and OURS.fullmatch(name.lower()) and name.lower() not in used:
            raise RecordingError(f"{place}: column {shown(name)}: names are lower case; rename it {name.lower()}")
    if not used:
        raise RecordingError(
            f"{place}: the file names no column t, q1.. or v1..; found {listed(names)}; declare the columns "
            "(--columns, --log-description)"
        )
    if "t" in wanted and "t" not in used:
        raise RecordingError(f"{place}: column t is missing{_likely_time(names)}; found {listed(used)}")
    numbers = {kind: sorted(int(name[1:]) for name in used if name[0] == kind) for kind in "qv" if kind in wanted}
    for kind, found in numbers.items():
        if not found:
            raise RecordingError(f"{place}: columns {kind}1, {kind}2, .. are missing; found {listed(used)}")
    if len(numbers) == 2 and numbers["q"] != numbers["v"]:
        first = min(set(numbers["q"]) ^ set(numbers["v"]))
        raise RecordingError(f"{place}: joint {first} has only one of the columns q{first} and v{first}")
    for kind, found in numbers.items():
        gap = next((j for j, number in enumerate(found, 1) if number != j), None)
        if gap is not None:
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
    return f"; is it {shown(likely)}? --columns 't={one_line(likely)}[{ending if ending in TIME else 'unit'}]'"


def _ur_rtde(current: str, path: Path, names: Sequence[str], description: LogDescription) -> LogDescription | None:
    q, v = (tuple(f"{name}_{j}" for j in range(6)) for name in ("actual_q", current))
    known = LogDescription(
        signal="current",
        t=Channels(columns=("timestamp",), unit=("s",)),
        q=Channels(columns=q, unit=("rad",)),
        v=Channels(columns=v, unit=("A",)),
    )
    needed = [getattr(known, kind).columns for kind in "tqv" if not getattr(description, kind).columns]
    return known if all(set(columns) <= set(names) for columns in needed) else None


def _joint_states(path: Path, names: Sequence[str], description: LogDescription) -> LogDescription | None:
    there, joints = [name.removesuffix(ANGLE) for name in names if name.endswith(ANGLE)], description.joints
    if STAMP not in names or not there:
        return None
    if joints is None:
        raise RecordingError(
            f"{one_line(path)}: the order of the joints is not declared; give it, base to flange (--joints, or "
            f"--model): there are {listed(there)}"
        )
    for joint in joints:
        _check_joint(path, joint, there)
        if joint + EFFORT not in names and not description.v.columns:
            raise RecordingError(f"{one_line(path)}: joint {shown(joint)} has no effort in these messages")
    q, v = (tuple(joint + ending for joint in joints) for ending in (ANGLE, EFFORT))
    return LogDescription(
        t=Channels(columns=(STAMP,), unit=("s",)), q=Channels(columns=q, unit=("rad",)), v=Channels(columns=v)
    )


def _check_joint(path: Path, joint: str, there: Sequence[str]) -> None:
    if joint not in there:
        raise RecordingError(
            f"{one_line(path)}: no joint {shown(joint)}{nearest(joint, there)}; there are {listed(there)}; give the "
            "log's joint names, base to flange (--joints)"
        )


def _lerobot(path: Path, names: Sequence[str], description: LogDescription) -> LogDescription | None:
    if not (path / INFO).is_file():
        return None
    info, place = read_info(path), one_line(path)
    positions: Entries = {k: v for each in info.entries(currents=False).values() for k, v in each.items()}
    if not positions and not description.q.columns:
        raise RecordingError(
            f"{place}: entries of {STATE} have no names of joints; declare which of them are positions and currents: "
            f"--columns 'q=NAME[{{0..5}}][unit]' 'v=..'; {_features(info)}"
        )
    joints = description.joints or tuple(positions)
    currents = {} if description.v.columns else _currents(place, info)
    q, v = list[tuple[str, str]](), list[tuple[str, str]]()
    for joint in joints if not (description.q.columns and description.v.columns) else ():
        if not description.q.columns:
            _check_joint(path, joint, list(positions))
            q.append(positions[joint])
        if not description.v.columns:
            if joint not in currents:
                raise RecordingError(
                    f"{place}: joint {shown(joint)} has no current; those that have one are "
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


def _currents(place: str, info: DatasetInfo) -> Entries:
    """Return the only kind of current of a dataset."""
    kinds = info.entries(currents=True)
    if not kinds:
        raise RecordingError(
            f"{place}: the dataset has no currents, which identification needs: no name ends in .current, .torque or "
            f".effort; {_features(info)}"
        )
    if len(kinds) > 1:
        raise RecordingError(
            f"{place}: several kinds of current: {listed(list(kinds))}; choose one, --columns 'v={next(iter(kinds))}', "
            "and name the joints (--joints, or --model)"
        )
    return next(iter(kinds.values()))


def _features(info: DatasetInfo) -> str:
    there = [f"{each.name} ({listed(each.names, 3)})" if each.names else each.name for each in info.features]
    return f"its features are {listed([*there, *info.others], 12)}"


LAYOUTS: dict[str, Layout] = {
    OWN: _own,
    UR: partial(_ur_rtde, "actual_current"),
    UR_TARGET: partial(_ur_rtde, "target_current"),
    JOINT_STATES: _joint_states,
    LEROBOT: _lerobot,
}
"""In the order in which they are tried."""
