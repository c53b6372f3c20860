"""The meaning of a log's columns: from its description, completed by its layout, which is recognised by its columns.

Layouts are those of `description.FIXED`, and those of formats that name joints, which may be in any order there.
"""

import re
from collections.abc import Sequence, Set
from dataclasses import replace

from ident.recordings.description import (
    FIXED,
    ISO,
    JOINT_STATES,
    LAYOUTS,
    LEROBOT,
    MEANINGS,
    OWN,
    POSITION,
    TICKS,
    TIME,
    TORQUE_FROM_CURRENT,
    Channel,
    Channels,
    LogDescription,
    described,
)
from ident.recordings.formats import MOST_COLUMNS, OURS, Table, entry, listed
from ident.support.errors import RecordingError
from ident.support.naming import nearest, one_line, shown

CURRENT = re.compile(r"^observation\.current\.|\.current$")
"""Name of a column of currents, not torques, of a dataset of LeRobot."""


def resolved(table: Table, given: LogDescription) -> tuple[LogDescription, str | None]:
    """Determine the meaning of a table's columns; `given` is what is declared of them.

    Returned are columns with their names in the file, units, signs and zeros, one of each per joint; and the layout,
    None if everything was declared. Raises `RecordingError` if a column or a declaration is missing or ambiguous.
    """
    names, wanted = table.names, {kind for kind in "tqv" if not getattr(given, kind).columns}
    if len(names) > MOST_COLUMNS:
        raise RecordingError(f"{len(names)} columns; files of up to {MOST_COLUMNS} are read")
    layout, known = given.layout, None
    for each in (layout,) if layout else LAYOUTS if wanted else ():
        known = _known(each, table, given, wanted)
        if known:
            layout = each
            break
    if known is None and layout:
        raise RecordingError(f"not of the layout {layout}; found {listed(names)}")
    if known is None and wanted == set("tqv"):
        raise RecordingError(
            f"not of a known layout, such as columns t, q1, .., v1, ..; found {listed(names)}; declare the columns, as "
            "in --columns 't=time[ms]' 'q=pos_{1..6}[deg]' 'v=cur_{1..6}[mA]' --signal current (or --log-description)"
        )
    known = known or LogDescription()
    meant = replace(
        given,
        signal=given.signal or (known.signal if "v" in wanted else None),
        joints=given.joints or known.joints,
        **{kind: _named(names, getattr(given, kind).over(getattr(known, kind)), given.joints) for kind in "tqv"},
    )
    for name, _ in given.only:
        _column(names, name)
    is_current = layout == OWN or (layout == LEROBOT and all(map(CURRENT.search, meant.v.columns)))
    as_logged = meant.signal is None and not meant.v.unit and is_current and "v" in wanted
    missing: list[str] = []
    for kind, what in (("t", "time"), ("q", "positions"), ("v", "currents")):
        channels: Channels = getattr(meant, kind)
        if not channels.columns or not (channels.unit or (kind == "v" and as_logged)):
            lacks = f"the unit of {what} is not declared" if channels.columns else f"no column is declared for {what}"
            rate = ", t=[RATE Hz] without times" if kind == "t" else ""
            missing.append(f"{lacks}: {kind}=NAME..[unit] of --columns{rate}, or [{kind}] of a log description")
    if meant.signal is None and meant.v.columns and not as_logged:
        missing.append(
            f"the quantity in {listed(meant.v.columns, 3)} is not declared; state it with --signal or in a log "
            f"description: {', '.join(MEANINGS)}"
        )
    if missing:
        there = "" if meant.t.columns and meant.q.columns and meant.v.columns else f"; found {listed(names)}"
        raise RecordingError("; ".join(missing) + there)
    return _checked(meant), layout


def _known(layout: str, table: Table, given: LogDescription, wanted: Set[str]) -> LogDescription | None:
    """Return what a layout says of columns that are not declared, None for a file of another layout."""
    names = table.names
    if layout in FIXED:
        signal, _, *words = FIXED[layout]
        ours = [name for name in names if OURS.fullmatch(name) and name[0] in wanted - {"t"}]
        joints = max((int(name[1:]) for name in ours), default=1)
        known = replace(described([word.replace("n}", f"{joints}}}") for word in words]), signal=signal)
        there = [getattr(known, kind).columns[0] in names for kind in wanted]
        if layout == OWN and any(there) and {"q0", "v0"}.intersection(names):
            raise RecordingError("columns q0, v0: joints are numbered from 1; rename them q1, q2, .., v1, ..")
        return known if all(there) else None
    if layout != table.layout:
        return None
    if len(table.currents) > 1 and "v" in wanted:
        kinds = list(table.currents)
        raise RecordingError(
            f"several kinds of current: {listed(kinds)}; choose one, --columns 'v={kinds[0]}', and name the "
            "joints (--joints, or --model)"
        )
    entries = {"q": table.positions, "v": next(iter(table.currents.values()), {})}
    joints = given.joints or table.joints
    if joints is None:
        raise RecordingError(
            "the order of the joints is not declared; give it, base to flange (--joints, or --model): there are "
            f"{listed(table.positions)}"
        )
    known = LogDescription(joints=joints, t=Channels(columns=(table.time,), unit=("s",)))
    for kind, what in (("q", "position"), ("v", "current or effort")):
        if kind not in wanted or not entries[kind]:
            continue
        lacking = next((joint for joint in joints if joint not in entries[kind]), None)
        if lacking is not None:
            raise RecordingError(
                f"no {what} of joint {shown(lacking)}{nearest(lacking, entries[kind])}; there are "
                f"{listed(entries[kind])}; give the log's joint names, base to flange (--joints)"
            )
        units = tuple(entries[kind][joint][1] for joint in joints)
        if layout == JOINT_STATES and kind == "v" and given.signal:
            units = (MEANINGS[given.signal].unit,)  # by ROS's REP 103
        channels = Channels(
            columns=tuple(entries[kind][joint][0] for joint in joints), unit=units if all(units) else ()
        )
        known = replace(known, **{kind: channels})
    return known


def _named(names: Sequence[str], channels: Channels, joints: Sequence[str] | None) -> Channels:
    """Return channels with names in the file: joint names are inserted, columns of arrays expanded."""
    found: list[str] = []
    for name in channels.columns:
        if "{joint}" in name:
            if joints is None:
                raise RecordingError(
                    f"column {shown(name)}: the joints' names are unknown; give them (--joints, or --model)"
                )
            found += [_column(names, name.replace("{joint}", joint)) for joint in joints]
        elif name not in names and entry(name, 0) in names:
            entries = {entry(name, k) for k in range(len(names))}
            found += [each for each in names if each in entries]
        else:
            found.append(_column(names, name))
    return replace(channels, columns=tuple(found))


def _column(names: Sequence[str], name: str) -> str:
    """Return a name that is in the file once."""
    many = names.count(name)
    if many > 1:
        raise RecordingError(f"column {shown(name)} appears twice")
    series, _, wanted = name.removesuffix("]").partition("[")
    others = [each[len(series) + 1 : -1] for each in names if each.startswith(f"{series}[")]
    if not many and others:
        raise RecordingError(f"no {one_line(series)} of {shown(wanted)}; found those of {listed(others)}")
    if not many:
        raise RecordingError(
            f"no column {shown(name)}{nearest(name, names)}; found {listed(names)}; declare columns of other "
            "names (--columns, --log-description)"
        )
    return name


def _checked(meant: LogDescription) -> LogDescription:
    """Check quantity, units and numbers of columns; return one unit, sign, zero, .. of each column."""
    t, q, v = meant.t.columns, meant.q.columns, meant.v.columns
    meaning, computed = MEANINGS.get(meant.signal or ""), meant.signal == TORQUE_FROM_CURRENT
    doubled = next((name for name in (*q, *v) if (*t, *q, *v).count(name) > 1), None)
    faults = {
        f"v is {meant.signal}: {meaning.refused if meaning else ''}": meaning and meaning.refused,
        "positions are in ticks; state counts_per_turn, of the joint, in [q] of a log description": (
            TICKS in meant.q.unit and not meant.q.counts_per_turn
        ),
        "v is a torque from current; state the constants it was computed with, in N m/A (--constant, or constant of "
        '[v] in a log description), or "unknown"': computed and meant.v.constant is None,
        f"constants are given for v, but v is not a {TORQUE_FROM_CURRENT}": (
            not computed and meant.v.constant is not None
        ),
        f'{len(t)} columns of time are added, each with its own unit: unit = ["s", "ns"] in [t] of a log description': (
            len(t) > 1 and (len(meant.t.unit) != len(t) or ISO in meant.t.unit)
        ),
        f"{len(q)} columns of positions ({listed(q, 3)}), {len(v)} of currents ({listed(v, 3)}); a joint has one of "
        "each": len(q) != len(v),
        f"column {shown(doubled)} is declared twice": doubled,
    }
    for sentence, fault in faults.items():
        if fault:
            raise RecordingError(sentence)
    for kind, known in (("t", TIME), ("q", POSITION), ("v", meaning.units if meaning else {})):
        channels: Channels = getattr(meant, kind)
        unknown = next((unit for unit in channels.unit if unit not in known), None)
        if unknown is not None:
            raise RecordingError(
                f"unit {shown(unknown)} of {kind}{f', {meant.signal},' if kind == 'v' else ''} is unknown"
                f"{nearest(unknown, known)}; known: {', '.join(known)}"
            )
        own, count = dict[str, tuple[str | float, ...]](), len(channels.columns)
        for key, default in Channel._field_defaults.items():
            values = getattr(channels, key) or (default,)
            if len(values) not in (1, count):
                raise RecordingError(f"{key} of {kind} has {len(values)} entries for {count} joints")
            own[key] = values if len(values) > 1 else values * count
        meant = replace(meant, **{kind: replace(channels, **own)})
    return meant
