"""Fields of arrays and cells of Parquet that hold a row of numbers each; dates of layouts with names of their own."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq
import pytest

from ident.recordings.description import Channels, LogDescription
from ident.recordings.description_files import described
from ident.recordings.files import read_recording
from ident.recordings.formats import parquet
from ident.support.errors import RecordingError

T = 2.3 + 0.004 * np.arange(80)
Q = np.column_stack([np.sin((2.0 + 0.7 * j) * T + j) for j in range(6)])
V = np.column_stack([(1.0 + 0.3 * j) * np.cos((3.0 - 0.4 * j) * T) + 0.2 for j in range(6)])


def fields(**more) -> np.ndarray:
    array = np.zeros(len(T), dtype=[("t", "f8"), ("q", "f8", (6,)), ("v", "f8", (6,)), *more.items()])
    array["t"], array["q"], array["v"] = T, Q, V
    return array


def assert_read(path: Path, description: LogDescription | None = None) -> None:
    found = read_recording(path, description)
    for one, other in ((found.t, T), (found.q, Q), (found.v, V)):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("name", ["log.npy", "log.npz"])
def test_fields_of_several_numbers_are_columns_entry_by_entry(tmp_path, name):
    path = tmp_path / name
    np.save(path, fields(word="U3")) if name.endswith("npy") else np.savez(path, log=fields(word="U3"))
    assert_read(path)


def test_fields_of_other_names_are_columns_entry_by_entry(tmp_path):
    array = fields(tool="(2, 3)f8")  # a matrix in each row is no column
    array.dtype.names = ("time", "pos", "cur", "tool")
    np.save(tmp_path / "log.npy", array)
    description = described(["t=time[s]", "q=pos[rad]", "v=cur[A]"])
    assert_read(
        tmp_path / "log.npy", LogDescription(signal="current", t=description.t, q=description.q, v=description.v)
    )
    with pytest.raises(RecordingError, match=r"no column 'tool'"):
        read_recording(
            tmp_path / "log.npy",
            LogDescription(
                signal="current", t=description.t, q=description.q, v=Channels(columns=("tool",), unit=("A",))
            ),
        )


LISTS = LogDescription(
    signal="current",
    t=Channels(columns=("t",), unit=("s",)),
    q=Channels(columns=("pos",), unit=("rad",)),
    v=Channels(columns=("cur",), unit=("A",)),
)


def test_a_parquet_file_of_rows_but_without_one_is_refused(tmp_path):
    rows = pa.list_(pa.float64(), 6)
    schema = pa.schema([("t", pa.float64()), ("pos", rows), ("cur", rows)])
    pq.write_table(schema.empty_table(), tmp_path / "log.parquet")
    with pytest.raises(RecordingError, match=r"log\.parquet: column pos has no row$"):
        read_recording(tmp_path / "log.parquet", LISTS)


def test_a_column_of_rows_is_unpacked_once(tmp_path, monkeypatch):
    pq.write_table(pa.table({"t": T, "pos": Q.tolist(), "cur": V.tolist()}), tmp_path / "log.parquet")
    unpacked, rows = list[str](), parquet._rows

    def counted(path, name, column):
        unpacked.append(name)
        return rows(path, name, column)

    monkeypatch.setattr(parquet, "_rows", counted)
    assert_read(tmp_path / "log.parquet", LISTS)
    assert unpacked == ["pos", "cur"]


def write_csv(path: Path, table: pa.Table) -> None:
    pyarrow.csv.write_csv(table, path)


def write_parquet(path: Path, table: pa.Table) -> None:
    pq.write_table(table, path)


def write_npz(path: Path, table: pa.Table) -> None:
    np.savez(path, **{name: table[name].to_numpy() for name in table.column_names})


@pytest.mark.parametrize(
    ("name", "write"), [("log.csv", write_csv), ("log.parquet", write_parquet), ("log.npz", write_npz)]
)
def test_dates_are_read_of_the_time_column_that_a_layout_has(tmp_path, name, write):
    ms = 1_710_000_000_000 + 4 * np.arange(len(T))
    columns = {"timestamp": pa.array(ms, pa.timestamp("ms"))}
    columns |= {f"actual_q_{j}": pa.array(Q[:, j]) for j in range(6)}
    columns |= {f"actual_current_{j}": pa.array(V[:, j]) for j in range(6)}
    write(tmp_path / name, pa.table(columns))
    found = read_recording(tmp_path / name, LogDescription(t=Channels(unit=("iso",))))
    np.testing.assert_allclose(found.t, ms / 1000, rtol=0.0, atol=3e-7)  # float64 has 2.4e-7 s in 2024
    np.testing.assert_array_equal(found.q, Q)
    np.testing.assert_array_equal(found.v, V)
