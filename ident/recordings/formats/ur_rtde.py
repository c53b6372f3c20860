"""Logs of Universal Robots' real-time data exchange, as its clients write them: `timestamp`, `actual_q_0`, ..

Currents are those that were measured, `actual_current_0`, ..; those that the controller asked for,
`target_current_0`, .., are another layout, taken by name or where the measured ones are missing.
"""

import re
from collections.abc import Sequence
from pathlib import Path

from ident.recordings.formats.description import Channels, LogDescription

NAME, TARGET = "ur-rtde", "ur-rtde-target"
JOINTS = 6
COLUMNS = r"timestamp|(?:actual|target)_(?:q|current)_[0-5]"
"""Pattern of the names by which such a file is told from others."""


def actual(path: Path, names: Sequence[str], description: LogDescription) -> LogDescription | None:
    """With measured currents [A]."""
    return _with(names, description, "actual_current")


def target(path: Path, names: Sequence[str], description: LogDescription) -> LogDescription | None:
    """With the currents that the controller asked for [A]."""
    return _with(names, description, "target_current")


def taken(columns: Sequence[str]) -> bool:
    """Whether all of some columns are currents of this layout."""
    return all(re.fullmatch("(?:actual|target)_current_[0-5]", name) for name in columns)


def _with(names: Sequence[str], description: LogDescription, current: str) -> LogDescription | None:
    q, v = (tuple(f"{each}_{j}" for j in range(JOINTS)) for each in ("actual_q", current))
    known = LogDescription(
        signal="current",
        t=Channels(columns=("timestamp",), unit=("s",)),
        q=Channels(columns=q, unit=("rad",)),
        v=Channels(columns=v, unit=("A",)),
    )
    needed = [
        known_of
        for known_of, wanted_of in zip(_kinds(known), _kinds(description), strict=True)
        if not wanted_of.columns
    ]
    return known if all(set(each.columns) <= set(names) for each in needed) else None


def _kinds(of: LogDescription) -> tuple[Channels, Channels, Channels]:
    return of.t, of.q, of.v
