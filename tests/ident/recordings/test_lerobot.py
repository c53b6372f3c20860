"""Datasets of LeRobot: episodes by number, joints by name, units as said or known; one line for what is wrong."""

import json
import re
from dataclasses import replace
from pathlib import Path

import lerobot_datasets as datasets
import numpy as np
import pytest
from foreign_logs import unread
from lerobot_datasets import FPS, JOINTS, LENGTHS, motion

from ident.recordings.description import Channels, LogDescription
from ident.recordings.files import read_log, read_recording
from ident.support.errors import RecordingError

ARM = JOINTS[:2]
TORQUE = LogDescription(signal="torque-from-current", joints=ARM, v=Channels(constant=()))
CURRENT = LogDescription(joints=ARM, q=Channels(unit=("deg",)))


def of(said: LogDescription, episode: int) -> LogDescription:
    return replace(said, only=(("episode_index", float(episode)),))


def so101(folder: Path, *kinds: str, nan: tuple[int, int] | None = None, **changes) -> Path:
    """A dataset with kinds of values of every joint in one feature, one of episode 1 perhaps missing."""
    kinds = kinds or ("pos", "current")
    names = [f"{joint}.{kind}" for kind in kinds for joint in JOINTS]
    rows = [np.column_stack([q if kind == "pos" else v for kind in kinds]) for _, q, v in map(motion, range(3))]
    if nan is not None:
        rows[1][nan] = np.nan
    features = {"observation.state": datasets.feature("float32", len(names), names)}
    return datasets.write(folder, features, {"observation.state": rows}, **changes)


def apart(folder: Path, names: object, kind: str = "effort") -> Path:
    """A dataset whose currents are a feature of their own."""
    _, q, v = zip(*map(motion, range(len(LENGTHS))), strict=True)
    other = [-x for x in q]
    rows = {"observation.state": q, "observation.velocity": other, f"observation.{kind}": v, "action": other}
    return datasets.write(folder, dict.fromkeys(rows, datasets.feature("float32", 3, names)), rows)


def assert_episode(folder: Path, said: LogDescription, episode: int, joints=(0, 1), q_scale=np.pi / 180.0) -> None:
    found = read_recording(folder, of(said, episode))
    t, q, v = motion(episode)
    np.testing.assert_array_equal(found.t, t)
    np.testing.assert_array_equal(found.q, q[:, joints] * q_scale)
    np.testing.assert_array_equal(found.v, v[:, joints])


def test_an_episode_of_an_openarm_is_read_in_degrees_and_newton_metres(tmp_path):
    features, rows = datasets.openarm()
    folder = datasets.write(tmp_path / "set", features, {"observation.state": rows}, robot_type="openarm_follower")
    for episode in range(3):
        assert_episode(folder, TORQUE, episode)
        assert_episode(folder, replace(TORQUE, joints=None), episode, joints=(0, 1, 2))  # velocities are no joints
        log = read_log(folder, of(TORQUE, episode))
        units = log.description.q.unit, log.description.v.unit
        assert (log.layout, *units) == ("lerobot", ("deg",) * 2, ("N m",) * 2)


@pytest.mark.parametrize(
    ("kind", "names"), [("effort", list(JOINTS)), ("torque", [list(JOINTS)]), ("current", {"motors": list(JOINTS)})]
)
def test_currents_may_be_a_feature_of_their_own(tmp_path, kind, names):
    folder = apart(tmp_path / "set", names, kind)
    said = replace(CURRENT, signal="current", q=Channels(unit=("rad",)), v=Channels(unit=("A",)))
    assert_episode(folder, said, 2, q_scale=1.0)


def test_entries_without_names_are_said_by_their_numbers_and_those_of_two_kinds_by_a_pattern(tmp_path):
    folder = apart(tmp_path / "set", None)
    unread(r"no column is declared for positions.*found observation\.state\[0\]", folder, of(CURRENT, 0))
    said = replace(CURRENT, signal="current", v=Channels(columns=("observation.state.{joint}.current",), unit=("A",)))
    assert_episode(so101(tmp_path / "two", *TWO), said, 1)
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
    unread(r"episode 1 has 63 of its 80 frames; a file of data/ is missing", folder, of(CURRENT, 1))


def test_a_dataset_of_version_2_is_read_alike(tmp_path):
    folder = datasets.as_version_2(so101(tmp_path / "set"))
    for episode in range(3):
        assert_episode(folder, CURRENT, episode)
    unread(r"no episode 3; there are 3 episodes, 0 to 2", folder, of(CURRENT, 3))
    (folder / "meta/episodes.jsonl").write_text('{"episode_index": 0}\n')
    unread(r"episodes\.jsonl: not JSON lines as LeRobot", folder, of(CURRENT, 0))


def test_stamps_that_were_measured_are_kept(tmp_path):
    rng = np.random.default_rng(3)
    late = [np.arange(n) / FPS + np.sort(rng.uniform(0.0, 0.004, n)) for n in LENGTHS]
    found = read_recording(so101(tmp_path / "set", t=late), of(CURRENT, 1))
    np.testing.assert_array_equal(found.t, late[1].astype(np.float32))


def without(*names: str):
    def made(folder: Path) -> Path:
        so101(folder)
        for name in names:
            (folder / name).unlink()
        return folder

    return made


def edited(**changes):
    def made(folder: Path) -> Path:
        path = so101(folder) / "meta/info.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | changes))
        return folder

    return made


def truncated(folder: Path) -> Path:
    (so101(folder) / "meta/info.json").write_bytes(b'{"fps": 50, "fea')
    return folder


TWO = ("pos", "current", "torque")
DATA, LIST = "data/chunk-000/file-000.parquet", "meta/episodes/chunk-000/file-000.parquet"
LATE = [2.0 * np.arange(n) / FPS for n in LENGTHS]
FRAMES = [[(0, slice(None)), (1, slice(40, None)), (1, slice(0, 40)), (2, slice(None))]]
SAID = {
    r"3 episodes, 0 to 2; choose one \(--episode": CURRENT,
    "no episode 3; there are 3 episodes, 0 to 2": of(CURRENT, 3),
    "joint 'wrist'; there are shoulder_pan": replace(of(CURRENT, 1), joints=("wrist",)),
}
MADE = {
    r"unit of currents is not declared: .*; the quantity in observation\.state\.shoulder_pan\.torque, .* not": (
        lambda folder: so101(folder, "pos", "torque")
    ),
    "no column is declared for currents.*shoulder_pan": lambda folder: so101(folder, "pos"),
    r"several kinds of current: .*state\.\{joint\}\.current, observation\.state\.\{joint\}\.torque; ": (
        lambda folder: so101(folder, *TWO)
    ),
    r"v2 is not a finite number at row 8 \(1 such values\)": lambda folder: so101(folder, nan=(7, 4)),
    r"set: meta/info\.json: not JSON": truncated,
    r"'v1\.6'.*v2\.0 to v3\.0": edited(codebase_version="v1.6"),
    r"episodes\.jsonl is missing": edited(codebase_version="v2.1"),
    "fps = 0: expected": edited(fps=0),
    r"timestamps advance by 0\.04 s a frame, but fps = 50 of meta/info\.json says 0\.02 s": (
        lambda folder: so101(folder, t=LATE)
    ),
    "1 has 0 of its 80 frames": without(DATA),
    "episodes has no Parquet file": without(LIST),
    "frame_index of episode 1 is 40 at its row 1, expected 0": lambda folder: so101(folder, files=FRAMES),
}


@pytest.mark.parametrize("message", [*SAID, *MADE])
def test_what_is_wrong_with_a_dataset_is_one_line(tmp_path, message):
    folder = MADE.get(message, so101)(tmp_path / "set")
    with pytest.raises(RecordingError, match=message) as caught:
        read_recording(folder, SAID.get(message, of(CURRENT, 1)))
    assert re.match(rf"{re.escape(str(folder))}[^\n]*$", str(caught.value))
    assert len(str(caught.value)) < 500 + len(str(folder))
