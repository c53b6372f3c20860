"""HDF5, MATLAB's files and JSON lines; times in two columns, by channel, or stated by a rate."""

import json
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from foreign_logs import DESCRIPTION, Q, T, V, assert_same, channels, csv, table
from scipy.io import savemat

from ident.recordings.description import Channels, described, read_description
from ident.recordings.files import read_log, read_recording
from ident.support.errors import RecordingError

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


def test_arrays_that_unpack_to_too_much_are_refused_before_they_are_read(tmp_path, monkeypatch):
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file.create_dataset("zeros", (300, 4000), dtype="f8", compression="gzip")
    savemat(tmp_path / "log.mat", {"zeros": np.zeros((300, 4000))}, do_compression=True)
    monkeypatch.setattr("ident.recordings.formats.MOST_VALUES", 1_000_000)
    for name in ("log.h5", "log.mat"):
        with pytest.raises(RecordingError, match="1200000 numbers; up to 1000000 are read"):
            read_recording(tmp_path / name, NESTED)


def test_a_log_without_times_has_those_of_its_stated_rate(tmp_path):
    path = csv(tmp_path / "log.csv", table())
    (tmp_path / "log.toml").write_text('signal = "current"\n[t]\nrate_hz = 40\n')
    by_file = replace(DESCRIPTION, t=Channels(), rate_hz=read_description(tmp_path / "log.toml").rate_hz)
    by_words = replace(DESCRIPTION, t=Channels(), rate_hz=described(["t=[40 Hz]"]).rate_hz)
    for description in (by_file, by_words):
        assert_same(read_recording(path, description), t=np.arange(len(T)) / 40.0)
    (tmp_path / "log.toml").write_text("[t]\nrate_hz = -40\n")
    with pytest.raises(RecordingError, match="rate_hz = -40: expected a sampling rate"):
        read_description(tmp_path / "log.toml")


def test_seconds_and_nanoseconds_in_two_columns_are_added(tmp_path):
    whole = np.floor(T)
    path = csv(tmp_path / "log.csv", {**table(), "time": whole, "nanosec": 1e9 * (T - whole)})
    assert_same(read_recording(path, channels("t", columns=("time", "nanosec"), unit=("s", "ns"))))
    with pytest.raises(RecordingError, match=r"add the column of fractions: column = \["):
        read_recording(path, DESCRIPTION)


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
