"""TOML files of bounded size and depth, as tables."""

import re
import tomllib
from pathlib import Path

from ident.support.file_access import read_bytes
from ident.support.naming import one_line

LARGEST = 4_000_000
"""Largest size [bytes]; a motion of a thousand harmonics has 0.3 MB."""
DEEPEST = 16
"""Largest nesting depth of tables and arrays."""
_DOTTED = re.compile(rf"""(?<![\w"'-])(?:[\w"'-]+[ \t]*\.[ \t]*){{{DEEPEST}}}""")
_PLACE = re.compile(r"at line (\d+), column (\d+)")


def read_toml(path: Path, *, error: type[ValueError]) -> dict[str, object]:
    """Parse a TOML file.

    Raises:
        ValueError: Of class `error`, one line that begins with the path, if it cannot be read, is not TOML, or is
            nested deeper than `DEEPEST`.
    """
    content = read_bytes(path, most_bytes=LARGEST, error=error)
    too_deep = f"{one_line(path)}: tables or arrays are nested deeper than {DEEPEST}"
    try:
        text = content.decode("utf-8-sig")
        if _DOTTED.search(text):  # before parsing, whose time is quadratic in the parts of a key
            raise error(too_deep)
        table = tomllib.loads(text)
    except UnicodeDecodeError as fault:
        raise error(f"{one_line(path)}: not TOML: byte {fault.start} is not UTF-8; save it as UTF-8") from fault
    except RecursionError:
        raise error(too_deep) from None
    except tomllib.TOMLDecodeError as fault:
        raise error(f"{one_line(path)}: not TOML: {one_line(fault)}{_decimal_comma(content, fault)}") from fault
    except ValueError as fault:
        if isinstance(fault, error):
            raise
        raise error(f"{one_line(path)}: not TOML: {one_line(fault)}") from fault
    if _depth(table) > DEEPEST:
        raise error(too_deep)
    return table


def _decimal_comma(content: bytes, fault: tomllib.TOMLDecodeError) -> str:
    """Return advice for a number with a decimal comma, if that is the fault."""
    place = _PLACE.search(str(fault))
    if place is None:
        return ""
    line, column = map(int, place.groups())
    rows = content.decode("utf-8-sig").split("\n")
    around = rows[line - 1][max(0, column - 2) : column + 1] if line <= len(rows) else ""
    return "; numbers have a decimal point" if re.fullmatch(r"\d,\d", around) else ""


def _depth(table: dict[str, object]) -> int:
    """Return the nesting depth of tables and arrays."""
    depth, level = 0, list[object]([table])
    while level and depth <= DEEPEST:
        inner: list[object] = []
        for value in level:
            if isinstance(value, dict):
                inner += value.values()
            elif isinstance(value, list):
                inner += value
        level = [value for value in inner if isinstance(value, dict | list)]
        depth += 1
    return depth
