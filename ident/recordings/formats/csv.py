"""Logs in text files: a header line with the column names, one row per sample.

Columns are separated by commas, semicolons, tabs, bars or spaces, whichever gives the most of the requested names in
the header, or the most numbers without a header. The decimal sign may be a comma unless that separates columns.
"""

import csv
import io
import math
import re
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from ident.recordings.formats.columns import Columns, LogFormat, Request
from ident.recordings.formats.parquet import floats, seconds
from ident.recordings.formats.text import read_text, without_comments
from ident.support.arrays import Array
from ident.support.errors import RecordingError
from ident.support.naming import one_line, shown

if TYPE_CHECKING:
    import pyarrow as pa

SEPARATORS = (",", ";", "\t", "|", " ")
_NUMBER = re.compile(r"[+-]?(?:(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|nan|inf(?:inity)?)", re.IGNORECASE)
_QUOTED = re.compile(r"[+-]?[0-9]+,[0-9]+(?:[eE][+-]?[0-9]+)?")
_LINE = re.compile(rb"[^\r\n]*")
_SIGN = re.compile(rb"(?<![eE0-9.])\+(?=[0-9.])")


@dataclass(frozen=True, slots=True)
class _Layout:
    """Layout of a text file.

    Attributes:
        header: Column names.
        separator: Separator of columns.
        decimal: Decimal sign.
        line: Number of lines before the first row.
        start: Position of the first row in the text [bytes].
    """

    header: list[str]
    separator: str
    decimal: str
    line: int
    start: int


_Wanted: TypeAlias = list[tuple[int, bool]]
"""Return the index of each column to be read, from 0, and whether it has dates."""


def read_csv(path: Path, request: Request) -> Columns:
    """Read the columns of a log.

    Raises:
        RecordingError: If the file is not text, has no header with the requested columns, or a cell is not a number;
            the message names line and column.
    """
    text = read_text(path, request.text.encoding)
    layout = _layout(path, text, request)
    chosen = request.chosen(path, layout.header)
    wanted = [(layout.header.index(name), name in chosen.dated) for name in chosen.names]
    rows = without_comments(text[layout.start :])
    values = _parsed(rows, layout, wanted)
    if values is None and layout.separator == " " and not chosen.dated:
        values = _spaced(rows, layout, wanted)
    if values is None:
        lines = [_tidy(line, layout) for line in rows.splitlines()]
        values = _parsed(b"\n".join(lines), layout, wanted)
        if values is None:
            values = _cell_by_cell(path, lines, layout, wanted)
    if not len(values[0]):
        raise RecordingError(f"{one_line(path)}: expected a header line and at least one row")
    return dict(zip(chosen.names, values, strict=True))


def _layout(path: Path, text: bytes, request: Request) -> _Layout:
    """Detect header, separator and decimal sign unless declared."""
    stated = request.text
    found = _header(path, text, request)
    start, line = found.start, found.line
    if stated.rows is not None:
        start, line = _start_of_line(path, text, stated.rows), stated.rows - 1
    rest = text[start : start + 10_000].split(b"\n")
    first = next((row for row in rest if row.split(b"#", 1)[0].strip()), b"")
    if not first and not without_comments(text[start:]).strip():
        raise RecordingError(f"{one_line(path)}: expected a header line and at least one row")
    cells = _split(_decoded(first.split(b"#", 1)[0].strip()), found.separator)
    quoted = len(cells) == len(found.header) and any(_QUOTED.fullmatch(cell) for cell in cells)
    decimal = "," if quoted or (found.separator != "," and b"," in first.split(b"#", 1)[0]) else "."
    return _Layout(found.header, found.separator, stated.decimal or decimal, line, start)


def _header(path: Path, text: bytes, request: Request) -> _Layout:
    """Return the header, or column numbers if declared to have none; the decimal sign is determined later."""
    stated = request.text
    position = 0 if not stated.header else _start_of_line(path, text, stated.header)
    number, commented, words = (stated.header or 1) - 1, "", ""
    while position < len(text):
        found = _LINE.match(text, position)
        assert found is not None, "an empty line matches too"
        number += 1
        start, position = position, _next_line(text, found.end())
        line = _decoded(found[0])
        words = line.strip().lstrip("#").strip() if stated.header else line.split("#", 1)[0].strip()
        if words:
            break
        if stated.header:
            raise RecordingError(f"{one_line(path)}: line {number}, declared as the header, is empty")
        commented = line.strip().lstrip("#").strip() or commented
    else:
        raise RecordingError(f"{one_line(path)}: expected a header line and at least one row")
    separator = stated.separator or max(SEPARATORS, key=lambda s: _numbers_in(words, s))
    counted = [str(k + 1) for k in range(len(_split(words, separator)))]
    by_number = stated.header is None and _split(words, separator) != counted and request.known(counted) > 1
    if stated.header == 0 or (by_number and _numbers_in(words, separator) == len(counted)):
        return _Layout(counted, separator, ".", number - 1, start)
    if stated.header is None and not _known(words, request):
        if _known(commented, request) > 1 and not re.search("[a-df-mo-zA-DF-MO-Z]", words):
            words, number, position = (
                commented,
                number - 1,
                start,
            )  # as written by numpy.savetxt: names are in a comment
        elif all(_NUMBER.fullmatch(w) for w in re.split(r"[\s;,|]+", words) if w):
            raise RecordingError(
                f"{one_line(path)}: line {number} has numbers where column names are expected; begin with t,q1,..,"
                'v1,.., or set header = "none" in a log description'
            )
    separator = stated.separator or max(SEPARATORS, key=lambda s: request.known(_split(words, s)))
    return _Layout(_split(words, separator), separator, ".", number, position)


def _start_of_line(path: Path, text: bytes, number: int) -> int:
    """Return the position of a line [bytes]."""
    position = 0
    for _ in range(number - 1):
        found = _LINE.match(text, position)
        assert found is not None, "an empty line matches too"
        position = _next_line(text, found.end())
        if position >= len(text):
            raise RecordingError(f"{one_line(path)}: has no line {number}")
    return position


def _next_line(text: bytes, end: int) -> int:
    return end + (2 if text[end : end + 2] == b"\r\n" else 1)


def _known(line: str, request: Request) -> int:
    """Return the number of requested names in a line, for any separator."""
    return max(request.known(_split(line, separator)) for separator in SEPARATORS)


def _numbers_in(line: str, separator: str) -> int:
    cells = _split(line, separator)
    return sum(bool(_NUMBER.fullmatch(cell.replace(",", ".", 1) if separator != "," else cell)) for cell in cells)


def _parsed(rows: bytes, layout: _Layout, wanted: _Wanted) -> list[Array] | None:
    """Return the requested columns, None if a row or cell is not valid, or without pyarrow."""
    try:
        import pyarrow as pa
    except ModuleNotFoundError:
        return None
    from pyarrow import csv

    names = [str(k) for k in range(len(layout.header))]
    kinds = {names[k]: pa.string() if dated else pa.float64() for k, dated in wanted}
    try:
        table = csv.read_csv(
            pa.py_buffer(rows),
            read_options=csv.ReadOptions(column_names=names, use_threads=False, block_size=1 << 22),
            parse_options=csv.ParseOptions(delimiter=layout.separator),
            convert_options=csv.ConvertOptions(
                column_types=kinds,
                include_columns=list(kinds),
                null_values=[],
                decimal_point=layout.decimal,
                check_utf8=False,
            ),
        )
        return [_dates(table[names[k]]) if dated else floats(table[names[k]]) for k, dated in wanted]
    except pa.ArrowInvalid:
        return None


def _number(cell: str, decimal: str) -> float | None:
    plain = cell.replace(",", ".", 1) if decimal == "," else cell
    return float(plain) if _NUMBER.fullmatch(plain) else None


def _date(cell: str) -> float | None:
    """Return seconds since 1970; a date without an offset is in UTC."""
    try:
        import pyarrow as pa
    except ModuleNotFoundError:
        try:
            found = datetime.fromisoformat(cell.replace(",", "."))
        except ValueError:
            return None
        return (found if found.tzinfo else found.replace(tzinfo=UTC)).timestamp()
    try:
        (seconds_since,) = _dates(pa.chunked_array([[cell]], pa.string())).tolist()
    except pa.ArrowInvalid:
        return None
    return None if math.isnan(seconds_since) else seconds_since


def _dates(cells: "pa.ChunkedArray") -> Array:
    """Return dates as seconds since 1970; those without an offset are in UTC.

    Raises:
        pyarrow.ArrowInvalid: If one cannot be read.
    """
    import pyarrow as pa
    import pyarrow.compute as pc

    cells = pc.replace_substring(pc.utf8_trim(cells, " \"'"), ",", ".")
    try:
        return seconds(cells.cast(pa.timestamp("ns")))
    except pa.ArrowInvalid:
        return seconds(cells.cast(pa.timestamp("ns", "UTC")))


def _spaced(rows: bytes, layout: _Layout, wanted: _Wanted) -> list[Array] | None:
    """Return columns separated by one or more spaces, if all are numeric."""
    numbers = io.BytesIO(rows.replace(b",", b".") if layout.decimal == "," else rows)
    try:
        values = np.loadtxt(numbers, ndmin=2)
    except ValueError:
        return None
    return [values[:, k] for k, _ in wanted] if values.shape[1] == len(layout.header) else None


def _tidy(line: bytes, layout: _Layout) -> bytes:
    """Return a row for the fast parser: single separators, none at the end, no plus signs."""
    separator = layout.separator.encode()
    line = _SIGN.sub(b"", line.strip(b" \t\f\v" if layout.separator != "\t" else b" "))
    if separator == b" ":
        line = b" ".join(line.split())
    if line.endswith(separator) and line.count(separator) == len(layout.header):
        line = line[:-1]
    return line if line.strip() else b""


def _cell_by_cell(path: Path, lines: list[bytes], layout: _Layout, wanted: _Wanted) -> list[Array]:
    """Return the requested columns without pyarrow, ten times slower.

    Raises:
        RecordingError: If a row or cell is not valid (the first one).
    """
    values: list[list[float]] = [[] for _ in wanted]
    for number, line in enumerate(lines, layout.line + 1):
        if not line:
            continue
        cells = _split(_decoded(line), layout.separator)
        for column, (k, dated) in zip(values, wanted, strict=True):
            cell = cells[k] if k < len(cells) else ""
            found = _date(cell) if dated else _number(cell, layout.decimal)
            if found is None and dated:
                raise RecordingError(
                    f"{one_line(path)}: line {number}, column {layout.header[k]}: {shown(cell)} is not a date in "
                    "ISO 8601, year first, such as 2031-07-19T09:41:07.125"
                )
            if found is None:
                raise RecordingError(
                    f"{one_line(path)}: line {number}, column {layout.header[k]}: {shown(cell)} is not a number"
                )
            column.append(found)
        if len(cells) != len(layout.header):
            hint = "; separate columns with ; where the decimal sign is a comma" if layout.separator == "," else ""
            count = f"{len(cells)} cells, but the header names {len(layout.header)}"
            raise RecordingError(f"{one_line(path)}: line {number} has {count}{hint}")
    return [np.array(column) for column in values]


def _split(line: str, separator: str) -> list[str]:
    if separator == " ":
        return [cell.strip("\"'") for cell in line.split()]
    cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True), []) if '"' in line else None
    return [cell.strip().strip("\"'").strip() for cell in cells or line.split(separator)]


def _decoded(line: bytes) -> str:
    try:
        return line.decode()
    except UnicodeDecodeError:
        return line.decode("latin-1")


CSV = LogFormat((".csv", ".tsv", ".txt", ".gz"), read_csv)
