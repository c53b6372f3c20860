"""Datasets of LeRobot: episodes by number, joints by name, units as said or known; one line for what is wrong."""

import json
import re
from dataclasses import replace
from pathlib import Path

import lerobot_datasets as datasets
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from lerobot_datasets import FPS, JOINTS, LENGTHS, motion

from ident.recordings.description import Channels, LogDescription
from ident.recordings.files import read_log, read_recording
from ident.support.errors import RecordingError

ARM = JOINTS[:2]
TORQUE = LogDescription(signal="torque-from-current", joints=ARM, v=Channels(constant=()))
CURRENT = LogDescription(joints=ARM, q=Channels(unit=("deg",)))


def of(said: LogDescription, episode: int) -> LogDescription:
    return replace(said, only=(("episode_index", float(episode)),))


def state(folder: Path, names: list[str], rows: list[np.ndarray], **changes) -> Path:
    features = {"observation.state": datasets.feature("float32", len(names), names)}
    return datasets.write(folder, features, {"observation.state": rows}, **changes)


def openarm(folder: Path, **changes) -> Path:
    features, rows = datasets.openarm()
    return datasets.write(folder, features, {"observation.state": rows}, **{"robot_type": "openarm_follower"} | changes)


def so101(folder: Path, ending: str = "current", **changes) -> Path:
    names = [*(f"{joint}.pos" for joint in JOINTS), *(f"{joint}.{ending}" for joint in JOINTS)]
    return state(folder, names, [np.column_stack(motion(e)[1:]) for e in range(len(LENGTHS))], **changes)


def apart(folder: Path, names: object, kind: str = "effort", units: dict[str, object] | None = None) -> Path:
    """A dataset whose currents are a feature of their own."""
    features = {
        "observation.state": datasets.feature("float32", 3, names) | (units or {}),
        "observation.velocity": datasets.feature("float32", 3, names),
        f"observation.{kind}": datasets.feature("float32", 3, names),
        "action": datasets.feature("float32", 3, names),
    }
    every = [motion(episode) for episode in range(len(LENGTHS))]
    q, v = [each[1] for each in every], [each[2] for each in every]
    other = [-x for x in q]
    rows = {"observation.state": q, "observation.velocity": other, f"observation.{kind}": v, "action": other}
    return datasets.write(folder, features, rows)


def edit(folder: Path, **changes) -> Path:
    path = folder / "meta/info.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))
    return folder


def assert_episode(folder: Path, said: LogDescription, episode: int, joints=(0, 1), q_scale=np.pi / 180.0) -> None:
    found = read_recording(folder, of(said, episode))
    t, q, v = motion(episode)
    np.testing.assert_array_equal(found.t, t)
    np.testing.assert_array_equal(found.q, q[:, joints] * q_scale)
    np.testing.assert_array_equal(found.v, v[:, joints])


@pytest.mark.parametrize("episode", [0, 1, 2])
def test_an_episode_of_an_openarm_is_read_in_degrees_and_newton_metres(tmp_path, episode):
    folder = openarm(tmp_path / "set")
    assert_episode(folder, TORQUE, episode)
    assert_episode(folder, replace(TORQUE, joints=None), episode, joints=(0, 1, 2))  # velocities are no joints
    log = read_log(folder, of(TORQUE, episode))
    assert (log.layout, log.description.q.unit, log.description.v.unit) == (
        "lerobot", ("deg",) * 2, ("N m",) * 2,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "names"), [("effort", list(JOINTS)), ("torque", [list(JOINTS)]), ("current", {"motors": list(JOINTS)})]
)
def test_currents_may_be_a_feature_of_their_own(tmp_path, kind, names):
    folder = apart(tmp_path / "set", names, kind)
    said = replace(CURRENT, signal="current", q=Channels(unit=("rad",)), v=Channels(unit=("A",)))
    assert_episode(folder, said, 2, q_scale=1.0)


def test_entries_without_names_are_said_by_their_numbers_and_those_of_two_kinds_by_a_pattern(tmp_path):
    folder = apart(tmp_path / "set", None)
    with pytest.raises(RecordingError, match=r"no column is declared for positions.*found observation\.state\[0\]"):
        read_recording(folder, of(CURRENT, 0))
    said = replace(CURRENT, signal="current", v=Channels(columns=("observation.state.{joint}.current",), unit=("A",)))
    assert_episode(two_kinds(tmp_path / "two"), said, 1)
    q, v = (tuple(f"observation.{name}[{k}]" for k in (1, 0)) for name in ("state", "effort"))
    said = LogDescription(signal="current", q=Channels(columns=q, unit=("deg",)), v=Channels(columns=v, unit=("A",)))
    assert_episode(folder, said, 1, joints=(1, 0))


def test_an_episode_split_over_files_is_whole_and_joints_are_in_the_order_that_is_said(tmp_path):
    parts = [[(0, slice(None)), (1, slice(0, 33))], [(1, slice(33, 50))], [(1, slice(50, None)), (2, slice(None))]]
    folder = so101(tmp_path / "set", files=parts)
    for episode in range(3):
        assert_episode(folder, CURRENT, episode)
    assert_episode(folder, replace(CURRENT, joints=(JOINTS[2], JOINTS[0])), 1, joints=(2, 0))
    assert_episode(folder, replace(CURRENT, joints=None), 1, joints=(0, 1, 2))  # that of the dataset
    (folder / "data/chunk-000/file-001.parquet").unlink()
    assert_episode(folder, CURRENT, 0)
    with pytest.raises(RecordingError, match=r"episode 1 has 63 of its 80 frames; a file of data/ is missing"):
        read_recording(folder, of(CURRENT, 1))


def test_stamps_that_were_measured_are_kept(tmp_path):
    rng = np.random.default_rng(3)
    late = [np.arange(n) / FPS + np.sort(rng.uniform(0.0, 0.004, n)) for n in LENGTHS]
    found = read_recording(so101(tmp_path / "set", t=late), of(CURRENT, 1))
    np.testing.assert_array_equal(found.t, late[1].astype(np.float32))


def broken(folder: Path, name: str, content: bytes | None) -> Path:
    (folder / name).unlink() if content is None else (folder / name).write_bytes(content)
    return folder


def nan(folder: Path) -> Path:
    rows = [np.column_stack(motion(episode)[1:]) for episode in range(len(LENGTHS))]
    rows[1][7, 4] = np.nan
    names = [f"{joint}.{kind}" for kind in ("pos", "current") for joint in JOINTS]
    return state(folder, names, rows)


def no_currents(folder: Path) -> Path:
    names = [f"{joint}.pos" for joint in JOINTS]
    rows = [motion(episode)[1] for episode in range(len(LENGTHS))]
    features = {key: datasets.feature("float32", 3, names) for key in ("observation.state", "action")}
    return datasets.write(folder, features, dict.fromkeys(features, rows))


def two_kinds(folder: Path) -> Path:
    names = [f"{joint}.{kind}" for kind in ("pos", "current", "torque") for joint in JOINTS]
    rows = [np.column_stack((*motion(episode)[1:], motion(episode)[2])) for episode in range(len(LENGTHS))]
    return state(folder, names, rows)


def listed(folder: Path, lengths: list[float | None]) -> Path:
    pq.write_table(pa.table({"episode_index": [0, 1, 2], "length": lengths}), folder / LIST)
    return folder


DATA, LIST = "data/chunk-000/file-000.parquet", "meta/episodes/chunk-000/file-000.parquet"
LATE = [2.0 * np.arange(n) / FPS for n in LENGTHS]
FRAMES = [[(0, slice(None)), (1, slice(40, None)), (1, slice(0, 40)), (2, slice(None))]]
WRONG = {
    "no episode chosen": (so101, CURRENT, r"3 episodes, 0 to 2; choose one \(--episode"),
    "no such episode": (so101, of(CURRENT, 3), "no episode 3; there are 3 episodes, 0 to 2"),
    "no unit": (so101, replace(of(CURRENT, 1), q=Channels()), "the unit of positions is not declared"),
    "current without unit": (so101, replace(of(CURRENT, 1), signal="current"), "the unit of currents is not declared"),
    "torque without signal": (
        lambda p: so101(p, "torque"), of(CURRENT, 1),
        r"unit of currents is not declared: .*; the quantity in observation\.state\.shoulder_pan\.torque, .* not",
    ),
    "a strange joint": (so101, replace(of(CURRENT, 1), joints=("wrist",)), "joint 'wrist'; there are shoulder_pan"),
    "no currents": (no_currents, of(CURRENT, 1), "no column is declared for currents.*shoulder_pan"),
    "two kinds of currents": (
        two_kinds, of(CURRENT, 1),
        r"several kinds of current: observation\.state\.\{joint\}\.current, observation\.state\.\{joint\}\.torque; ",
    ),
    "NaN": (nan, of(CURRENT, 1), r"v2 is not a finite number at row 8 \(1 such values\)"),
    "truncated JSON": (lambda p: broken(so101(p), "meta/info.json", b'{"fps": 50, "fea'), of(CURRENT, 1), "not JSON"),
    "v2.1": (lambda p: edit(so101(p), codebase_version="v2.1"), of(CURRENT, 1), r"'v2\.1'.*convert_dataset_v21_to_v30"),
    "no version": (lambda p: edit(so101(p), codebase_version=None), of(CURRENT, 1), "codebase_version = None"),
    "fps 0": (lambda p: edit(so101(p), fps=0), of(CURRENT, 1), "fps = 0: expected"),
    "features": (lambda p: edit(so101(p), features=[]), of(CURRENT, 1), r"features = \[\]: expected"),
    "another fps": (
        lambda p: so101(p, t=LATE), of(CURRENT, 1),
        r"timestamps advance by 0\.04 s a frame, but fps = 50 of meta/info\.json says 0\.02 s",
    ),
    "no data": (lambda p: broken(broken(so101(p), DATA, None), "data/chunk-000/file-001.parquet", None), of(CURRENT, 1),
                "data has no Parquet file"),
    "no file of the episode": (lambda p: broken(so101(p), DATA, None), of(CURRENT, 1), "1 has 0 of its 80 frames"),
    "no list of episodes": (lambda p: broken(so101(p), LIST, None), of(CURRENT, 1), "episodes has no Parquet file"),
    "a list with a gap": (
        lambda p: listed(so101(p), [60.0, None, 70.0]), of(CURRENT, 1), "80 of its nan frames"
    ),
    "frames out of order": (
        lambda p: so101(p, files=FRAMES), of(CURRENT, 1),
        "frame_index of episode 1 is 40 at its row 1, expected 0; frames are lost or out of order",
    ),
    "a column less": (
        lambda p: edit(so101(p), features=json.loads((p / "meta/info.json").read_text())["features"]
                       | {"observation.state": datasets.feature("float32", 8, [f"{j}.{k}" for k in ("pos", "current")
                                                                               for j in ("x", *ARM, "y")])}),
        replace(of(CURRENT, 1), joints=("x", "y")), "no column is declared for positions",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_with_a_dataset_is_one_line(tmp_path, name):
    make, said, message = WRONG[name]
    folder = make(tmp_path / "set")
    with pytest.raises(RecordingError, match=message) as caught:
        read_recording(folder, said)
    assert re.match(rf"{re.escape(str(folder))}[^\n]*$", str(caught.value))
    assert len(str(caught.value)) < 500 + len(str(folder))
