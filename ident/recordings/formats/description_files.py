"""Descriptions of logs from TOML files and command lines: `t=time[ms]`, `q=pos_{1..6}[deg]`, `v=a,b,c[mA]`."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from ident.recordings.formats.description import NOTHING, Channels, LogDescription, TextLayout
from ident.recordings.formats.layouts import LAYOUTS
from ident.recordings.formats.meaning import CURRENT, MEANINGS, POSITION, SHARE, TIME, TORQUE
from ident.support.errors import LogDescriptionError
from ident.support.naming import nearest, one_line, shown
from ident.support.toml_files import read_toml

KEYS = ("signal", "layout", "joints", "topic", "only", "t", "q", "v", "file")
CHANNELS = {
    "t": ("column", "unit"),
    "q": ("columns", "unit", "counts_per_turn", "sign", "zero"),
    "v": ("columns", "unit", "sign", "constant"),
}
FILE = ("separator", "decimal", "header", "rows", "encoding")
UNKNOWN = "unknown"
LARGEST = 1e12
"""Largest plausible number."""
UNITS = {"t": TIME, "q": POSITION, "v": CURRENT | SHARE | TORQUE}
MOST = 64
"""Largest number of columns of a range."""
_RANGE = re.compile(r"\{(\d{1,4})\.\.(\d{1,4})\}")
_UNIT = re.compile(r"(.*)\[([^\[\]]*)\]", re.DOTALL)
LAST_LINE = 100_000
"""Largest number of lines before the first row."""


class _Table:
    """A table of the file, with its name for messages."""

    def __init__(self, place: str, table: object, known: tuple[str, ...]) -> None:
        if not isinstance(table, dict):
            raise LogDescriptionError(f"{place} = {shown(table)}; expected a table with {', '.join(known)}")
        for key in table:
            if key not in known:
                raise LogDescriptionError(
                    f"{place}: unknown key {shown(key)}{nearest(str(key), known)}; known: {', '.join(known)}"
                )
        self.place, self.table = place, table

    def wrong(self, key: str, expected: str) -> LogDescriptionError:
        """Return the error for a value."""
        return LogDescriptionError(f"{self.place}: {key} = {shown(self.table[key])}; expected {expected}")

    def word(self, key: str) -> str | None:
        """Return a text, None if missing."""
        value = self.table.get(key)
        if value is not None and not (isinstance(value, str) and value.strip()):
            raise self.wrong(key, "a text")
        return value

    def one_of(self, key: str, known: Mapping[str, object]) -> str | None:
        """Return one of some words, None if missing."""
        value = self.word(key)
        if value is not None and value not in known:
            raise self.wrong(key, f"one of {', '.join(known)}{nearest(value, known)}")
        return value

    def words(self, key: str) -> tuple[str, ...]:
        """Return one or several texts, empty if missing."""
        value = self.table.get(key, [])
        texts = [value] if isinstance(value, str) else value
        if not isinstance(texts, list) or not all(isinstance(each, str) and each.strip() for each in texts):
            raise self.wrong(key, "a text, or an array of texts, one per joint")
        if key in self.table and not texts:
            raise self.wrong(key, "at least one")
        return tuple(texts)

    def numbers(self, key: str) -> tuple[float, ...]:
        """Return one or several numbers, empty if missing."""
        value = self.table.get(key, [])
        found = value if isinstance(value, list) else [value]
        for each in found:
            if isinstance(each, bool) or not isinstance(each, int | float) or not abs(each) <= LARGEST:
                raise self.wrong(key, "a number, or an array of numbers, one per joint")
        if key in self.table and not found:
            raise self.wrong(key, "at least one")
        return tuple(float(each) for each in found)

    def line(self, key: str) -> int | None:
        """Return a line number, None if missing."""
        value = self.table.get(key)
        if value is None:
            return None
        if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= LAST_LINE:
            raise self.wrong(key, f"a line number, 1 to {LAST_LINE}")
        return value


def read_description(path: str | Path) -> LogDescription:
    """Read the description of a log.

    Raises:
        LogDescriptionError: If the file cannot be read or is not valid.
    """
    path = Path(path)
    return description_of(read_toml(path, error=LogDescriptionError), one_line(path))


def description_of(table: Mapping[str, object], place: str) -> LogDescription:
    """Return the description of a log in a table.

    Raises:
        LogDescriptionError: If it is not valid.
    """
    top = _Table(place, table, KEYS)
    t, q, v = (_channels(f"{place}: [{kind}]", top.table.get(kind, {}), kind) for kind in CHANNELS)
    return LogDescription(
        signal=top.one_of("signal", MEANINGS),
        layout=top.one_of("layout", LAYOUTS),
        joints=top.words("joints") or None,
        topic=top.word("topic"),
        only=_only(top),
        t=t,
        q=q,
        v=v,
        text=_text(_Table(f"{place}: [file]", top.table.get("file", {}), FILE)),
    )


def _channels(place: str, table: object, kind: str) -> Channels:
    description = _Table(place, table, CHANNELS[kind])
    columns = description.words("column" if kind == "t" else "columns")
    found = Channels(
        columns=tuple(name for word in columns for name in spread(word, place)),
        unit=description.words("unit"),
        counts_per_turn=description.numbers("counts_per_turn"),
        sign=description.numbers("sign"),
        zero=description.numbers("zero"),
        constant=_constant(description),
    )
    if any(abs(sign) != 1.0 for sign in found.sign):
        raise description.wrong("sign", "1 or -1")
    for key in ("counts_per_turn", "constant"):
        if any(number == 0.0 for number in getattr(found, key) or ()):
            raise description.wrong(key, "numbers that are not 0")
    return found


def _constant(description: _Table) -> tuple[float, ...] | None:
    """Return constants, empty if declared unknown, None if not declared."""
    if description.table.get("constant") == UNKNOWN:
        return ()
    return description.numbers("constant") or None


def _only(top: _Table) -> tuple[tuple[str, float], ...]:
    table = top.table.get("only", {})
    if not isinstance(table, dict) or not all(
        isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LARGEST
        for value in table.values()
    ):
        raise top.wrong("only", "a table of columns and the number that selects rows, such as { episode_index = 3 }")
    return tuple((str(name), float(value)) for name, value in table.items())


def _text(description: _Table) -> TextLayout:
    header = 0 if description.table.get("header") == "none" else description.line("header")
    rows, encoding = description.line("rows"), description.word("encoding")
    separator, decimal = (description.table.get(key) for key in ("separator", "decimal"))
    if separator is not None and (not isinstance(separator, str) or len(separator) != 1 or separator in "\"'\r\n#\0"):
        raise description.wrong("separator", "one character")
    if decimal is not None and decimal not in (".", ","):
        raise description.wrong("decimal", "'.' or ','")
    if decimal is not None and decimal == separator:
        raise description.wrong("decimal", "a character other than the separator")
    if header and rows and rows <= header:
        raise description.wrong("rows", f"a line after that of the header, {header}")
    if encoding is not None and not _is_encoding(encoding):
        raise description.wrong("encoding", "an encoding that Python knows: utf-8, utf-16-le, latin-1, cp1252, ..")
    return TextLayout(separator=separator, decimal=decimal, header=header, rows=rows, encoding=encoding)


def _is_encoding(name: str) -> bool:
    try:
        b"a".decode(name)
    except UnicodeError:  # incomplete multi-byte character
        return True
    except (LookupError, ValueError):  # unknown, a bytes-to-bytes codec, or not a name
        return False
    return True


def spread(word: str, place: str) -> list[str]:
    """Return the names of a range `name{a..b}`.

    Args:
        word: A name with or without a range.
        place: Name for messages.

    Raises:
        LogDescriptionError: If the range is empty or too long.
    """
    found = _RANGE.search(word)
    if found is None:
        return [word]
    first, last = int(found[1]), int(found[2])
    if not first <= last < first + MOST:
        raise LogDescriptionError(f"{place}: {shown(word)}; expected a range of 1 to {MOST} numbers, such as {{1..6}}")
    return [word[: found.start()] + str(k) + word[found.end() :] for k in range(first, last + 1)]


def described(words: Sequence[str]) -> LogDescription:
    """Return the description of a log from command-line words.

    Args:
        words: Each `t=`, `q=` or `v=` with names, separated by commas, and optionally a unit in brackets.

    Raises:
        LogDescriptionError: If a word is not valid.
    """
    found: dict[str, Channels] = {}
    for word in words:
        kind, equals, given = word.partition("=")
        if kind not in UNITS or not equals or not given:
            raise LogDescriptionError(f"--columns: {shown(word)}; expected t=NAME[unit], q=NAME,NAME,..[unit] or v=..")
        if kind in found:
            raise LogDescriptionError(f"--columns: {kind}= is given twice")
        found[kind] = _in_words(kind, given)
    return LogDescription(t=found.get("t", NOTHING), q=found.get("q", NOTHING), v=found.get("v", NOTHING))


def _in_words(kind: str, given: str) -> Channels:
    """Return names and unit; brackets without a unit belong to the name of a column."""
    unit: tuple[str, ...] = ()
    ending = _UNIT.fullmatch(given)
    if ending is not None and not ending[2].isdigit():
        given, unit = ending[1], (ending[2],)
        if unit[0] not in UNITS[kind]:
            known = f"{nearest(unit[0], UNITS[kind])}; known: {', '.join(UNITS[kind])}"
            raise LogDescriptionError(f"--columns: unit {shown(unit[0])} of {kind} is unknown{known}")
    names = [name for word in given.split(",") for name in spread(word.strip(), "--columns")] if given else []
    if not all(names):
        raise LogDescriptionError(f"--columns: {kind}={shown(given)} lacks a name")
    return Channels(columns=tuple(names), unit=unit)
