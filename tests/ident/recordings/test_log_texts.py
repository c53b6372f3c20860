"""Foreign logs as text: dates, headers, separators, decimal signs and encodings."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from foreign_logs import DESCRIPTION, Q, T, V, assert_same, channels, csv, table

from ident.recordings.description import Channels, LogDescription, TextLayout
from ident.recordings.description_files import described
from ident.recordings.files import read_recording
from ident.support.errors import RecordingError

DATES = {
    "T": "2031-07-19T09:41:07.125000",
    "a space": "2031-07-19 09:41:07.125000",
    "UTC": "2031-07-19T09:41:07.125000Z",
    "an offset": "2031-07-19T11:41:07.125000+02:00",
    "nanoseconds": "2031-07-19T09:41:07.125000000",
}


@pytest.mark.parametrize("form", DATES)
@pytest.mark.parametrize("separator", [",", ";"])
def test_dates_are_seconds_since_1970(tmp_path, form, separator):
    start = datetime(2031, 7, 19, 9, 41, 7, 125000, tzinfo=UTC)
    head, microseconds = DATES[form].split(".")[0], DATES[form].split(".")[1].lstrip("0123456789")
    more = "000" if form == "nanoseconds" else ""
    lines = [separator.join(("time", "a", "x"))]
    for k in range(len(T)):
        text = head + f".{125000 + 4000 * k:06d}" + more + microseconds
        lines.append(separator.join((text, repr(float(Q[k, 0])), repr(float(V[k, 0])))))
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines))
    description = LogDescription(
        signal="current",
        t=Channels(columns=("time",), unit=("iso",)),
        q=Channels(columns=("a",), unit=("rad",)),
        v=Channels(columns=("x",), unit=("A",)),
    )
    found = read_recording(path, description).t
    expected = [(start + timedelta(microseconds=4000 * k)).timestamp() for k in range(len(T))]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=5e-7)  # float64 has 2.4e-7 s in 2031
    path.write_text("\n".join(lines).replace(f"{137000:06d}", "x", 1))
    with pytest.raises(
        RecordingError,
        match=r"line 5, column time: '2031-07-19.*' is not a date in ISO 8601, year first, .* 2031-07",
    ):
        read_recording(path, description)


def test_dates_with_decimal_commas_and_of_our_own_column_are_read(tmp_path):
    path = tmp_path / "log.csv"
    rows = "".join(f"2031-07-19T09:41:07,{k:03d};{k * k};{1 + k % 3}\n" for k in range(8))
    path.write_text("t;q1;v1\n" + rows)
    found = read_recording(path, LogDescription(t=Channels(unit=("iso",))))
    np.testing.assert_allclose(np.diff(found.t), 1e-3, rtol=0.0, atol=5e-7)  # float64 has 2.4e-7 s in 2031


def test_a_log_without_header_has_columns_by_number(tmp_path):
    order = ["time", "a", "b", "c", "x", "y", "z"]
    description = described(["t=1[s]", "q={2..4}[rad]", "v={5..7}[A]"])
    description = replace(description, signal="current", text=TextLayout(header=0))
    for separator in (",", ";", "\t", " "):
        path = csv(tmp_path / "log.csv", {name: table()[name] for name in order}, separator, header=False)
        assert_same(read_recording(path, description))
    text = path.read_text().replace(".", ",").replace(" ", ";")
    path.write_text(text)
    assert_same(read_recording(path, description))
    with pytest.raises(RecordingError, match=r'line 1 has numbers where .*, or set header = "none"'):
        read_recording(path, DESCRIPTION)
    with pytest.raises(RecordingError, match="no column '8'"):
        read_recording(path, replace(description, v=replace(description.v, columns=("5", "6", "8"))))


def test_header_and_first_row_may_stand_anywhere(tmp_path):
    path = csv(tmp_path / "log.csv", table())
    header, rows = path.read_text().split("\n", 1)
    path.write_text(f"Scope export\nserial 7\n\n{header}\nA,-,rad,A,s,rad,rad,A\n\n{rows}")
    description = replace(DESCRIPTION, text=TextLayout(header=4, rows=7))
    assert_same(read_recording(path, description))
    with pytest.raises(RecordingError, match="line 5, column time: 's' is not a number"):
        read_recording(path, replace(DESCRIPTION, text=TextLayout(header=4)))
    with pytest.raises(RecordingError, match="line 3, declared as the header, is empty"):
        read_recording(path, replace(DESCRIPTION, text=TextLayout(header=3)))
    with pytest.raises(RecordingError, match="has no line 4444"):
        read_recording(path, replace(DESCRIPTION, text=TextLayout(header=4444)))
    path.write_text(path.read_text().replace(f"{T[5]:.17g}", "broken", 1))
    with pytest.raises(RecordingError, match="line 12, column time: 'broken' is not a number"):
        read_recording(path, description)


def test_separator_decimal_sign_and_encoding_may_be_said(tmp_path):
    names = {"a": "Gelenk 1, °", "b": "Gelenk 2, °", "c": "Gelenk 3, °"}
    path = csv(tmp_path / "log.csv", {names.get(name, name): value for name, value in table().items()}, "!")
    text = path.read_text().replace(".", ",")
    description = channels("q", columns=tuple(names.values()))
    for encoding in ("cp1252", "utf-16-le", "utf-8"):
        path.write_bytes(text.encode(encoding))
        assert_same(
            read_recording(path, replace(description, text=TextLayout(separator="!", decimal=",", encoding=encoding)))
        )
    path.write_bytes(b"\xff\xfe" + text.encode("utf-16-le")[:-1])
    with pytest.raises(RecordingError, match="broken UTF-16 at byte"):
        read_recording(path, description)
    path.write_text(text.replace("°", "\xb0"), encoding="latin-1")
    with pytest.raises(RecordingError, match="broken UTF-8 at byte"):
        read_recording(path, replace(description, text=TextLayout(separator="!", encoding="utf-8")))


def test_what_is_said_of_a_text_goes_before_what_it_looks_like(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t;q1;v1\n0;0;4\n" + "".join(f"0,{k:02d};{k * k},5;{k % 3}\n" for k in range(1, 9)))
    found = read_recording(path, LogDescription(text=TextLayout(decimal=",")))
    np.testing.assert_allclose(found.t, 0.01 * np.arange(9), rtol=1e-15)
    assert found.q[4, 0] == 16.5
    path.write_text("".join(f"0,{k:02d} {k},5 {k % 3}\n" for k in range(9)))  # two commas, two spaces
    description = replace(described(["t=1[s]", "q=2[rad]", "v=3[A]"]), signal="current")
    found = read_recording(path, replace(description, text=TextLayout(header=0, separator=" ")))
    assert found.q[:, 0].tolist() == [k + 0.5 for k in range(9)]


def test_names_in_quotes_may_hold_the_separator(tmp_path):
    path = csv(tmp_path / "log.csv", table())
    path.write_text(path.read_text().replace("a,z", '"a, left",z', 1))
    assert_same(read_recording(path, channels("q", columns=("a, left", "b", "c"))))


def test_names_with_spaces_do_not_make_spaces_the_separator(tmp_path):
    names = {"a": "axis 1 angle", "b": "axis 2 angle", "c": "axis 3 angle"}
    path = csv(tmp_path / "log.csv", {names.get(name, name): value for name, value in table().items()}, ";")
    assert_same(read_recording(path, channels("q", columns=tuple(names.values()))))
