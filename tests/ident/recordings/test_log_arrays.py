"""Foreign logs as arrays: rows of numbers in Parquet, archives of NumPy."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from foreign_logs import DESCRIPTION, Q, T, V, assert_same, channels, table

from ident.recordings.description import Channels, LogDescription
from ident.recordings.description_files import described
from ident.recordings.files import read_log, read_recording
from ident.support.errors import RecordingError

ROWS = {"list": pa.list_(pa.float32()), "fixed": pa.list_(pa.float64(), 3)}


def lerobot(path: Path, kind: str, episodes: tuple[int, ...] = (3, 5)) -> Path:
    """As LeRobot writes data sets: rows of numbers, times that begin anew with each episode."""
    many = len(episodes)
    columns = {
        "observation.state": pa.array(np.tile(np.rad2deg(Q), (many, 1)).tolist(), ROWS[kind]),
        "observation.effort": pa.array(np.tile(V, (many, 1)).tolist(), ROWS[kind]),
        "timestamp": pa.array(np.tile(T, many).astype(np.float32)),
        "episode_index": pa.array(np.repeat(episodes, len(T))),
        "task": pa.array(["pick"] * many * len(T)),
    }
    pq.write_table(pa.table(columns), path)
    return path


LEROBOT = LogDescription(
    signal="current",
    only=(("episode_index", 5.0),),
    t=Channels(columns=("timestamp",), unit=("s",)),
    q=Channels(columns=("observation.state",), unit=("deg",)),
    v=Channels(columns=("observation.effort",), unit=("A",)),
)


@pytest.mark.parametrize("kind", ROWS)
def test_rows_of_numbers_in_parquet_are_columns_entry_by_entry(tmp_path, kind):
    path = lerobot(tmp_path / "log.parquet", kind)
    log = read_log(path, LEROBOT)
    atol = 4e-7 if kind == "list" else 1e-14  # half the last place of float32 at 4, or of float64
    np.testing.assert_allclose(log.recording.q, Q, rtol=0.0, atol=1e-6 if kind == "list" else 1e-14)
    np.testing.assert_allclose(log.recording.v, V, rtol=0.0, atol=atol)
    assert log.read.description.q.columns == tuple(f"observation.state[{k}]" for k in range(3))
    picked = replace(LEROBOT.v, columns=("observation.effort[2]", "observation.effort[0]", "observation.effort[1]"))
    np.testing.assert_allclose(read_recording(path, replace(LEROBOT, v=picked)).v, V[:, [2, 0, 1]], rtol=0.0, atol=atol)
    with pytest.raises(RecordingError, match="time does not increase at row 91"):
        read_recording(path, replace(LEROBOT, only=()))


def test_rows_of_unequal_length_are_named(tmp_path):
    path = tmp_path / "log.parquet"
    cells = [row[: 3 - (k == 17)] for k, row in enumerate(Q.tolist())]
    pq.write_table(pa.table({"timestamp": T, "observation.state": cells, "observation.effort": V.tolist()}), path)
    description = replace(LEROBOT, only=())
    with pytest.raises(RecordingError, match=r"column observation.state: row 18 does not have 3 numbers, as row 1 has"):
        read_recording(path, description)
    pq.write_table(pa.table({"timestamp": T, "observation.state": [None, *cells[1:]]}), path)
    with pytest.raises(RecordingError, match=r"no column 'observation\.state'"):
        read_recording(path, description)


@pytest.mark.parametrize("zone", [None, "UTC", "Europe/Paris"])
def test_dates_in_parquet_are_seconds_since_1970(tmp_path, zone):
    path = tmp_path / "log.parquet"
    ms = 1_710_000_000_000 + 4 * np.arange(len(T))
    columns = {name: pa.array(value) for name, value in table().items()}
    pq.write_table(pa.table(columns | {"time": pa.array(ms, pa.timestamp("ms", zone))}), path)
    found = read_recording(path, channels("t", unit=("iso",)))
    np.testing.assert_allclose(found.t, ms / 1000, rtol=0.0, atol=3e-7)  # float64 has 2.4e-7 s in 2024
    with pytest.raises(RecordingError, match=r'column time is timestamp.*, expected numbers; .*; set unit = "iso"'):
        read_recording(path, DESCRIPTION)
    pq.write_table(pa.table(columns), path)
    with pytest.raises(RecordingError, match="column time is double, not dates; state its unit, s, ms, us or ns"):
        read_recording(path, channels("t", unit=("iso",)))


def test_nanoseconds_since_1970_keep_what_float64_has(tmp_path):
    path = tmp_path / "log.parquet"
    ns = 1_710_000_000_000_000_000 + 4_000_000 * np.arange(len(T))
    pq.write_table(pa.table(table() | {"time": ns}), path)
    found = read_recording(path, channels("t", unit=("ns",)))
    np.testing.assert_allclose(np.diff(found.t), 0.004, rtol=0.0, atol=1e-6)  # twice the spacing of float64 there


ARRAYS = {
    "own.npz": lambda path: np.savez(path, t=T, q=Q, v=V),
    "packed.npz": lambda path: np.savez_compressed(path, t=T, q=Q, v=V, note=np.array("a text")),
}


@pytest.mark.parametrize("name", ARRAYS)
def test_archives_of_arrays_are_read(tmp_path, name):
    ARRAYS[name](tmp_path / name)
    found = read_recording(tmp_path / name)
    for one, other in ((found.t, T), (found.q, Q), (found.v, V)):
        np.testing.assert_array_equal(one, other)


def test_arrays_of_other_names_are_columns_entry_by_entry(tmp_path):
    path = tmp_path / "log.npz"
    np.savez(path, time=T, pos=np.rad2deg(Q), cur=V, more=T[:-1])
    description = replace(described(["t=time[s]", "q=pos[deg]", "v=cur[0],cur[1],cur[2][A]"]), signal="current")
    assert_same(read_recording(path, description))
    with pytest.raises(RecordingError, match=r"columns of different lengths: more: 89, pos\[0\]: 90"):
        read_recording(path, replace(description, t=Channels(columns=("more",), unit=("s",))))


def test_arrays_may_have_more_rows_than_files_have_columns(tmp_path):
    t = 0.002 * np.arange(10_001)
    q = np.column_stack((np.sin(3.0 * t), np.cos(2.0 * t)))
    np.savez(tmp_path / "log.npz", t=t, q=q, v=-0.7 * q)
    np.testing.assert_array_equal(read_recording(tmp_path / "log.npz").q, q)


def test_a_date_that_is_missing_is_no_time(tmp_path):
    path = tmp_path / "log.npz"
    dates = np.datetime64("2031-07-19T09:41:07.125") + 4 * np.arange(len(T))
    dates[0] = np.datetime64("NaT")
    np.savez(path, t=dates, q=Q, v=V)
    with pytest.raises(RecordingError, match=r"log\.npz: t is not a finite number at row 1 "):
        read_recording(path, LogDescription(t=Channels(unit=("iso",))))


def test_an_archive_that_unpacks_to_too_much_is_refused(tmp_path, monkeypatch):
    path = tmp_path / "log.npz"
    np.savez_compressed(path, t=T, q=Q, v=V, zeros=np.zeros(100_000))
    monkeypatch.setattr("ident.recordings.formats.arrays.LARGEST", 700_000)
    with pytest.raises(RecordingError, match=r"log\.npz: 0\.8.* MB unpacked; take a part of it"):
        read_recording(path)
    monkeypatch.setattr("ident.recordings.formats.arrays.LARGEST", 900_000)
    assert_same(read_recording(path))


def test_one_array_is_rows_or_named_fields(tmp_path):
    path = tmp_path / "log.npy"
    np.save(path, np.column_stack((T, Q, V)))
    description = replace(described(["t=1[s]", "q={2..4}[rad]", "v={5..7}[A]"]), signal="current")
    assert_same(read_recording(path, description))
    with pytest.raises(RecordingError, match="found 1, 2, 3, 4, 5, 6, 7; declare the columns"):
        read_recording(path)
    np.save(path, T)  # a single column is no rows
    with pytest.raises(RecordingError, match=r"log\.npy"):
        read_recording(path, description)
    fields = np.zeros(len(T), dtype=[("t", "f4"), ("q1", "f8"), ("v1", "i4"), ("stamp", "M8[ms]"), ("word", "U3")])
    fields["t"], fields["q1"], fields["v1"] = np.arange(len(T)) / 64.0, Q[:, 0], np.round(100.0 * V[:, 0])
    fields["stamp"] = np.datetime64("2031-07-19T09:41:07.125") + 4 * np.arange(len(T))
    np.save(path, fields)
    found = read_recording(path)
    np.testing.assert_array_equal(found.t, np.arange(len(T)) / 64.0)
    np.testing.assert_array_equal(found.v[:, 0], np.round(100.0 * V[:, 0]))
    dated = read_recording(path, LogDescription(t=Channels(columns=("stamp",), unit=("iso",))))
    start = datetime(2031, 7, 19, 9, 41, 7, 125000, tzinfo=UTC).timestamp()
    np.testing.assert_allclose(dated.t, start + 0.004 * np.arange(len(T)), rtol=0.0, atol=5e-7)  # float64 in 2031
    with pytest.raises(RecordingError, match="'word' is <U3, expected numbers"):
        read_recording(path, LogDescription(t=Channels(columns=("word",), unit=("s",))))
    with pytest.raises(RecordingError, match="'t' is float32, expected datetime64"):
        read_recording(path, LogDescription(t=Channels(columns=("t",), unit=("iso",))))
