"""What a log can be besides right: each ends with one line on stderr that names it, and status 2."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from bad_files import names_file

from ident.recordings.files import read_recording
from ident.support.errors import RecordingError
from scenarios.cli import main


def _log(**columns: object) -> dict[str, object]:
    t = 0.004 * np.arange(400)
    return {"t": t, "q1": np.sin(3.0 * t), "q2": 0.5 * np.cos(2.0 * t), "v1": np.cos(t), "v2": np.sin(t)} | columns


def _csv(columns: dict[str, object], separator: str = ",", decimal: str = ".") -> str:
    rows = [separator.join(columns)]
    rows += [separator.join(str(x).replace(".", decimal) for x in row) for row in zip(*columns.values(), strict=True)]
    return "\n".join(rows) + "\n"


def _with(values: object, **at: float) -> np.ndarray:
    changed = np.array(values)
    for row, value in at.items():
        changed[int(row[1:]) - 1] = value
    return changed


GOOD = _log()
T, Q1, V1, V2 = (np.asarray(GOOD[name]) for name in ("t", "q1", "v1", "v2"))
LOG_FAULTS = {
    "no t": (_csv({k: GOOD[k] for k in ("q1", "v1")}), r"column t is missing; declare it: .*; found q1, v1"),
    "decimal commas": (_csv(GOOD, ",", ","), r"line 2 has \d+ cells, but the header names 5; separate columns with ;"),
    "milliseconds": (_csv(_log(t=1e3 * T)), r"t advances by 4 a row; is it in milliseconds\? t is in seconds"),
    "constant v": (_csv(_log(v1=0.0 * T + 2.0)), r"v1 never changes"),
    "binary": (bytes(range(256)) * 9, r"not a text file; expected CSV"),
    "broken gzip": (b"\x1f\x8b" + b"abc" * 30, r"not a readable gzip file"),
    "too few joints": (_csv(GOOD), r"2 joints, but robot ur has 6"),
}


@pytest.mark.parametrize("name", LOG_FAULTS)
def test_a_faulty_csv_is_one_line(identify, tmp_path, name):
    content, message = LOG_FAULTS[name]
    path = tmp_path / "log.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    names_file(identify(unloaded=path), path, message)


JUMPS = {
    "spike of v": (
        _csv(_log(v2=_with(V2, r50=1e6, r51=1e6, r90=-1e6))),
        r"v2 = 1e\+06 at row 50, while 99 % of its values are within .*; 3 such samples \(rows 50, 51, 90\)",
    ),
    "spike of q": (_csv(_log(q1=_with(Q1, r60=9.0))), r"q1 jumps by .* from row 59 to the next, .* and 1 more such"),
    "wrapped": (
        _csv(_log(q1=(Q1 * 4.0 + np.pi) % (2 * np.pi) - np.pi)),
        r"q1 jumps by -6\.2.*wrapped; .* np\.unwrap\(q, ax",
    ),
}


@pytest.mark.parametrize("name", JUMPS)
def test_a_log_that_jumps_is_refused_where_nothing_repairs_it(tmp_path, capsys, name):
    content, message = JUMPS[name]
    path = tmp_path / "log.csv"
    path.write_text(content)
    assert main(["convert", str(path), "--out", str(tmp_path / "out.csv")]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    names_file(err, path, message)


PARQUET_FAULTS = {
    "text": (_log(q1=[str(x) for x in Q1]), r"column q1 is string, expected numbers"),
    "yes or no": (_log(v1=V1 > 0.5), r"column v1 is bool, expected numbers"),
    "nested": (_log(v1=[[x] for x in V1]), r"column v1 is list<.*>, expected numbers"),
    "a record": (_log(q2=[{"a": x} for x in V1]), r"column q2 is struct<.*>, expected numbers"),
    "dates": (_log(t=pa.array(range(400), pa.timestamp("ns"))), r"column t is timestamp\[ns\].*; t is in seconds"),
    "nulls": (_log(v2=[None, *V2[1:]]), r"v2 is not a finite number at row 1"),
    "all null": (_log(v2=[None] * 400), r"column v2 is null, expected numbers"),
    "too large": (_log(t=[2**60 + k for k in range(400)]), r"time does not increase at row 2: t = 1\.15292.*e\+18 s"),
    "no rows": ({k: np.empty(0) for k in GOOD}, r"0 samples are too few"),
    "no columns": ({"x": V1}, r"the file names no column t, q1\.\. or v1\.\.; found x"),
    "two many columns": ({f"c{k}": [1.0] for k in range(10_001)}, r"10001 columns; files of up to 10000 are read"),
}


def test_a_faulty_parquet_file_is_one_line(identify, tmp_path):
    path = tmp_path / "log.parquet"
    for columns, message in PARQUET_FAULTS.values():
        pq.write_table(pa.table(columns), path)
        with pytest.raises(RecordingError, match=message) as caught:
            read_recording(path)
        names_file(str(caught.value), path, message)
    pq.write_table(pa.table(_log()), path)
    whole = path.read_bytes()
    for content, message in (
        (whole[:-20], "not a readable Parquet file"),
        (whole[:6], "not a readable Parquet file"),
        (
            b"PAR1" + whole[: len(whole) // 2] + (10**9).to_bytes(4, "little") + b"PAR1",
            "1000 MB of metadata; write fewer columns",
        ),
        (whole[:4] + bytes(200) + whole[204:], "not a readable Parquet file"),
    ):
        path.write_bytes(content)
        names_file(identify(loaded=path), path, message)
    pq.write_table(pa.table([pa.array(T), pa.array(Q1), pa.array(V1), pa.array(V2)], ["t", "q1", "v1", "v1"]), path)
    names_file(identify(loaded=path), path, "column v1 appears twice")
