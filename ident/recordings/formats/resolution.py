"""Meaning and units of a file's columns: from the description, completed by the layout."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ident.recordings.formats.columns import MOST_COLUMNS, Chosen, entry, listed
from ident.recordings.formats.description import Channels, LogDescription, over
from ident.recordings.formats.layouts import JOINT_STATES, LAYOUTS, LEROBOT, OWN, UR, UR_CURRENT, UR_TARGET, own_columns
from ident.recordings.formats.lerobot_info import CURRENT
from ident.recordings.formats.meaning import ISO, MEANINGS, POSITION, TICKS, TIME, TORQUE_FROM_CURRENT
from ident.support.errors import RecordingError
from ident.support.naming import nearest, one_line, shown

MOST_JOINTS = 64
"""Largest number of joints of a recording."""
TAKEN = {
    UR: f"v is actual_current_0 .. [A], as measured; --layout {UR_TARGET} selects target_current",
    UR_TARGET: "v is target_current_0 .. [A], as commanded by the controller",
}
"""Notes on choices of a layout."""


@dataclass(frozen=True, slots=True)
class Resolved:
    """Meaning of a file's columns.

    Attributes:
        description: Columns with their names in the file, one per joint; units; quantity of v, None for drive units.
        layout: Name of the recognised layout, None if everything was declared.
    """

    description: LogDescription
    layout: str | None

    @property
    def divided(self) -> bool:
        """Whether v was a torque from current, converted to current with the specified constants."""
        return self.description.signal == TORQUE_FROM_CURRENT and bool(self.description.v.constant)

    @property
    def chosen(self) -> Chosen:
        """The columns to be read, each once; time as dates if its unit is that of dates."""
        description = self.description
        names = (
            *description.t.columns,
            *description.q.columns,
            *description.v.columns,
            *(name for name, _ in description.only),
        )
        return Chosen(
            tuple(dict.fromkeys(names)), frozenset(description.t.columns if description.t.unit == (ISO,) else ())
        )


def resolved(path: Path, names: Sequence[str], description: LogDescription) -> Resolved:
    """Determine the meaning of a file's columns.

    Raises:
        RecordingError: If the layout is unknown, a column is missing or ambiguous, or a declaration is missing.
    """
    if len(names) > MOST_COLUMNS:
        raise RecordingError(f"{one_line(path)}: {len(names)} columns; files of up to {MOST_COLUMNS} are read")
    layout, known = _layout(path, names, description)
    t, q, v = (over(getattr(description, kind), getattr(known, kind)) for kind in "tqv")
    found = replace(
        description,
        signal=description.signal or (None if description.v.columns else known.signal),
        joints=description.joints or known.joints,
        t=replace(t, columns=_columns(path, names, t.columns, description.joints)),
        q=replace(q, columns=_columns(path, names, q.columns, description.joints)),
        v=replace(v, columns=_columns(path, names, v.columns, description.joints)),
    )
    if layout == JOINT_STATES and found.signal is not None and not found.v.unit and not description.v.columns:
        found = replace(found, v=replace(found.v, unit=(MEANINGS[found.signal].unit,)))  # by ROS's REP 103
    for name, _ in description.only:
        _column(path, names, name)
    _check_complete(path, found, plain=_plain(layout, found) and not description.v.columns)
    return Resolved(found, layout)


def _plain(layout: str | None, found: LogDescription) -> bool:
    """Return whether v is known to be a current, whose unit may be unknown."""
    return layout == OWN or (layout == LEROBOT and all(map(CURRENT.search, found.v.columns)))


def _layout(path: Path, names: Sequence[str], description: LogDescription) -> tuple[str | None, LogDescription]:
    """Return the matching layout and its description; nothing if all columns are declared."""
    if description.layout is not None:
        known = LAYOUTS[description.layout](path, names, description)
        if known is None:
            raise RecordingError(f"{one_line(path)}: not of the layout {description.layout}; found {listed(names)}")
        return description.layout, known
    if description.t.columns and description.q.columns and description.v.columns:
        return None, LogDescription()
    for name, layout in LAYOUTS.items():
        known = layout(path, names, description)
        if known is not None:
            return name, known
    if description.t.columns or description.q.columns or description.v.columns:
        return None, LogDescription()
    return OWN, own_columns(path, names, set("tqv"))  # raises for missing columns


def _columns(path: Path, names: Sequence[str], wanted: Sequence[str], joints: Sequence[str] | None) -> tuple[str, ...]:
    """Return names in the file for requested ones, with joint names inserted and columns of arrays expanded."""
    found: list[str] = []
    for name in wanted:
        if "{joint}" in name:
            if joints is None:
                raise RecordingError(
                    f"{one_line(path)}: column {shown(name)}: the joints' names are unknown; give them "
                    "(--joints, or --model)"
                )
            found += [_column(path, names, name.replace("{joint}", joint)) for joint in joints]
        elif name not in names and entry(name, 0) in names:
            found += _entries(name, names)
        else:
            found.append(_column(path, names, name))
    return tuple(found)


def _entries(name: str, names: Sequence[str]) -> list[str]:
    there, number, found = set(names), 0, list[str]()
    while entry(name, number) in there:
        found.append(entry(name, number))
        number += 1
    return found


def _column(path: Path, names: Sequence[str], name: str) -> str:
    many = names.count(name)
    if many == 1:
        return name
    if many > 1:
        raise RecordingError(f"{one_line(path)}: column {shown(name)} appears twice")
    ours = (
        "; this log already has columns t, q1, v1, ..; convert only logs with "
        "other names (rx90 convert LOG --columns ..)"
    )
    advice = ours if {"t", "q1", "v1"} <= set(names) else ""
    raise RecordingError(
        f"{one_line(path)}: no column {shown(name)}{nearest(name, names)}; found {listed(names)}{advice}"
    )


def _check_complete(path: Path, found: LogDescription, *, plain: bool) -> None:
    place = one_line(path)
    missing = list(_missing(found, plain=plain))
    if missing:
        raise RecordingError(f"{place}: {'; '.join(missing)}")
    if found.signal is not None and MEANINGS[found.signal].refused:
        raise RecordingError(f"{place}: v is {found.signal}: {MEANINGS[found.signal].refused}")
    _check_units(place, found)
    _check_joints(place, found)


def _missing(found: LogDescription, *, plain: bool) -> Iterator[str]:
    """Return all missing declarations together."""
    unstated = found.signal is None and (bool(found.v.unit) or not plain)
    for kind, what in (("t", "time"), ("q", "positions"), ("v", "currents")):
        channels: Channels = getattr(found, kind)
        if not channels.columns:
            yield (f"no column is declared for {what}: {kind}=NAME.. of --columns, or [{kind}] of a log description")
        if channels.columns and not channels.unit and not (kind == "v" and found.signal is None and not unstated):
            yield (
                f"the unit of {what} is not declared: {kind}=NAME..[unit] of --columns, or unit of "
                f"[{kind}] in a log description"
            )
    if unstated and found.v.columns:
        yield (
            f"the quantity in {listed(found.v.columns, 3)} is not declared; state it with --signal or "
            f"in a log description: {', '.join(MEANINGS)}"
        )


def _check_units(place: str, found: LogDescription) -> None:
    for kind, known in (("t", TIME), ("q", POSITION), ("v", MEANINGS[found.signal].units if found.signal else {})):
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


def _check_joints(place: str, found: LogDescription) -> None:
    q, v = found.q.columns, found.v.columns
    if len(found.t.columns) != 1:
        raise RecordingError(f"{place}: time is one column, not {len(found.t.columns)}")
    if len(q) != len(v):
        raise RecordingError(
            f"{place}: {len(q)} columns of positions ({listed(q, 3)}), {len(v)} of currents ({listed(v, 3)}); a joint "
            "has one of each"
        )
    if len(q) > MOST_JOINTS:
        raise RecordingError(f"{place}: {len(q)} joints; recordings of up to {MOST_JOINTS} are read")
    doubled = next((name for name in (*q, *v) if (*found.t.columns, *q, *v).count(name) > 1), None)
    if doubled is not None:
        raise RecordingError(f"{place}: column {shown(doubled)} is declared twice")
    for kind, channels in (("q", found.q), ("v", found.v)):
        for key in ("unit", "counts_per_turn", "sign", "zero", "constant"):
            many = len(getattr(channels, key) or ())
            if many not in (0, 1, len(q)):
                raise RecordingError(f"{place}: {key} of {kind} has {many} entries for {len(q)} joints")


def notes_of(read: Resolved) -> tuple[str, ...]:
    """Return notes on a log, one line each."""
    description = read.description
    taken = TAKEN.get(read.layout or "", "") if all(map(UR_CURRENT.fullmatch, description.v.columns)) else ""
    return tuple(note for note in (taken, _meaning_note(read)) if note)


def signal_of(read: Resolved) -> str:
    """Return the quantity of v in the recording, with its unit."""
    description = read.description
    if description.signal is None:
        return "as logged [drive units]"
    if read.divided:
        return "current, from torque by the specified constants [A]"
    return f"{MEANINGS[description.signal].words} [{MEANINGS[description.signal].unit}]"


def signal_after(read: Resolved) -> str | None:
    """Return the quantity of v in the recording, a name of `MEANINGS`; None for drive units."""
    return "current" if read.divided else read.description.signal


def _meaning_note(read: Resolved) -> str:
    if read.divided:
        return "v is the current: torque divided by the specified constants"
    return "" if read.description.signal is None else MEANINGS[read.description.signal].note
