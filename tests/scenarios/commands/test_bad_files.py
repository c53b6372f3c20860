import os

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from bad_files import names_file

from ident.recordings.files import read_recording
from ident.support.errors import RecordingError


@pytest.mark.parametrize("kind", ["model", "loaded", "payload"])
def test_what_is_no_regular_file_is_one_line_whatever_it_is_given_for(identify, tmp_path, kind):
    ending = {"model": "xml", "payload": "toml"}.get(kind, "csv")
    folder, pipe, device, absent, empty, long = (
        tmp_path / f"{name}.{ending}" for name in ("folder", "pipe", "zero", "absent", "empty", "x" * 300)
    )
    folder.mkdir()
    os.mkfifo(pipe)
    device.symlink_to("/dev/zero")
    empty.touch()
    for path, message in (
        (folder, "is a folder; expected a regular file"),
        (pipe, "is a pipe; expected a regular file"),
        (device, "is a device; expected a regular file"),
        (absent, "no such file"),
        (empty, "the file is empty"),
        (long, "File name too long"),
    ):
        names_file(identify(**{kind: path}), path, message)


def _log(**columns: object) -> dict[str, object]:
    t = 0.004 * np.arange(400)
    return {"t": t, "q1": np.sin(3.0 * t), "q2": 0.5 * np.cos(2.0 * t), "v1": np.cos(t), "v2": np.sin(t)} | columns


GOOD = _log()
Q1, V1, V2 = (np.asarray(GOOD[name]) for name in ("q1", "v1", "v2"))
PARQUET_FAULTS = {
    "text": (_log(q1=[str(x) for x in Q1]), r"column q1 is string, expected numbers"),
    "yes or no": (_log(v1=V1 > 0.5), r"column v1 is bool, expected numbers"),
    "a record": (_log(q2=[{"a": x} for x in V1]), r"column q2 is struct<.*>, expected numbers"),
    "dates": (_log(t=pa.array(range(400), pa.timestamp("ns"))), r"column t is timestamp\[ns\].*; t is in seconds"),
    "nulls": (_log(v2=[None, *V2[1:]]), r"v2 is not a finite number at row 1"),
    "too large": (_log(t=[2**60 + k for k in range(400)]), r"time does not increase at row 2: t = 1\.15292.*e\+18 s"),
    "no rows": ({k: np.empty(0) for k in GOOD}, r"0 samples are too few"),
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
    names_file(identify(unloaded=path), path, r"2 joints, but robot ur has 6")
    whole = path.read_bytes()
    for content, message in (
        (whole[:-20], "not a readable Parquet file"),
        (whole[:4] + bytes(200) + whole[204:], "not a readable Parquet file"),
    ):
        path.write_bytes(content)
        names_file(identify(loaded=path), path, message)
