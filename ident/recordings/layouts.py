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
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ident.recordings.description import (
    FIXED,
    JOINT_STATES,
    LAYOUTS,
    LEROBOT,
    MEANINGS,
    OWN,
    POSITION,
    TICKS,
    TIME,
    TORQUE_FROM_CURRENT,
    UR,
    UR_TARGET,
    Channels,
    LogDescription,
    described,
)
from ident.recordings.formats import MOST_COLUMNS, OURS, check_joint, entry, listed
from ident.recordings.formats.lerobot import CURRENT, INFO, dataset_layout
from ident.recordings.formats.ros import EFFORT, STAMP
from ident.recordings.formats.ros import POSITION as ANGLE
from ident.support.errors import RecordingError
from ident.support.naming import nearest, one_line, shown

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


def resolved(path: Path, names: Sequence[str], given: LogDescription) -> tuple[LogDescription, str | None]:
    """Determine the meaning of a file's columns.

    Returns:
        Columns with their names in the file, one per joint; the layout, None if everything was declared.

    Raises:
        RecordingError: If the layout is unknown, a column is missing or ambiguous, or a declaration is missing.
    """
    place, declared = one_line(path), {kind for kind in "tqv" if getattr(given, kind).columns}
    if len(names) > MOST_COLUMNS:
        raise RecordingError(f"{place}: {len(names)} columns; files of up to {MOST_COLUMNS} are read")
    layout, known = given.layout, LogDescription()
    if layout or len(declared) < 3:
        tried = ((name, _known(name, path, names, given)) for name in ([layout] if layout else LAYOUTS))
        layout, found = next(((name, each) for name, each in tried if each is not None), (layout, None))
        if found is None and layout:
            raise RecordingError(f"{place}: not of the layout {layout}; found {listed(names)}")
        known = found or known
        if not found and not declared:
            _own(place, names, set("tqv"))  # raises
    meant = replace(
        given,
        signal=given.signal or (None if "v" in declared else known.signal),
        joints=given.joints or known.joints,
        **{kind: _named(place, names, getattr(given, kind).over(getattr(known, kind)), given.joints) for kind in "tqv"},
    )
    for name, _ in given.only:
        _column(place, names, name)
    is_current = layout == OWN or (layout == LEROBOT and all(map(CURRENT.search, meant.v.columns)))
    unstated = meant.signal is None and (bool(meant.v.unit) or not is_current or "v" in declared)
    missing: list[str] = []
    for kind, what in (("t", "time"), ("q", "positions"), ("v", "currents")):
        channels: Channels = getattr(meant, kind)
        if not channels.columns:
            missing.append(
                f"no column is declared for {what}: {kind}=NAME.. of --columns, or [{kind}] of a log description"
            )
        elif not channels.unit and (kind != "v" or meant.signal or unstated):
            missing.append(
                f"the unit of {what} is not declared: {kind}=NAME..[unit] of --columns, or unit of [{kind}] in a log "
                "description"
            )
    if unstated and meant.v.columns:
        missing.append(
            f"the quantity in {listed(meant.v.columns, 3)} is not declared; state it with --signal or in a log "
            f"description: {', '.join(MEANINGS)}"
        )
    _refuse(place, ("; ".join(missing), "; ".join(missing)))
    _check(place, meant)
    return meant, layout


def _refuse(place: str, *faults: tuple[object, str]) -> None:
    """Refuse a file for the first fault that it has."""
    for fault, sentence in faults:
        if fault:
            raise RecordingError(f"{place}: {sentence}")


def _named(place: str, names: Sequence[str], channels: Channels, joints: Sequence[str] | None) -> Channels:
    """Return channels with names in the file: joint names are inserted, columns of arrays expanded."""
    found: list[str] = []
    for name in channels.columns:
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
    return replace(channels, columns=tuple(found))


def _column(place: str, names: Sequence[str], name: str) -> str:
    many = names.count(name)
    if many == 1:
        return name
    if many > 1:
        raise RecordingError(f"{place}: column {shown(name)} appears twice")
    ours = "; this log already has columns t, q1, v1, ..; convert only logs with other names"
    advice = f"{ours} (rx90 convert LOG --columns ..)" if {"t", "q1", "v1"} <= set(names) else ""
    raise RecordingError(f"{place}: no column {shown(name)}{nearest(name, names)}; found {listed(names)}{advice}")


def _check(place: str, meant: LogDescription) -> None:
    """Check quantity, units, and that all joints have all values."""
    t, q, v = meant.t.columns, meant.q.columns, meant.v.columns
    meaning = MEANINGS.get(meant.signal or "")
    units = {"t": TIME, "q": POSITION, "v": meaning.units if meaning else {}}
    unknown = next(
        ((kind, unit) for kind, known in units.items() for unit in getattr(meant, kind).unit if unit not in known), None
    )
    kind, unit = unknown or ("t", "")
    what = f"{kind}, {meant.signal}," if kind == "v" else kind
    doubled = next((name for name in (*q, *v) if (*t, *q, *v).count(name) > 1), None)
    computed = meant.signal == TORQUE_FROM_CURRENT
    _refuse(
        place,
        (meaning and meaning.refused, f"v is {meant.signal}: {meaning.refused if meaning else ''}"),
        (unknown, f"unit {shown(unit)} of {what} is unknown; known: {', '.join(units[kind])}"),
        (
            TICKS in meant.q.unit and not meant.q.counts_per_turn,
            "positions are in ticks; state counts_per_turn, of the joint, in [q] of a log description",
        ),
        (
            computed and meant.v.constant is None,
            "v is a torque from current; state the constants it was computed with, in N m/A (--constant, or constant "
            'of [v] in a log description), or "unknown"',
        ),
        (
            not computed and meant.v.constant is not None,
            f"constants are given for v, but v is not a {TORQUE_FROM_CURRENT}",
        ),
        (len(t) != 1, f"time is one column, not {len(t)}"),
        (
            len(q) != len(v),
            f"{len(q)} columns of positions ({listed(q, 3)}), {len(v)} of currents ({listed(v, 3)}); a joint has one "
            "of each",
        ),
        (len(q) > MOST_JOINTS, f"{len(q)} joints; recordings of up to {MOST_JOINTS} are read"),
        (doubled, f"column {shown(doubled)} is declared twice"),
    )
    for kind, channels in (("q", meant.q), ("v", meant.v)):
        for key in ("unit", "counts_per_turn", "sign", "zero", "constant"):
            many = len(getattr(channels, key) or ())
            _refuse(place, (many not in (0, 1, len(q)), f"{key} of {kind} has {many} entries for {len(q)} joints"))


def _known(layout: str, path: Path, names: Sequence[str], given: LogDescription) -> LogDescription | None:
    """Return what a layout says of columns that are not declared, None for a file of another layout."""
    place, wanted = one_line(path), {kind for kind in "tqv" if not getattr(given, kind).columns}
    if layout == OWN:
        kinds = {name[0] for name in names if OURS.fullmatch(name)}
        is_own = kinds & wanted - {"t"} or (wanted == {"t"} and "t" in kinds)
        return _own(place, names, wanted) if is_own else None
    if layout == LEROBOT:
        return dataset_layout(path, given) if (path / INFO).is_file() else None
    if layout == JOINT_STATES:
        there = [name.removesuffix(ANGLE) for name in names if name.endswith(ANGLE)]
        if STAMP not in names or not there:
            return None
        if given.joints is None:
            raise RecordingError(
                f"{place}: the order of the joints is not declared; give it, base to flange (--joints, or --model): "
                f"there are {listed(there)}"
            )
        for joint in given.joints:
            check_joint(place, joint, there)
            if joint + EFFORT not in names and "v" in wanted:
                raise RecordingError(f"{place}: joint {shown(joint)} has no effort in these messages")
        q, v = ([joint + ending for joint in given.joints] for ending in (ANGLE, EFFORT))
        unit = (MEANINGS[given.signal].unit,) if given.signal else ()  # by ROS's REP 103
        return _columns_of(STAMP, q, v, unit)
    signal, *words = FIXED[layout]
    known = replace(described(words), signal=signal)
    return known if all(set(getattr(known, kind).columns) <= set(names) for kind in wanted) else None


def _own(place: str, names: Sequence[str], wanted: set[str]) -> LogDescription:
    """Return the standard columns of some kinds; raises `RecordingError` if one is missing, duplicate or misspelt."""
    used = [name for name in names if OURS.fullmatch(name)]
    doubled = next((name for name in used if used.count(name) > 1), None)
    zero = next((name for name in names if name in ("q0", "v0")), None)
    capital = next((x for x in names if x not in used and OURS.fullmatch(x.lower()) and x.lower() not in used), "")
    timing = next((name for name in names if _TIME.match(name)), None)
    ending = re.split(r"[^a-z]+", timing.lower().rstrip("])"))[-1] if timing else ""
    unit = ending if ending in TIME else "unit"
    likely = f"is it {shown(timing)}? --columns 't={one_line(timing)}[{unit}]'"
    numbers = {kind: sorted(int(name[1:]) for name in used if name[0] == kind) for kind in "qv" if kind in wanted}
    lacking = next((kind for kind, found in numbers.items() if not found), None)
    single = min(set(numbers["q"]) ^ set(numbers["v"]), default=None) if len(numbers) == 2 else None
    gaps = ((kind, j) for kind, found in numbers.items() for j, number in enumerate(found, 1) if number != j)
    gap, number = next(gaps, (None, 0))
    missing = f"columns q{number} and v{number} are" if len(numbers) == 2 else f"column {gap}{number} is"
    _refuse(
        place,
        (doubled, f"column {doubled} appears twice"),
        (zero, f"column {zero}: joints are numbered from 1; rename them q1, q2, .., v1, v2, .."),
        (capital, f"column {shown(capital)}: names are lower case; rename it {capital.lower()}"),
        (
            not used,
            f"the file names no column t, q1.. or v1..; found {listed(names)}; declare the columns (--columns, "
            "--log-description)",
        ),
        (
            "t" in wanted and "t" not in used,
            f"column t is missing; {likely if timing else 'declare it: --columns t=NAME[unit]'}; found {listed(used)}",
        ),
        (lacking, f"columns {lacking}1, {lacking}2, .. are missing; found {listed(used)}"),
        (single, f"joint {single} has only one of the columns q{single} and v{single}"),
        (gap, f"{missing} missing; joints are numbered 1 to n"),
    )
    q, v = ([f"{kind}{j}" for j in numbers.get(kind, ())] for kind in "qv")
    return _columns_of("t", q, v, ())


def _columns_of(t: str, q: Sequence[str], v: Sequence[str], unit: tuple[str, ...]) -> LogDescription:
    return LogDescription(
        t=Channels(columns=(t,), unit=("s",)),
        q=Channels(columns=tuple(q), unit=("rad",)),
        v=Channels(columns=tuple(v), unit=unit),
    )
