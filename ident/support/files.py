"""Files of the user, and what C++ libraries write to standard error.

A file is regular and of bounded size, TOML of bounded depth, or an error of one line begins with the path.
They are read only once known to be regular: pipes cannot block, devices cannot deliver endless data.
"""

import os
import re
import stat
import sys
import tempfile
import tomllib
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path

from ident.support.naming import one_line

KINDS = {"d": "a folder", "p": "a pipe", "c": "a device", "b": "a device", "s": "a socket"}
"""Files that are not regular, by the letter of their mode."""
LARGEST = 4_000_000
"""Largest size of a TOML file [bytes]; a motion of a thousand harmonics has 0.3 MB."""
DEEPEST = 16
"""Largest nesting depth of tables and arrays."""
STDERR = 2
_DOTTED = re.compile(rf"""(?<![\w"'-])(?:[\w"'-]+[ \t]*\.[ \t]*){{{DEEPEST}}}""")
_PLACE = re.compile(r"at line (\d+), column (\d+)")


def check_file(path: Path, *, most_bytes: int, error: Callable[[str], Exception]) -> None:
    """Check that a file is regular, not empty, and of at most `most_bytes` bytes; raises `error`."""
    place = one_line(path)
    try:
        found = os.stat(path)
    except FileNotFoundError:
        raise error(f"{place}: no such file") from None
    except (OSError, ValueError) as fault:
        raise error(f"{place}: {getattr(fault, 'strerror', None) or one_line(fault)}") from fault
    kind = stat.filemode(found.st_mode)[0]
    if kind != "-":
        raise error(f"{place}: is {KINDS.get(kind, 'no file')}; expected a regular file")
    if found.st_size == 0:
        raise error(f"{place}: the file is empty")
    if found.st_size > most_bytes:
        raise error(
            f"{place}: {found.st_size / 1e6:.4g} MB are too much; such files are read up to {most_bytes / 1e6:.4g} MB"
        )


def read_bytes(path: Path, *, most_bytes: int, error: Callable[[str], Exception]) -> bytes:
    """Return the content of a regular file; raises `error` as `check_file`, or if it may not be read."""
    check_file(path, most_bytes=most_bytes, error=error)
    try:
        return path.read_bytes()
    except OSError as fault:
        raise error(f"{one_line(path)}: {fault.strerror or 'not readable'}") from fault


def read_toml(path: Path, *, error: Callable[[str], Exception]) -> dict[str, object]:
    """Parse a TOML file; raises `error` if it cannot be read, is not TOML, or is nested deeper than `DEEPEST`."""
    content, place = read_bytes(path, most_bytes=LARGEST, error=error), one_line(path)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as fault:
        raise error(f"{place}: not TOML: byte {fault.start} is not UTF-8; save it as UTF-8") from fault
    return parsed_toml(text, place, error=error)


def parsed_toml(text: str, place: str, *, error: Callable[[str], Exception]) -> dict[str, object]:
    """Parse a text, as `read_toml`."""
    too_deep = error(f"{place}: tables or arrays are nested deeper than {DEEPEST}")
    if _DOTTED.search(text):  # before parsing, whose time is quadratic in the parts of a key
        raise too_deep
    try:
        table = tomllib.loads(text)
    except RecursionError:
        raise too_deep from None
    except ValueError as fault:
        around = ""
        if found := _PLACE.search(str(fault)):
            line, column = map(int, found.groups())
            around = [*text.split("\n"), ""][line - 1][max(0, column - 2) : column + 1]
        advice = "; numbers have a decimal point" if re.fullmatch(r"\d,\d", around) else ""
        raise error(f"{place}: not TOML: {one_line(fault)}{advice}") from fault
    level: list[dict[str, object] | list[object]] = [table]
    for _ in range(DEEPEST):
        inner = [each for value in level for each in (value.values() if isinstance(value, dict) else value)]
        level = [each for each in inner if isinstance(each, dict | list)]
    if level:
        raise too_deep
    return table


@contextmanager
def captured_stderr() -> Generator[list[str]]:
    """Collect the lines that are written to file descriptor 2, below Python; the list holds them after the block."""
    lines: list[str] = []
    try:
        kept = os.dup(STDERR)
    except OSError:  # nothing to capture without stderr
        yield lines
        return
    try:
        with tempfile.TemporaryFile() as caught:
            if sys.stderr is not None:
                sys.stderr.flush()
            os.dup2(caught.fileno(), STDERR)
            try:
                yield lines
            finally:
                os.dup2(kept, STDERR)
                caught.seek(0)
                text = caught.read().decode("utf-8", "replace")
                lines += [line for raw in text.splitlines() if (line := one_line(raw))]
    finally:
        os.close(kept)
