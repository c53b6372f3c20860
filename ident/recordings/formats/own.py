"""Our own columns: `t`, `q1` .. `qn`, `v1` .. `vn` in seconds, radians or metres, and drive units."""

import re
from collections.abc import Sequence
from pathlib import Path

from ident.recordings.formats.columns import OURS, listed, used_columns
from ident.recordings.formats.description import Channels, LogDescription
from ident.recordings.formats.units import TIME
from ident.support.errors import RecordingError
from ident.support.naming import one_line, shown

NAME = "own"
_TIME = re.compile(r"(?i)t[^a-z]|time|stamp|sec|elapsed|clock")
"""How names of columns of time begin."""


def layout(path: Path, names: Sequence[str], description: LogDescription) -> LogDescription | None:
    """Our columns, as far as no others are said to be in their place.

    Raises:
        RecordingError: If such a column is missing, doubled or misspelled.
    """
    kinds = {name[0] for name in names if OURS.fullmatch(name)}
    wanted = {kind for kind in "tqv" if not getattr(description, kind).columns}
    if not kinds & wanted - {"t"} and not kinds >= wanted == {"t"}:
        return None
    return own_columns(path, names, wanted)


def own_columns(path: Path, names: Sequence[str], wanted: set[str]) -> LogDescription:
    """The columns of some kinds of `t`, `q` and `v`.

    Raises:
        RecordingError: If one is missing, doubled or misspelled.
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
    """What to say of the column that is time by its name, or of whichever it is."""
    likely = next((name for name in names if _TIME.match(name)), None)
    if likely is None:
        return "; say which one it is: --columns t=NAME[unit]"
    ending = re.split(r"[^a-z]+", likely.lower().rstrip("])"))[-1]
    unit = f"[{ending}]" if ending in TIME else "[unit]"
    return f"; is it {shown(likely)}? --columns 't={one_line(likely)}{unit}'"


def _joint_numbers(place: str, used: Sequence[str], kind: str) -> list[int]:
    numbers = sorted(int(name[1:]) for name in used if name[0] == kind)
    if not numbers:
        raise RecordingError(f"{place}: columns {kind}1, {kind}2, .. are missing; found {listed(used)}")
    return numbers
