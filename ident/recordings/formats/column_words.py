"""Columns in few words: `t=time[ms]`, `q=pos_{1..6}[deg]`, `v=a,b,c[mA]`."""

import re
from collections.abc import Sequence

from ident.recordings.formats.description import NOTHING, Channels, LogDescription
from ident.recordings.formats.units import CURRENT, POSITION, SHARE, TIME, TORQUE
from ident.support.errors import LogDescriptionError
from ident.support.naming import nearest, shown

UNITS = {"t": TIME, "q": POSITION, "v": CURRENT | SHARE | TORQUE}
MOST = 64
"""Columns that a range stands for."""
_RANGE = re.compile(r"\{(\d{1,4})\.\.(\d{1,4})\}")
_UNIT = re.compile(r"(.*)\[([^\[\]]*)\]", re.DOTALL)


def spread(word: str, place: str) -> list[str]:
    """The names that `name{a..b}` stands for.

    Args:
        word: A name; without such a range it stands for itself.
        place: For messages.

    Raises:
        LogDescriptionError: If the range is empty or too long.
    """
    found = _RANGE.search(word)
    if found is None:
        return [word]
    first, last = int(found[1]), int(found[2])
    if not first <= last < first + MOST:
        raise LogDescriptionError(f"{place}: {shown(word)}; expected a range of 1 to {MOST} numbers, {{1..6}}")
    return [word[: found.start()] + str(k) + word[found.end() :] for k in range(first, last + 1)]


def described(words: Sequence[str]) -> LogDescription:
    """What words say of a log.

    Args:
        words: Each `t=`, `q=` or `v=` with names, separated by commas, and a unit in brackets where it is known.

    Raises:
        LogDescriptionError: If a word says something else.
    """
    found: dict[str, Channels] = {}
    for word in words:
        kind, equals, given = word.partition("=")
        if kind not in UNITS or not equals or not given:
            raise LogDescriptionError(f"--columns: {shown(word)}; expected t=NAME[unit], q=NAME,NAME,..[unit] or v=..")
        if kind in found:
            raise LogDescriptionError(f"--columns: {kind}= is given twice")
        found[kind] = _channels(kind, given)
    return LogDescription(t=found.get("t", NOTHING), q=found.get("q", NOTHING), v=found.get("v", NOTHING))


def _channels(kind: str, given: str) -> Channels:
    """Names and unit; brackets that hold no unit belong to the name of a column."""
    unit: tuple[str, ...] = ()
    ending = _UNIT.fullmatch(given)
    if ending is not None and not ending[2].isdigit():
        given, unit = ending[1], (ending[2],)
        if unit[0] not in UNITS[kind]:
            known = f"{nearest(unit[0], UNITS[kind])}; there are {', '.join(UNITS[kind])}"
            raise LogDescriptionError(f"--columns: unit {shown(unit[0])} of {kind} is unknown{known}")
    names = [name for word in given.split(",") for name in spread(word.strip(), "--columns")] if given else []
    if not all(names):
        raise LogDescriptionError(f"--columns: {kind}={shown(given)} lacks a name")
    return Channels(columns=tuple(names), unit=unit)
