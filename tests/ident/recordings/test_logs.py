"""Doors for logs: the same numbers, however a file is laid out."""

import gzip
import re
import zlib
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from ident.recordings.description import LogDescription
from ident.recordings.files import read_recording
from ident.recordings.formats import LOGS, csv
from ident.recordings.formats.table import MOST_COLUMNS, LogFormat, Table
from ident.recordings.layouts import resolved
from ident.recordings.recording import Recording
from ident.support.errors import RecordingError

T = 0.01 * np.arange(30)
Q = np.column_stack((np.sin(3.0 * T), -0.7 * np.cos(2.0 * T)))
V = np.column_stack((1.3 * np.cos(5.0 * T), np.sin(4.0 * T) + 0.2))


def rows(separator: str = ",", decimal: str = ".", header: str = "t q1 q2 v1 v2", form: str = "%.17g") -> str:
    lines = [separator.join(header.split())]
    lines += [
        separator.join((form % x).replace(".", decimal) for x in row) for row in np.column_stack((T, Q, V)).tolist()
    ]
    return "\n".join(lines) + "\n"


HEADER, BODY = rows().split("\n", 1)
LAYOUTS = {
    "commas": rows(),
    "semicolons": rows(";"),
    "tabs": rows("\t"),
    "bars": rows("|"),
    "a space": rows(" "),
    "several spaces": rows("   "),
    "columns of equal width": rows(" ", form="%25.17g"),
    "commas and spaces": rows(", "),
    "decimal commas": rows(";", ","),
    "decimal commas and tabs": rows("\t", ","),
    "decimal commas and spaces": rows("  ", ","),
    "UTF-16": rows().encode("utf-16"),
    "UTF-16, big end first": b"\xfe\xff" + rows().encode("utf-16-be"),
    "UTF-32": rows().encode("utf-32"),
    "UTF-8 with a mark": rows().encode("utf-8-sig"),
    "latin-1": "# Größe\n".encode("latin-1") + rows().encode(),
    "latin-1 in another column": (HEADER + ",größe\n" + BODY.replace("\n", ",ü\n")).encode("latin-1"),
    "lines of Windows": rows().replace("\n", "\r\n"),
    "lines of an old Mac": rows().replace("\n", "\r"),
    "quoted names": rows().replace("t,q1", '"t", " q1 "'),
    "quoted numbers": HEADER + '\n"' + BODY.replace(",", '","').replace("\n", '"\n"').removesuffix('"'),
    "a comma at every end": rows().replace("\n", ",\n"),
    "a comma at the end of every row": HEADER + "\n" + BODY.replace("\n", ",\n"),
    "signs": rows(form="%+.17g"),
    "signs, and a comma at every end": rows(form="%+.17g").replace("\n", ",\n"),
    "names in a comment": "# " + rows(),
    "names in a comment, spaces": "# " + rows(" "),
    "a remark before names in a comment": "# cell 4\n# " + rows(),
    "blank lines": rows().replace("\n", "\n  \n"),
    "comments": rows().replace("\n", " # x\n"),
    "gzip": gzip.compress(rows().encode()),
    "two gzip members": gzip.compress(rows()[:300].encode()) + gzip.compress(rows()[300:].encode()),
    "gzip of UTF-16": gzip.compress(rows().encode("utf-16")),
    "words beside": HEADER + ",mode\n" + BODY.replace("\n", ",auto\n"),
    "words beside, spaces": HEADER.replace(",", " ") + " mode\n" + BODY.replace(",", " ").replace("\n", " auto\n"),
    "no last line end": rows()[:-1],
}  # fmt: skip


@pytest.mark.parametrize("name", LAYOUTS)
def test_a_text_log_keeps_every_digit_whatever_its_layout(tmp_path, name):
    content = LAYOUTS[name]
    path = tmp_path / "log.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    recording = read_recording(path)
    for found, expected in ((recording.t, T), (recording.q, Q), (recording.v, V)):
        np.testing.assert_array_equal(found, expected)


TYPES = {
    "float32": (pa.float32(), np.float32),
    "float16": (pa.float16(), np.float16),
    "int32": (pa.int32(), np.int32),
    "uint8": (pa.uint8(), np.uint8),
}


@pytest.mark.parametrize("kind", TYPES)
def test_numbers_of_any_type_are_read_from_parquet(tmp_path, kind):
    arrow, numpy = TYPES[kind]
    v = (100.0 + 50.0 * np.sin(40.0 * T)).astype(numpy)
    pq.write_table(pa.table({"t": T, "q1": Q[:, 0], "v1": pa.array(v, arrow)}), tmp_path / "log.parquet")
    np.testing.assert_array_equal(read_recording(tmp_path / "log.parquet").v[:, 0], v.astype(np.float64))


def test_decimals_and_dictionaries_are_read_from_parquet(tmp_path):
    decimal = pa.array([round(x, 4) for x in V[:, 0].tolist()]).cast(pa.decimal128(12, 4), safe=False)
    coded = pa.array(np.round(V[:, 1], 1)).dictionary_encode()
    table = pa.table({"t": T, "q1": Q[:, 0], "q2": Q[:, 1], "v1": decimal, "v2": coded, "note": [{"a": "x"}] * len(T)})
    pq.write_table(table, tmp_path / "log.parquet")
    recording = read_recording(tmp_path / "log.parquet")
    np.testing.assert_allclose(recording.v[:, 0], V[:, 0], atol=1.01e-4)  # four digits, cut or rounded
    np.testing.assert_array_equal(recording.v[:, 1], np.round(V[:, 1], 1))


def test_a_new_format_is_found_by_the_ending_of_a_file(tmp_path, monkeypatch):
    def opened(path: Path, description: LogDescription) -> Table:
        assert path.read_text() == "whatever"
        table = {"t": T, "q1": Q[:, 0], "v1": V[:, 0], "more": V[:, 1]}
        return Table(list(table), lambda names, dated: {name: table[name] for name in names})

    monkeypatch.setitem(LOGS, "mine", LogFormat((".mine",), opened))
    (tmp_path / "log.MINE").write_text("whatever")
    assert isinstance(read_recording(tmp_path / "log.MINE"), Recording)


@pytest.mark.parametrize("name", LOGS)
@pytest.mark.parametrize(
    "content", [None, b"", b"\x01\x02\x00 no log of any kind \xff\n"], ids=["missing", "empty", "other"]
)
def test_a_file_that_a_format_cannot_read_is_named_in_one_line(tmp_path, name, content):
    for ending in LOGS[name].endings:
        assert ending == ending.lower()
        path = tmp_path / f"log{ending}"
        if content is not None:
            path.write_bytes(content)
        with pytest.raises(RecordingError, match=rf"^{re.escape(str(path))}: [^\n]+$"):
            LOGS[name].open(path, LogDescription())


def test_the_ending_of_a_name_belongs_to_one_format():
    endings = [ending for log in LOGS.values() for ending in log.endings]
    assert len(set(endings)) == len(endings)


def test_columns_are_refused_just_above_their_number():
    names = ["t", "q1", "v1", *(f"c{k}" for k in range(MOST_COLUMNS - 3))]
    resolved(Path("x"), names, LogDescription())
    with pytest.raises(RecordingError, match="10001 columns; files of up to 10000 are read"):
        resolved(Path("x"), [*names, "c"], LogDescription())


def test_names_that_only_look_like_ours_are_left_alone():
    found = ["t", "q1", "v1", "Q1", "V", "q01", "q1_ref", "i1", "qd1", "v12345", "time"]
    assert resolved(Path("x"), found, LogDescription()).description.names == ("t", "q1", "v1")


def test_a_parquet_file_of_too_many_numbers_is_not_read(tmp_path, monkeypatch):
    pq.write_table(pa.table({"t": T, "q1": Q[:, 0], "v1": V[:, 0]}), tmp_path / "log.parquet")
    monkeypatch.setattr("ident.recordings.formats.parquet.MOST_VALUES", 90)
    read_recording(tmp_path / "log.parquet")
    monkeypatch.setattr("ident.recordings.formats.parquet.MOST_VALUES", 89)
    with pytest.raises(RecordingError, match="30 rows of 3 columns; up to 89 numbers are read, take a part"):
        read_recording(tmp_path / "log.parquet")


@pytest.mark.parametrize("packed", [False, True])
def test_text_is_read_up_to_its_largest_size_packed_or_not(tmp_path, monkeypatch, packed):
    content = rows().encode()
    path = tmp_path / "log.csv"
    path.write_bytes(gzip.compress(content) if packed else content)
    monkeypatch.setattr(csv, "LARGEST", len(content))
    read_recording(path)
    monkeypatch.setattr(csv, "LARGEST", len(content) - 1)
    with pytest.raises(RecordingError, match="unpacked; take a part of it" if packed else "MB are too much"):
        read_recording(path)


def test_a_header_alone_and_a_remark_alone_are_not_a_log(tmp_path):
    path = tmp_path / "log.csv"
    for content in ("t,q1,v1\n", "t,q1,v1\n# end\n\n", "# t,q1,v1\n", "\n\n"):
        path.write_text(content)
        with pytest.raises(RecordingError, match="expected a header line and at least one row"):
            read_recording(path)


def test_the_line_of_a_fault_counts_comments_and_blank_lines(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("# a\n\nt,q1,v1\n# b\n0,1,2\n\n0.1,x,2\n")
    with pytest.raises(RecordingError, match="line 7, column q1: 'x' is not a number"):
        read_recording(path)
    path.write_text("# a\n# t,q1,v1\n0,1,2\n\n0.1,x,2\n")
    with pytest.raises(RecordingError, match="line 5, column q1: 'x' is not a number"):
        read_recording(path)


@pytest.mark.parametrize("between", [b"", b"\0\0\0"])
def test_packed_files_one_after_the_other_are_read_to_the_end(tmp_path, between):
    # As `cat a.gz b.gz` makes them, and as tapes and disks pad them.
    path, text = tmp_path / "two.csv.gz", rows().encode()
    cut = text.index(b"\n", len(text) // 3) + 1
    path.write_bytes(gzip.compress(text[:cut]) + between + gzip.compress(text[cut:]) + between)
    np.testing.assert_array_equal(read_recording(path).q, Q)


def test_what_follows_a_packed_log_and_is_no_gzip_is_refused(tmp_path):
    path, text = tmp_path / "two.csv.gz", rows().encode()
    cut = text.index(b"\n", len(text) // 3) + 1
    path.write_bytes(gzip.compress(text[:cut]) + zlib.compress(text[cut:]))
    with pytest.raises(RecordingError, match=r"two\.csv\.gz: not a readable gzip file"):
        read_recording(path)
