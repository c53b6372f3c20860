"""Logs as text: the same numbers whatever the layout, and one line for what is wrong."""

import gzip
import re
import time
import zlib
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from foreign_logs import DESCRIPTION, Q, T, V, assert_same, channels, csv, table, unread

from ident.recordings.description import LogDescription, TextLayout, described
from ident.recordings.files import read_recording
from ident.recordings.formats.csv import LARGEST


def rows(separator: str = ",", decimal: str = ".", form: str = "%.17g") -> str:
    lines = [separator.join(["t", "q1", "q2", "q3", "v1", "v2", "v3"])]
    numbers = np.column_stack((T, Q, V)).tolist()
    lines += [separator.join((form % x).replace(".", decimal) for x in row) for row in numbers]
    return "\n".join(lines) + "\n"


HEADER, BODY = rows().split("\n", 1)
LAYOUTS = {
    "commas": rows(),
    "tabs": rows("\t"),
    "a space": rows(" "),
    "columns of equal width": rows(" ", form="%25.17g"),
    "decimal commas": rows(";", ","),
    "decimal commas and spaces": rows("  ", ","),
    "UTF-16": rows().encode("utf-16"),
    "UTF-16, big end first": b"\xfe\xff" + rows().encode("utf-16-be"),
    "UTF-8 with a mark": rows().encode("utf-8-sig"),
    "latin-1 in another column": (HEADER + ",größe\n" + BODY.replace("\n", ",ü\n")).encode("latin-1"),
    "lines of Windows": rows().replace("\n", "\r\n"),
    "lines of an old Mac": rows().replace("\n", "\r"),
    "quoted names": rows().replace("t,q1", '"t", " q1 "'),
    "quoted numbers": HEADER + '\n"' + BODY.replace(",", '","').replace("\n", '"\n"').removesuffix('"'),
    "quoted decimal commas": HEADER + '\n"' + BODY.replace(",", '","').replace(".", ",").replace("\n", '"\n"')[:-1],
    "a comma at every end": rows().replace("\n", ",\n"),
    "a comma at the end of every row": HEADER + "\n" + BODY.replace("\n", ",\n"),
    "names in a comment": "# " + rows(),
    "names in a comment, spaces": "# cell 4\n# " + rows(" "),
    "blank lines and comments": "# a\n" + rows().replace("\n", " # x\n  \n"),
    "gzip": gzip.compress(rows().encode()),
    "two gzip members, padded": gzip.compress(rows()[:300].encode()) + b"\0\0" + gzip.compress(rows()[300:].encode()),
    "words beside": HEADER + ",mode\n" + BODY.replace("\n", ",auto\n"),
    "words beside, spaces": HEADER.replace(",", " ") + " mode\n" + BODY.replace(",", " ").replace("\n", " auto\n"),
}


def test_a_text_log_keeps_every_digit_whatever_its_layout(tmp_path):
    path = tmp_path / "log.csv"
    for name, content in LAYOUTS.items():
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        recording = read_recording(path)
        for found, expected in ((recording.t, T), (recording.q, Q), (recording.v, V)):
            np.testing.assert_array_equal(found, expected, err_msg=name)


FAULTS = {
    "t,q1,v1\n0,1,2\n0.1,abc,3\n": "line 3, column q1: 'abc' is not a number",
    "t,q1,v1\n0,1,2\n0.1,1_5,3\n": "line 3, column q1: '1_5' is not a number",
    "t,q1,v1\n0,1,2\n0.1,,3\n": "column q1: it has fewer than two values",
    "t,q1,v1\n0,1,2\n0.1,1.5\n": "line 3 has 2 cells, but the header names 3$",
    "t,q1,v1\n0,1,2\n0.1,1.5,2,7\n": "line 3 has 4 cells, but the header names 3; separate columns with ;",
    "t;q1;v1\n0,5;1;2\n1.000,5;2;3\n": r"line 3, column t: '1\.000,5' is not a number",
    "# a\n\nt,q1,v1\n# b\n0,1,2\n\n0.1,x,2\n": "line 7, column q1: 'x' is not a number",
    "# a\n# t,q1,v1\n0,1,2\n\n0.1,x,2\n": "line 5, column q1: 'x' is not a number",
    "t,q1,v1\n": "expected a header line and at least one row",
    "t,q1,v1\n# end\n\n": "expected a header line and at least one row",
    "# t,q1,v1\n": "expected a header line and at least one row",
    't,"' + 200_000 * "q" + "\n0,1\n": "not of a known layout.*found t, q",
    "0,1,2\n1,2,4\n": 'line 1 has numbers where .*, or set header = "none"',
}


def test_a_faulty_text_is_one_line_that_names_file_and_line(tmp_path):
    path = tmp_path / "log.csv"
    for text, message in FAULTS.items():
        path.write_text(text)
        assert unread(message, path).startswith(f"{path}: ")


DATES = {
    "T": ("T09:41:07.", ""),
    "a space": (" 09:41:07.", ""),
    "UTC": ("T09:41:07.", "Z"),
    "an offset": ("T11:41:07.", "+02:00"),
    "nanoseconds": ("T09:41:07.", "000"),
    "a comma": ("T09:41:07,", ""),
}


@pytest.mark.parametrize("form", DATES)
def test_dates_are_seconds_since_1970_on_any_computer(tmp_path, form, monkeypatch):
    start, (head, tail) = datetime(2031, 7, 19, 9, 41, 7, 125000, tzinfo=UTC), DATES[form]
    stamps = [f"2031-07-19{head}{125000 + 4000 * k:06d}{tail}" for k in range(len(T))]
    rows = zip(stamps, Q[:, 0].tolist(), V[:, 0].tolist(), strict=True)
    text = "\n".join(["time;a;x", *(f"{stamp};{a!r};{x!r}" for stamp, a, x in rows)])
    path = tmp_path / "log.csv"
    path.write_text(text.replace(".", ",") if form == "a comma" else text)
    description = replace(described(["t=time[iso]", "q=a[rad]", "v=x[A]"]), signal="current")
    monkeypatch.setenv("TZ", "JST-9")  # dates without an offset are none of this clock's
    time.tzset()
    found = read_recording(path, description).t
    monkeypatch.undo()
    time.tzset()
    expected = [(start + timedelta(microseconds=4000 * k)).timestamp() for k in range(len(T))]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=5e-7)  # float64 has 2.4e-7 s in 2031
    path.write_text(text.replace("137000", "x", 1))
    unread(r"line 5, column time: '2031-07-19.*' is not a date in ISO 8601", path, description)


def test_a_log_without_header_has_columns_by_number(tmp_path):
    order = ["time", "a", "b", "c", "x", "y", "z"]
    description = replace(described(["t=1[s]", "q={2..4}[rad]", "v={5..7}[A]"]), signal="current")
    declared = replace(description, text=TextLayout(header=0))
    for separator in (",", ";", "\t", " "):
        path = csv(tmp_path / "log.csv", {name: table()[name] for name in order}, separator, header=False)
        assert_same(read_recording(path, declared))
        assert_same(read_recording(path, description))
    path.write_text(path.read_text().replace(".", ",").replace(" ", ";"))
    assert_same(read_recording(path, declared))
    unread("no column '8'", path, replace(declared, v=replace(declared.v, columns=("5", "6", "8"))))


def test_header_and_first_row_may_stand_anywhere(tmp_path):
    path = csv(tmp_path / "log.csv", table())
    header, body = path.read_text().split("\n", 1)
    path.write_text(f"Scope export\nserial 7\n\n{header}\nA,-,rad,A,s,rad,rad,A\n\n{body}")
    description = replace(DESCRIPTION, text=TextLayout(header=4, rows=7))
    assert_same(read_recording(path, description))
    for layout, message in {
        TextLayout(header=4): "line 5, column time: 's' is not a number",
        TextLayout(header=3): "line 3, declared as the header, is empty",
        TextLayout(header=4444): "has no line 4444",
        TextLayout(header=4, rows=4444): "has no line 4444",
    }.items():
        unread(message, path, replace(DESCRIPTION, text=layout))
    path.write_text(path.read_text().replace(f"{T[5]:.17g}", "broken", 1))
    unread("line 12, column time: 'broken' is not a number", path, description)


def test_separator_decimal_sign_and_encoding_may_be_declared(tmp_path):
    names = {"a": "Gelenk 1, °", "b": "Gelenk 2, °", "c": "Gelenk 3, °"}
    path = csv(tmp_path / "log.csv", {names.get(name, name): value for name, value in table().items()}, "!")
    text = path.read_text().replace(".", ",")
    description = channels("q", columns=tuple(names.values()))
    for encoding in ("cp1252", "utf-16-le", "utf-8"):
        path.write_bytes(text.encode(encoding))
        layout = TextLayout(separator="!", decimal=",", encoding=encoding)
        assert_same(read_recording(path, replace(description, text=layout)))
    path.write_bytes(b"\xff\xfe" + text.encode("utf-16-le")[:-1])
    unread("broken UTF-16 at byte", path, description)
    path.write_text(text, encoding="latin-1")
    unread("broken UTF-8 at byte", path, replace(description, text=TextLayout(separator="!", encoding="utf-8")))
    path.write_text("t;q1;v1\n0;0;4\n" + "".join(f"0,{k:02d};{k * k},5;{k % 3}\n" for k in range(1, 9)))
    assert read_recording(path, LogDescription(text=TextLayout(decimal=","))).q[4, 0] == 16.5
    path.write_text("".join(f"0,{k:02d} {k},5 {k % 3}\n" for k in range(9)))  # two commas, two spaces
    spaced = replace(described(["t=1[s]", "q=2[rad]", "v=3[A]"]), signal="current")
    found = read_recording(path, replace(spaced, text=TextLayout(header=0, separator=" ")))
    assert found.q[:, 0].tolist() == [k + 0.5 for k in range(9)]


@pytest.mark.parametrize("packed", [False, True])
def test_text_is_read_up_to_its_largest_size_packed_or_not(tmp_path, monkeypatch, packed):
    content, path = rows().encode(), tmp_path / "log.csv"
    path.write_bytes(gzip.compress(content) if packed else content)
    monkeypatch.setattr("ident.recordings.formats.csv.LARGEST", len(content))
    read_recording(path)
    monkeypatch.setattr("ident.recordings.formats.csv.LARGEST", len(content) - 1)
    unread("unpacked; take a part of it" if packed else "MB are too much", path)
    assert 10 * len(content) < LARGEST


def test_what_is_no_text_or_no_gzip_is_named(tmp_path):
    path, text = tmp_path / "two.csv.gz", rows().encode()
    contents = {
        gzip.compress(text[:300]) + zlib.compress(text[300:]): "not a readable gzip file",
        gzip.compress(text)[:-30]: "not a readable gzip file",
        bytes(range(256)): "not a text file; expected CSV",
        b"\x89HDF\r\n\x1a\n" + bytes(90): "an HDF5 file; name it .h5",
        b"MATLAB 5.0 MAT-file" + bytes(109): "a MATLAB file; name it .mat",
        text.decode().encode("utf-16-le"): r"not a text file; is it UTF-16\?",
    }
    for content, message in contents.items():
        path.write_bytes(content)
        unread(rf"^{re.escape(str(path))}: {message}", path)


LONG = replace(
    described(["t=ts[s]", "q=pos[{joint}][rad]", "v=cur[{joint}][A]"]), signal="current", joints=("a", "b", "c"),
    text=TextLayout(series="who"),
)  # fmt: skip


def long_table(separator: str, decimal: str) -> str:
    rows = [("who", "cur", "ts", "pos")]
    for k, t in enumerate(T):
        rows += [("c" if j == 2 else "ab"[j], f"{V[k, j]:.17g}", f"{t:.17g}", f"{Q[k, j]:.17g}") for j in (2, 0, 1)]
    return "\n".join(separator.join(row).replace(".", decimal) for row in rows)


def test_a_long_table_has_a_row_for_each_joint_and_time(tmp_path):
    path = tmp_path / "log.csv"
    for separator, decimal in ((",", "."), (";", ",")):
        head, *lines = long_table(separator, decimal).split("\n")
        path.write_text("\n".join([head, *lines[::-1]]))  # in any order
        assert_same(read_recording(path, LONG))
    names, signals = ["a", "b", "c"], ["at signal is"]
    for k, j in np.ndindex(len(T), 3):
        signals += [f"{T[k]:.17g} {names[j]}.{kind} {x[k, j]:.17g}" for kind, x in (("q", Q), ("v", V))]
    path.write_text("\n".join(signals))
    of_signals = described(["t=at[s]", "q=is[{joint}.q][rad]", "v=is[{joint}.v][A]"])
    text = TextLayout(series="signal")
    assert_same(read_recording(path, replace(of_signals, signal="current", joints=tuple(names), text=text)))


def test_a_long_table_that_is_none_is_refused_with_the_row(tmp_path):
    path, lines = tmp_path / "log.csv", long_table(",", ".").split("\n")
    for wrong, said in (
        (["who,cur,ts,pos", "a,1,0.5,2", "a,1,0.5,3"], "two rows of 'a' have ts = 0.5"),
        ([*lines[:4], "a,1"], "a row has 2 cells, but the header names 4: a, 1"),
        (["whose,cur,ts,pos", *lines[1:]], "no column 'who'; found whose, cur, ts, pos"),
        ([line for line in lines if line[0] != "b"], r"log.csv: no pos of 'b'; found those of c, a$"),
        ([*lines[:-2], "a,3,1e2,1_3"], r"log.csv: ts = 1e2, column pos\[a\]: '1_3' is not a number"),
    ):
        path.write_text("\n".join(wrong))
        unread(said, path, LONG)
