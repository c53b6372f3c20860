"""Logs as arrays in Parquet, NumPy's, HDF5, MATLAB's files and JSON lines; what holds of every format; times."""

import json
import re
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from foreign_logs import DESCRIPTION, Q, T, V, assert_same, channels, csv, table, unread
from refusals import refused
from scipy.io import savemat

from ident.recordings.description import Channels, LogDescription, described, read_description
from ident.recordings.files import LOGS, read_log, read_recording
from ident.support.errors import RecordingError

DATES = np.datetime64("2031-07-19T09:41:07.125") + 4 * np.arange(len(T))
SECONDS = DATES.astype("datetime64[us]").astype(np.int64) / 1e6
ENTRIES = replace(described(["t=time[s]", "q=pos[rad]", "v=cur[A]"]), signal="current")


def assert_exact(path: Path, description: LogDescription | None = None) -> None:
    found = read_recording(path, description)
    for one, other in ((found.t, T), (found.q, Q), (found.v, V)):
        np.testing.assert_array_equal(one, other)


def test_a_file_that_a_format_cannot_read_is_named_in_one_line(tmp_path):
    endings = [ending for log in LOGS.values() for ending in log.endings]
    assert len(set(endings)) == len(endings)
    for log in LOGS.values():
        for ending in log.endings:
            for content in (None, b"", b"\x01\x02\x00 no log of any kind \xff\n"):
                path = tmp_path / f"log{ending}"
                path.unlink(missing_ok=True)
                if content is not None:
                    path.write_bytes(content)
                unread(rf"^{re.escape(str(path))}: [^\n]+$", path)


def test_numbers_of_any_type_are_read_from_parquet(tmp_path):
    v = np.round(100.0 + 50.0 * np.sin(40.0 * T))
    plain = [pa.array(v.astype(kind)) for kind in ("float32", "float16", "int32", "uint8")]
    for stored in (*plain, pa.array(v).cast(pa.decimal128(12, 4)), pa.array(v).dictionary_encode()):
        columns = {"t": T, "q1": Q[:, 0], "v1": stored, "note": [{"a": "x"}] * len(T)}
        pq.write_table(pa.table(columns), tmp_path / "log.parquet")
        np.testing.assert_array_equal(read_recording(tmp_path / "log.parquet").v[:, 0], v)


@pytest.mark.parametrize("kind", [pa.list_(pa.float64()), pa.list_(pa.float64(), 3)], ids=["lists", "fixed"])
def test_rows_of_numbers_in_parquet_are_columns_entry_by_entry(tmp_path, kind):
    path = tmp_path / "log.parquet"
    columns = {"time": T, "pos": pa.array(Q.tolist(), kind), "cur": pa.array(V.tolist(), kind)}
    pq.write_table(pa.table(columns), path)
    assert_exact(path, ENTRIES)
    assert read_log(path, ENTRIES).description.q.columns == ("pos[0]", "pos[1]", "pos[2]")
    picked = replace(ENTRIES, v=Channels(columns=("cur[2]", "cur[0]", "cur[1]"), unit=("A",)))
    np.testing.assert_array_equal(read_recording(path, picked).v, V[:, [2, 0, 1]])


def test_rows_of_unequal_length_or_none_are_named(tmp_path):
    path, cells = tmp_path / "log.parquet", [row[: 3 - (k == 17)] for k, row in enumerate(Q.tolist())]
    pq.write_table(pa.table({"time": T, "pos": cells, "cur": V.tolist()}), path)
    unread("column pos: row 18 does not have 3 numbers, as others have", path, ENTRIES)
    pq.write_table(pa.table({"time": T, "pos": [None, *cells[1:]], "cur": V.tolist()}), path)
    unread("column pos: row 1 does not have 3 numbers, as others have", path, ENTRIES)
    fixed = pa.list_(pa.float64(), 3)
    pq.write_table(pa.schema([("time", pa.float64()), ("pos", fixed), ("cur", fixed)]).empty_table(), path)
    unread("0 samples are too few", path, ENTRIES)


@pytest.mark.parametrize("zone", [None, "UTC", "Europe/Paris"])
def test_dates_in_parquet_are_seconds_since_1970(tmp_path, zone):
    path, dated = tmp_path / "log.parquet", pa.array(DATES.astype(np.int64), pa.timestamp("ms", zone))
    pq.write_table(pa.table(table() | {"time": dated}), path)
    found = read_recording(path, channels("t", unit=("iso",)))
    np.testing.assert_allclose(found.t, SECONDS, rtol=0.0, atol=5e-7)  # float64 has 2.4e-7 s in 2031
    unread(r'column time is timestamp.*, expected numbers; .*; set unit = "iso"', path, DESCRIPTION)
    pq.write_table(pa.table(table()), path)
    unread(r"column time is double, expected dates; .* s, ms, us or ns", path, channels("t", unit=("iso",)))


def fields() -> np.ndarray:
    kinds = [("t", "f8"), ("q", "f8", (3,)), ("v", "f8", (3,)), ("word", "U3"), ("stamp", "M8[ms]")]
    array = np.zeros(len(T), dtype=[*kinds, ("tool", "f8", (2, 3))])
    array["t"], array["q"], array["v"], array["stamp"] = T, Q, V, DATES
    return array


def test_arrays_of_standard_names_and_named_fields_are_read(tmp_path):
    np.savez(tmp_path / "own.npz", t=T, q=Q, v=V, images=np.zeros((len(T), 128)))  # wide, but not transposed
    np.savez_compressed(tmp_path / "packed.npz", t=T, q=Q, v=V, note=np.array("a text"))
    np.savez(tmp_path / "fields.npz", log=fields())
    np.save(tmp_path / "fields.npy", fields())
    for name in ("own.npz", "packed.npz", "fields.npz", "fields.npy"):
        assert_exact(tmp_path / name)
    path = tmp_path / "fields.npy"
    dated = read_recording(path, LogDescription(t=Channels(columns=("stamp",), unit=("iso",))))
    np.testing.assert_allclose(dated.t, SECONDS, rtol=0.0, atol=5e-7)  # float64 in 2031
    for column, unit, message in (
        ("word", "s", "column word is <U3, expected numbers"),
        ("t", "iso", "column t is float64, expected dates"),
        ("tool", "s", "no column 'tool'"),  # a matrix in each row is no column
    ):
        unread(message, path, LogDescription(t=Channels(columns=(column,), unit=(unit,))))
    dates = DATES.copy()
    dates[0] = np.datetime64("NaT", "us")
    np.savez(tmp_path / "own.npz", t=dates, q=Q, v=V)
    with pytest.raises(RecordingError, match=r"own\.npz: t is not a finite number at row 1 "):
        read_recording(tmp_path / "own.npz", LogDescription(t=Channels(unit=("iso",))))


def test_arrays_of_other_names_and_of_rows_are_columns_by_number(tmp_path):
    path = tmp_path / "log.npz"
    np.savez(path, time=T, pos=np.rad2deg(Q), cur=V, more=T[:-1])
    description = replace(described(["t=time[s]", "q=pos[deg]", "v=cur[0],cur[1],cur[2][A]"]), signal="current")
    assert_same(read_recording(path, description))
    with pytest.raises(RecordingError, match=r"columns of different lengths: more: 89, pos\[0\]: 90"):
        read_recording(path, replace(description, t=Channels(columns=("more",), unit=("s",))))
    path = tmp_path / "log.npy"
    np.save(path, np.column_stack((T, Q, V)))
    numbered = replace(described(["t=1[s]", "q={2..4}[rad]", "v={5..7}[A]"]), signal="current")
    assert_exact(path, numbered)
    unread("found 1, 2, 3, 4, 5, 6, 7; declare the columns", path)
    np.save(path, T)  # a single column is no rows
    unread("no column '1'", path, numbered)


def test_a_transposed_array_is_refused_but_not_one_of_many_rows(tmp_path):
    np.savez(tmp_path / "log.npz", t=T, q=Q.T, v=V.T)
    unread(r"q has 3 rows of 90 numbers; .* save its \.T", tmp_path / "log.npz")
    t = 0.002 * np.arange(10_001)
    np.savez(tmp_path / "log.npz", t=t, q=np.sin(t)[:, None], v=np.cos(t)[:, None])
    assert len(read_recording(tmp_path / "log.npz").t) == 10_001


NESTED = replace(described(["t=time[s]", "q=state.pos[rad]", "v=cur[A]"]), signal="current")


def hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["time"], file["state/pos"], file["cur"], file["name"] = T, Q, V, "arm"


def matlab_hdf5(path: Path) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:  # -v7.3: rows and columns are exchanged
        file["time"], file["state/pos"], file["cur"] = T[None, :], Q.T, V.T
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(128))


def json_lines(path: Path) -> None:
    rows = zip(T.tolist(), Q.tolist(), V.tolist(), strict=True)
    path.write_text("".join(json.dumps({"time": t, "state": {"pos": q}, "cur": v}) + "\n" for t, q, v in rows))


def test_arrays_in_groups_structures_and_objects_are_read_by_their_path(tmp_path):
    hdf5(tmp_path / "log.h5")
    matlab_hdf5(tmp_path / "new.mat")
    savemat(tmp_path / "old.mat", {"time": T[:, None], "state": {"pos": Q}, "cur": V, "note": "text"})
    json_lines(tmp_path / "log.jsonl")
    for name in ("log.h5", "new.mat", "old.mat", "log.jsonl"):
        found = read_recording(tmp_path / name, NESTED)
        for one, other in ((found.t, T), (found.q, Q), (found.v, V)):
            np.testing.assert_array_equal(one, other, err_msg=name)


def test_more_numbers_than_are_plausible_are_refused_before_they_are_read(tmp_path, monkeypatch):
    zeros = np.zeros((300, 400))
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file.create_dataset("zeros", zeros.shape, dtype="f8", compression="gzip")
    savemat(tmp_path / "log.mat", {"zeros": zeros}, do_compression=True)
    np.savez_compressed(tmp_path / "log.npz", t=T, q=Q, v=V, zeros=zeros)
    pq.write_table(pa.table({"t": T, "q1": Q[:, 0], "v1": V[:, 0]}), tmp_path / "log.parquet")
    for name, count in (("h5", 120_000), ("mat", 120_000), ("npz", 120_694), ("parquet", 270)):
        monkeypatch.setattr("ident.recordings.formats.MOST_VALUES", count - 1)
        unread(f"{count} numbers; up to {count - 1} are read, take a part", tmp_path / f"log.{name}")
        monkeypatch.setattr("ident.recordings.formats.MOST_VALUES", count)
        if name in ("npz", "parquet"):
            read_recording(tmp_path / f"log.{name}")


def test_what_a_row_holds_is_measured_before_it_is_read(tmp_path, monkeypatch):
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file.create_dataset("wide", (700_000,), dtype=np.dtype([("a", "f8", (90,)), ("b", "i4", (3,))]))  # not written
    unread("64050000 numbers", tmp_path / "log.h5")
    nested = '{"t": ' + "[" * 1001 + "]" * 1001 + "}"
    (tmp_path / "log.jsonl").write_text('{"t": 3}\n' + nested)
    unread("line 2 has more than 1000 arrays or objects", tmp_path / "log.jsonl")
    columns = {"t": T[:2], "pos": pa.array([[0.3] * 10_001, [0.2] * 10_003]), "cur": pa.array(["3", "5"])}
    pq.write_table(pa.table(columns), tmp_path / "log.parquet")
    monkeypatch.setattr("pyarrow.parquet.ParquetFile.read", None)
    unread("10002 columns; files of up to 10000 are read", tmp_path / "log.parquet")
    pq.write_table(pa.table({**columns, "pos": T[:2]}), tmp_path / "log.parquet")
    described_so = replace(described(["t=t[s]", "q=pos[rad]", "v=cur[A]"]), signal="current")
    unread("column cur is string, expected numbers", tmp_path / "log.parquet", described_so)


def test_a_log_without_times_has_those_of_its_stated_rate(tmp_path):
    path = csv(tmp_path / "log.csv", table())
    (tmp_path / "log.toml").write_text('signal = "current"\n[t]\nrate_hz = 40\n')
    by_file = replace(DESCRIPTION, t=Channels(), rate_hz=read_description(tmp_path / "log.toml").rate_hz)
    by_words = replace(DESCRIPTION, t=Channels(), rate_hz=described(["t=[40 Hz]"]).rate_hz)
    for description in (by_file, by_words):
        assert_same(read_recording(path, description), t=np.arange(len(T)) / 40.0)
    (tmp_path / "log.toml").write_text("[t]\nrate_hz = -40\n")
    refused(RecordingError, "rate_hz = -40: expected a sampling rate", read_description, tmp_path / "log.toml")


def test_seconds_and_nanoseconds_in_two_columns_are_added(tmp_path):
    whole = np.floor(T)
    path = csv(tmp_path / "log.csv", {**table(), "time": whole, "nanosec": 1e9 * (T - whole)})
    assert_same(read_recording(path, channels("t", columns=("time", "nanosec"), unit=("s", "ns"))))
    unread(r"add the column of fractions: column = \[", path, DESCRIPTION)


LATE = 0.0017
"""Time by which the currents are sampled after the positions [s]."""


def test_a_scope_has_a_time_for_each_channel_and_its_currents_are_interpolated(tmp_path):
    names, columns = [], []
    for name, x, t in (*zip("abc", Q.T, (T, T, T), strict=True), *zip("xyz", V.T, 3 * (T + LATE,), strict=True)):
        names += ["time", name]
        columns += [t, x]
    np.savetxt(tmp_path / "log.csv", np.column_stack(columns), delimiter=",", header=",".join(names), comments="")
    log = read_log(tmp_path / "log.csv", DESCRIPTION)
    # the first sample is before the first current: linear interpolation between neighbours
    part = LATE / 0.004
    assert_same(log.recording, T[1:], Q[1:], (1.0 - part) * V[1:] + part * V[:-1])
    assert log.notes == ("channels have samples at different times: interpolated at those of a",)


def test_rows_of_two_sources_in_one_table_are_brought_to_the_times_of_the_positions(tmp_path):
    lines = ["time,a,b,c,x,y,z"]
    for t, q, v in zip(T, Q, V, strict=True):
        lines.append(",".join(map(repr, (float(t), *q.tolist()))) + ",,,")
        lines.append(f"{float(t + LATE)!r},,,,{','.join(map(repr, v.tolist()))}")
    path, part = tmp_path / "log.csv", LATE / 0.004
    path.write_text("\n".join(lines))
    assert_same(read_recording(path, DESCRIPTION), T[1:], Q[1:], (1.0 - part) * V[1:] + part * V[:-1])
    path.write_text("\n".join(line for k, line in enumerate(lines) if not (40 < k < 48 and k % 2 == 0)))
    gap = read_recording(path, DESCRIPTION).t  # no currents of rows 21 to 23: none is interpolated there
    np.testing.assert_array_equal(gap, np.delete(T, np.arange(20, 24))[1:])


def test_a_channel_whose_time_goes_back_is_refused_by_name(tmp_path):
    columns = np.column_stack((T, Q[:, 0], T[::-1], V[:, 0]))
    np.savetxt(tmp_path / "log.csv", columns, delimiter=",", header="time,a,time,x", comments="")
    with pytest.raises(RecordingError, match="column x: its time does not increase"):
        read_recording(tmp_path / "log.csv", replace(described(["t=time[s]", "q=a[rad]", "v=x[A]"]), signal="current"))
