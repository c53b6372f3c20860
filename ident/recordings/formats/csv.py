"""Logs in text files: a header line with the column names, one row per sample; also gzipped.

Columns are separated by commas, semicolons, tabs, bars or spaces, whichever gives the most of the requested names in
the header, or the most numbers without a header. The decimal sign may be a comma unless that separates columns. A `#`
starts a comment.
"""

import csv
import gzip
import io
import re
from array import array
from collections.abc import Iterable, Sequence, Set
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from ident.recordings.description import LogDescription
from ident.recordings.formats import KNOWN, OURS, Columns, LogFormat, Table, check_unpacked, listed, merged, readable
from ident.support.errors import RecordingError
from ident.support.files import read_bytes
from ident.support.naming import shown

LARGEST = 500_000_000
"""Largest size of a text [bytes]: two million samples of six joints with all digits."""
NO_ROW = "expected a header line and at least one row"
SEPARATORS = (",", ";", "\t", "|", " ")
MARKS = {b"\xff\xfe\x00\x00": "utf-32", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16", b"\xef\xbb\xbf": "utf-8"}
"""Byte order marks; spreadsheets write them."""
BINARY = {
    b"\x89HDF\r\n\x1a\n": "an HDF5 file; name it .h5", b"MATLAB ": "a MATLAB file; name it .mat",
    b"{": "JSON; name it .jsonl if each line is an object", b"<": "XML; write a table with a row for each sample",
}  # fmt: skip
"""First bytes of formats that are no tables, or are known by the ending of the name."""
_CONTROL = re.compile(rb"[\x00-\x08\x0e-\x1f]")
_NUMBER = re.compile(r"[+-]?(?:(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|nan|inf(?:inity)?)", re.IGNORECASE)
_WORDS = re.compile("[a-df-mo-zA-DF-MO-Z]")
"""Letters that a number has not."""
_QUOTED = re.compile(r"[+-]?[0-9]+,[0-9]+(?:[eE][+-]?[0-9]+)?")


def open_csv(path: Path, description: LogDescription) -> Table:
    """Find header, separator and decimal sign of a text, unless declared; raises `RecordingError` if it has none."""
    stated = description.text
    lines = _lines(path, stated.encoding)
    header, separator, start = _header(lines, description)
    if stated.rows is not None:
        start = stated.rows - 1
        if start >= len(lines):
            raise RecordingError(f"has no line {stated.rows}")
    time = description.t.columns[0] if len(description.t.columns) == 1 else "t"
    if stated.series is not None:
        rows = (_split(row, separator) for row in map(_plain, lines[start:]) if row)
        (header, lines), separator, start = _unstacked(header, rows, time, stated.series), "\t", 0
    first = next((row for row in map(_plain, lines[start:]) if row), None)
    if first is None:
        raise RecordingError(NO_ROW)
    cells = _split(first, separator)
    quoted = len(cells) == len(header) and any(map(_QUOTED.fullmatch, cells))
    decimal = stated.decimal or ("," if quoted or (separator != "," and "," in first) else ".")

    clocks = [k for k, name in enumerate(header) if name == time]  # a scope has one for each channel
    names_once = [name for k, name in enumerate(header) if name != time or k == clocks[0]]

    def load(names: Sequence[str], dated: Set[str]) -> Columns:
        places = {name: header.index(name) for name in names}
        clock = (
            {name: max((each for each in clocks if each <= k), default=clocks[0]) for name, k in places.items()}
            if len(clocks) > 1
            else {}
        )
        used = list(dict.fromkeys((*places.values(), *clock.values())))
        wanted = [(_date if header[k] in dated else float, k) for k in used]
        values, at = array("d"), header.index(time) if stated.series is not None else None
        for number, line in enumerate(lines[start:], start + 1):
            if "#" in line:
                line = _plain(line)
            line = line.strip(" \r" if separator == "\t" else None)
            if not line:
                continue
            cells = _split(line, separator)
            if len(cells) == len(header) + 1 and not cells[-1]:
                cells.pop()
            if len(cells) != len(header):
                hint = "; separate columns with ; where the decimal sign is a comma"
                raise RecordingError(
                    f"line {number} has {len(cells)} cells, but the header names {len(header)}"
                    f"{hint if separator == ',' and len(cells) > len(header) else ''}"
                )
            place = f"line {number}" if at is None else f"{time} = {cells[at]}"
            for read, k in wanted:
                cell = cells[k].replace(",", ".", 1) if decimal == "," else cells[k]
                try:
                    values.append(read(cell.replace("_", "x")) if cell else np.nan)  # _: digits in Python alone
                except ValueError:
                    dates = "a date in ISO 8601, year first, such as 2031-07-19T09:41:07.125"
                    raise RecordingError(
                        f"{place}, column {header[k]}: {shown(cells[k])} is not "
                        f"{dates if read is _date else 'a number'}"
                    ) from None
        found = dict(zip(used, np.ascontiguousarray(np.reshape(values, (-1, len(used))).T), strict=True))
        columns = {name: found[k] for name, k in places.items()}
        if time in columns and (clock or any(np.isnan(x).any() for x in columns.values())):
            times = {name: found[clock[name]] if clock else columns[time] for name in names}
            return merged(columns, times, time, remarks)
        return columns

    remarks = list[str]()
    return Table(names_once, load, notes=remarks)


def _unstacked(header: list[str], rows: Iterable[list[str]], time: str, series: str) -> tuple[list[str], list[str]]:
    """Return header and tab-separated lines, one for each time, of a table whose rows name their series."""
    if lost := next((name for name in (time, series) if name not in header), None):
        raise RecordingError(f"no column {shown(lost)}; found {listed(header)}")
    at, by, wide = header.index(time), header.index(series), dict[str, dict[str, str]]()
    for cells in rows:
        if len(cells) != len(header):
            raise RecordingError(f"a row has {len(cells)} cells, but the header names {len(header)}: {listed(cells)}")
        row = wide.setdefault(cells[at], {time: cells[at]})
        named = {f"{header[k]}[{cells[by]}]": cell for k, cell in enumerate(cells) if k not in (at, by)}
        if named.keys() & row.keys():
            raise RecordingError(f"two rows of {shown(cells[by])} have {time} = {cells[at]}; keep one of them")
        row |= named
    names, ordered = list(dict.fromkeys(name for row in wide.values() for name in row)), list(wide.values())
    with suppress(ValueError):  # which is refused where it is read
        ordered.sort(key=lambda row: float(row[time].replace(",", ".", 1)))
    return names, ["\t".join(row.get(name, "") for name in names) for row in ordered]


def _date(cell: str) -> float:
    """Return seconds since 1970; a date without an offset is in UTC."""
    found = datetime.fromisoformat(cell)
    return (found if found.tzinfo else found.replace(tzinfo=UTC)).timestamp()


def _header(lines: list[str], description: LogDescription) -> tuple[list[str], str, int]:
    """Return names of columns, separator, and the number of lines before the first row."""
    stated, joints = description.text, description.joints or ("",)
    declared = {name.replace("{joint}", joint) for name in description.names for joint in joints}

    def known(line: str, separator: str) -> int:
        names = _split(line, separator)
        return sum(name in declared or name in KNOWN or bool(OURS.fullmatch(name.lower())) for name in names)

    def numeric(line: str, separator: str) -> int:
        cells = _split(line if separator == "," else line.replace(",", "."), separator)
        return sum(bool(_NUMBER.fullmatch(cell)) for cell in cells)

    number, words, comment = (stated.header or 1) - 1, "", ""
    if stated.header:
        if number >= len(lines):
            raise RecordingError(f"has no line {stated.header}")
        words = lines[number].strip().lstrip("#").strip()
        if not words:
            raise RecordingError(f"line {number + 1}, declared as the header, is empty")
    while not words:
        if number == len(lines):
            raise RecordingError(NO_ROW)
        words = _plain(lines[number])
        if not words:
            comment = lines[number].strip().lstrip("#").strip() or comment
            number += 1
    separator = stated.separator or max(SEPARATORS, key=lambda each: numeric(words, each))
    counted = [str(k + 1) for k in range(len(_split(words, separator)))]
    by_number = stated.header is None and len(declared & set(counted)) > 1 and _split(words, separator) != counted
    if stated.header == 0 or (by_number and numeric(words, separator) == len(counted)):
        return counted, separator, number
    if stated.header is None and not any(known(words, each) for each in SEPARATORS):
        if max(known(comment, each) for each in SEPARATORS) > 1 and not _WORDS.search(words):
            words, number = comment, number - 1  # as written by numpy.savetxt
        elif all(_NUMBER.fullmatch(each) for each in re.split(r"[\s;,|]+", words) if each):
            raise RecordingError(
                f"line {number + 1} has numbers where column names are expected; begin with t,q1,..,v1,.., or "
                'set header = "none" in a log description'
            )
    separator = stated.separator or max(SEPARATORS, key=lambda each: known(words, each))
    return _split(words, separator), separator, number + 1


def _plain(line: str) -> str:
    """Return a line without its comment."""
    return line.partition("#")[0].strip()


def _split(line: str, separator: str) -> list[str]:
    if '"' in line and separator != " " and len(line) < csv.field_size_limit():
        (cells,) = csv.reader([line], delimiter=separator, skipinitialspace=True)
        return [cell.strip().strip("'") for cell in cells]
    cells = line.split() if separator == " " else [cell.strip() for cell in line.split(separator)]
    return [cell.strip("\"'") for cell in cells] if '"' in line or "'" in line else cells


def _lines(path: Path, encoding: str | None) -> list[str]:
    """Return the lines of a text, in its declared encoding, that of its byte order mark, UTF-8, or else Latin-1."""
    content = read_bytes(path, most_bytes=LARGEST, error=RecordingError)
    if content.startswith(b"\x1f\x8b"):
        with readable("a readable gzip file"):
            check_unpacked(gzip.GzipFile(fileobj=io.BytesIO(content)), LARGEST)
            content = gzip.decompress(content)
    kind = next((name for start, name in BINARY.items() if content.startswith(start)), None)
    if kind is not None:
        raise RecordingError(kind)
    marked = next((name for mark, name in MARKS.items() if content.startswith(mark)), None)
    if encoding is None and marked is None and _CONTROL.search(content[:100_000]):
        hint = "is it UTF-16? save it as UTF-8" if 2 * content[:100].count(0) >= len(content[:100]) - 1 else ""
        raise RecordingError(f"not a text file; {hint or 'expected CSV, or a name ending in .parquet'}")
    try:
        text = content.decode(encoding or marked or "utf-8")
    except UnicodeError as error:
        if encoding or marked:
            where = f" at byte {error.start}" if isinstance(error, UnicodeDecodeError) else ""
            raise RecordingError(f"broken {(encoding or marked or '').upper()}{where}") from error
        text = content.decode("latin-1")
    return text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n").split("\n")


CSV = LogFormat((".csv", ".tsv", ".txt", ".gz"), open_csv)
