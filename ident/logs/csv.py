"""Recordings in text files: a header line with the column names, one row a sample.

Columns are separated by commas, semicolons, tabs, bars or spaces, whichever shows the most of our names in the header;
the decimal sign may be a comma where that does not separate columns.
"""

import io
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ident.errors import RecordingError
from ident.logs.columns import OURS, Columns, LogFormat, used_columns
from ident.logs.text import read_text, without_comments
from ident.naming import one_line, shown

SEPARATORS = (",", ";", "\t", "|", " ")
_NUMBER = re.compile(r"[+-]?(?:(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|nan|inf(?:inity)?)", re.IGNORECASE)
_LINE = re.compile(rb"[^\r\n]*")
_SIGN = re.compile(rb"(?<![eE0-9.])\+(?=[0-9.])")


@dataclass(frozen=True, slots=True)
class _Layout:
    """How a text file is laid out.

    Attributes:
        header: Column names.
        separator: Between columns.
        decimal: Decimal sign.
        line: Line of the header, from 1.
        start: Where the rows begin in the text [bytes].
    """

    header: list[str]
    separator: str
    decimal: str
    line: int
    start: int


def read_csv(path: Path) -> Columns:
    """Read the columns of a recording.

    Raises:
        RecordingError: If the file is no text, has no header with our columns, or a cell is no number; names line
            and column.
    """
    text = read_text(path)
    layout = _layout(path, text)
    used = used_columns(path, layout.header)
    rows = without_comments(text[layout.start :])
    places = [layout.header.index(name) for name in used]
    values = (_spaced if layout.separator == " " else _parsed)(rows, layout, places)
    if values is not None:
        return dict(zip(used, values, strict=True))
    lines = [_tidy(line, layout) for line in rows.splitlines()]
    if fault := _fault(path, lines, layout, places):
        raise fault
    values = _parsed(b"\n".join(lines), layout, places)
    if values is None:
        raise RecordingError(f"{one_line(path)}: not readable as CSV")
    return dict(zip(used, values, strict=True))


def _layout(path: Path, text: bytes) -> _Layout:
    """Find header, separator and decimal sign."""
    position, number, commented = 0, 0, ""
    while position < len(text):
        found = _LINE.match(text, position)
        assert found is not None, "an empty line matches too"
        number += 1
        end = found.end() + (2 if text[found.end() : found.end() + 2] == b"\r\n" else 1)
        line = _decoded(found[0])
        words = line.split("#", 1)[0].strip()
        if words:
            break
        commented = line.strip().lstrip("#").strip() or commented
        position = end
    else:
        raise RecordingError(f"{one_line(path)}: expected a header line and at least one row")
    named = _named(words)
    if named == 0 and _named(commented) > 1 and not re.search("[a-df-mo-zA-DF-MO-Z]", words):
        words, number, end = commented, number - 1, position  # as numpy.savetxt writes it: the names are a comment
    elif named == 0 and all(_NUMBER.fullmatch(w) for w in re.split(r"[\s;,|]+", words) if w):
        raise RecordingError(
            f"{one_line(path)}: line {number} has numbers where column names are expected; begin with t,q1,..,v1,.."
        )
    separator = max(SEPARATORS, key=lambda s: sum(bool(OURS.fullmatch(w.lower())) for w in _split(words, s)))
    rest = text[end : end + 10_000].split(b"\n")
    first = next((row for row in rest if row.split(b"#", 1)[0].strip()), b"")
    if not first and not without_comments(text[end:]).strip():
        raise RecordingError(f"{one_line(path)}: expected a header line and at least one row")
    decimal = "," if separator != "," and b"," in first.split(b"#", 1)[0] else "."
    return _Layout(_split(words, separator), separator, decimal, number, end)


def _parsed(rows: bytes, layout: _Layout, places: list[int]) -> list[np.ndarray] | None:
    """The columns at some places, None if a row or cell does not fit."""
    import pyarrow as pa
    from pyarrow import csv

    names = [str(k) for k in range(len(layout.header))]
    wanted = [names[k] for k in places]
    try:
        table = csv.read_csv(
            pa.py_buffer(rows),
            read_options=csv.ReadOptions(column_names=names, use_threads=False, block_size=1 << 22),
            parse_options=csv.ParseOptions(delimiter=layout.separator),
            convert_options=csv.ConvertOptions(
                column_types=dict.fromkeys(wanted, pa.float64()),
                include_columns=wanted,
                null_values=[],
                decimal_point=layout.decimal,
                check_utf8=False,
            ),
        )
    except pa.ArrowInvalid:
        return None
    return [np.asarray(table[name].to_numpy(), dtype=np.float64) for name in wanted]


def _spaced(rows: bytes, layout: _Layout, places: list[int]) -> list[np.ndarray] | None:
    """Likewise for columns separated by one or more spaces, if all of them hold numbers."""
    numbers = io.BytesIO(rows.replace(b",", b".") if layout.decimal == "," else rows)
    try:
        values = np.loadtxt(numbers, ndmin=2)
    except ValueError:
        return None
    return [values[:, k] for k in places] if values.shape[1] == len(layout.header) else None


def _tidy(line: bytes, layout: _Layout) -> bytes:
    """A row as the fast parser wants it: one separator, none at the end beyond the header's, no plus signs."""
    separator = layout.separator.encode()
    line = _SIGN.sub(b"", line.strip(b" \t\f\v" if layout.separator != "\t" else b" "))
    if separator == b" ":
        line = b" ".join(line.split())
    if line.endswith(separator) and line.count(separator) == len(layout.header):
        line = line[:-1]
    return line if line.strip() else b""


def _fault(path: Path, lines: list[bytes], layout: _Layout, places: list[int]) -> RecordingError | None:
    """Find the first row or cell that does not fit."""
    for number, line in enumerate(lines, layout.line + 1):
        if not line:
            continue
        cells = _split(_decoded(line), layout.separator)
        for k in places:
            cell = cells[k] if k < len(cells) else ""
            if not _NUMBER.fullmatch(cell.replace(",", ".", 1) if layout.decimal == "," else cell):
                return RecordingError(
                    f"{one_line(path)}: line {number}, column {layout.header[k]}: {shown(cell)} is not a number"
                )
        if len(cells) != len(layout.header):
            hint = "; separate columns with ; where the decimal sign is a comma" if layout.separator == "," else ""
            count = f"{len(cells)} cells, but the header names {len(layout.header)}"
            return RecordingError(f"{one_line(path)}: line {number} has {count}{hint}")
    return None


def _split(line: str, separator: str) -> list[str]:
    cells = line.split(None if separator == " " else separator)
    return [cell.strip().strip("\"'").strip() for cell in cells]


def _named(line: str) -> int:
    """How many of our column names a line holds, whatever separates them."""
    return sum(bool(OURS.fullmatch(word.strip("\"'").lower())) for word in re.split(r"[\s;,|]+", line))


def _decoded(line: bytes) -> str:
    try:
        return line.decode()
    except UnicodeDecodeError:
        return line.decode("latin-1")


CSV = LogFormat((".csv", ".tsv", ".txt", ".gz"), read_csv)
