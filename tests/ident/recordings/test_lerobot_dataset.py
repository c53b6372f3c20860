"""Recordings written as a dataset of LeRobot read back bit for bit, and hold what LeRobot looks for."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from ident.recordings.description import LogDescription
from ident.recordings.files import read_log, read_recording
from ident.recordings.formats.lerobot import FILES, write_dataset
from ident.recordings.recording import Recording
from ident.support.errors import RecordingError

JOINTS = ("base", "arm.upper", "wrist")


def recording(number: int, period: float = 0.004, start: float = 1.7e9) -> Recording:
    rng = np.random.default_rng(number)
    t = start + period * (np.arange(90 + 10 * number) + 0.02 * rng.uniform(-1.0, 1.0, 90 + 10 * number))
    phase = 7.0 * (t - t[0])[:, None] * np.array([1.0, 0.8, 1.3]) + number
    return Recording(t, np.sin(phase) / 3.0, np.cos(phase) / 7.0 + 0.1 * number)


def episode(number: int) -> LogDescription:
    return LogDescription(only=(("episode_index", float(number)),))


def assert_same(found: Recording, written: Recording) -> None:
    for one, other in ((found.t, written.t), (found.q, written.q), (found.v, written.v)):
        np.testing.assert_array_equal(one, other)


def test_every_episode_reads_back_bit_for_bit(tmp_path):
    recordings = [recording(number) for number in range(3)]
    write_dataset(recordings, tmp_path / "set", joints=JOINTS)
    for number, written in enumerate(recordings):
        assert_same(read_recording(tmp_path / "set", episode(number)), written)
    found = read_recording(tmp_path / "set", replace(episode(1), joints=(JOINTS[2], JOINTS[1])))
    assert_same(found, Recording(recordings[1].t, recordings[1].q[:, [2, 1]], recordings[1].v[:, [2, 1]]))


@pytest.mark.parametrize(
    ("signal", "unit"),
    [(None, ()), ("current", ("A",) * 3), ("percent", ("%",) * 3), ("torque-from-current", ("N m",) * 3),
     ("torque-after-drive", ("N m",) * 3)],
)  # fmt: skip
def test_what_v_is_reads_back(tmp_path, signal, unit):
    write_dataset([recording(1)], tmp_path / "set", signal=signal)
    log = read_log(tmp_path / "set", LogDescription())
    assert (log.description.signal, log.description.v.unit) == (signal, unit)
    assert_same(log.recording, recording(1))


def test_a_dataset_has_what_lerobot_looks_for(tmp_path):
    recordings = [recording(number) for number in range(2)]
    write_dataset(recordings, tmp_path / "set", joints=JOINTS, signal="torque-from-current")
    assert {str(p.relative_to(tmp_path / "set")) for p in (tmp_path / "set").rglob("*") if p.is_file()} == set(FILES)
    info = json.loads((tmp_path / "set/meta/info.json").read_text())
    assert (info["codebase_version"], info["fps"], info["splits"]) == ("v3.0", 250, {"train": "0:2"})
    assert isinstance(info["fps"], int)
    assert (info["total_episodes"], info["total_frames"], info["total_tasks"]) == (2, 190, 1)
    names = info["features"]["observation.state"]["names"]
    assert names == [f"{joint}.{kind}" for kind in ("pos", "torque") for joint in JOINTS]
    data = pd.read_parquet(tmp_path / "set" / info["data_path"].format(chunk_index=0, file_index=0))
    assert set(data) == set(info["features"])
    np.testing.assert_array_equal(data["index"], np.arange(190))
    np.testing.assert_array_equal(data["frame_index"], [*range(90), *range(100)])
    np.testing.assert_array_equal(np.stack(data["observation.state"])[90:, 3:], recordings[1].v)
    assert pq.ParquetFile(tmp_path / "set" / FILES[-1]).num_row_groups == 2
    listed = pd.read_parquet(tmp_path / "set/meta/episodes")
    np.testing.assert_array_equal(listed[["dataset_from_index", "dataset_to_index"]], [[0, 90], [90, 190]])
    np.testing.assert_array_equal(listed[["data/chunk_index", "data/file_index"]], 0)
    tasks = pd.read_parquet(tmp_path / "set/meta/tasks.parquet")
    assert tasks.loc[listed["tasks"][1][0], "task_index"] == 0
    stats = json.loads((tmp_path / "set/meta/stats.json").read_text())
    assert set(stats) == set(info["features"])
    # float64 adds up in another order.
    np.testing.assert_allclose(
        stats["observation.state"]["mean"][3:], np.concatenate([each.v for each in recordings]).mean(axis=0), rtol=1e-12
    )
    assert stats["observation.state"]["count"] == [190]


def two_joints() -> Recording:
    other = recording(0)
    return Recording(other.t, other.q[:, :2], other.v[:, :2])


@pytest.mark.parametrize(
    ("recordings", "joints", "message"),
    [
        ([], None, "0 recordings of no joints; a dataset has episodes of the same joints"),
        ([recording(0), two_joints()], None, "2 recordings of 2, 3 joints; a dataset has"),
        ([recording(0)], ("a", "b"), "2 different names for 3 joints"),
        ([recording(0)], ("a", "b", "a"), "2 different names for 3 joints"),
        ([recording(0), recording(1, period=0.008)], None, "recordings of 125 to 250 Hz; a dataset has one rate"),
    ],
)
def test_recordings_that_make_no_dataset_are_one_line(tmp_path, recordings, joints, message):
    with pytest.raises(RecordingError, match=message):
        write_dataset(recordings, tmp_path / "set", joints=joints)
    assert not (tmp_path / "set").exists()


def test_a_dataset_is_not_mixed_with_another(tmp_path):
    write_dataset([recording(0)], tmp_path / "set")
    write_dataset([recording(1)], tmp_path / "set")
    assert_same(read_recording(tmp_path / "set"), recording(1))
    other: Path = tmp_path / "set/data/chunk-000/file-001.parquet"
    other.write_bytes((tmp_path / "set" / FILES[-1]).read_bytes())
    with pytest.raises(
        RecordingError,
        match=r"set: contains another dataset, .*file-001\.parquet; give another "
        "folder",
    ):
        write_dataset([recording(2)], tmp_path / "set")
