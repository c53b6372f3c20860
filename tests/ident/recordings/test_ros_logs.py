"""Bags and MCAP files written by `rosbags` are read back by joints' names, whatever their storage."""

import re
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bags import DYNAMIC, KIND, STORE, Sample, message, write_bag
from foreign_logs import unread
from rosbags.rosbag2 import Writer

from ident.recordings.description import LogDescription
from ident.recordings.files import read_log, read_recording
from ident.support.errors import RecordingError

JOINTS = ("shoulder", "elbow", "wrist_pitch")
LOGGED = ("elbow", "gripper", "wrist_pitch", "shoulder")
"""As the publisher has them: in another order, with one more."""
N = 70
T = 1_710_000_000.125 + 0.004 * np.arange(N)
Q = np.column_stack([np.sin((3.0 + k) * (T - T[0]) + k) for k in range(4)])
V = np.column_stack([1.7 * np.cos((2.0 + k) * (T - T[0]) - k) + 0.3 for k in range(4)])
WANTED = [LOGGED.index(joint) for joint in JOINTS]
DESCRIPTION = LogDescription(signal="current", joints=JOINTS)


def samples(**changes) -> list[Sample]:
    logs = [
        Sample(stamp=float(T[k]), names=LOGGED, position=Q[k], effort=V[k], velocity=-Q[k], logged=float(T[k]) + 0.7)
        for k in range(N)
    ]
    return [replace(each, **changes) for each in logs]


def assert_read(path: Path, description: LogDescription = DESCRIPTION) -> None:
    found = read_recording(path, description)
    # Stamps are whole nanoseconds, and float64 has 2.4e-7 s in 2024.
    np.testing.assert_allclose(found.t, T, rtol=0.0, atol=5e-7)
    np.testing.assert_array_equal(found.q, Q[:, WANTED])
    np.testing.assert_array_equal(found.v, V[:, WANTED])


STORAGES = [("sqlite3", "file"), ("sqlite3", "message"), ("sqlite3", ""), ("mcap", ""), ("mcap", "storage")]


@pytest.mark.parametrize(("storage", "compressed"), STORAGES)
def test_a_bag_is_read_back_by_the_joints_names(tmp_path, storage, compressed):
    bag = write_bag(tmp_path / "bag", samples(), storage=storage, compressed=compressed, others=["/chatter", "/a"])
    assert_read(bag)
    log = read_log(bag, DESCRIPTION)
    assert (log.layout, log.description.v.unit) == ("joint-states", ("A",) * 3)
    ending = ".db3" if storage == "sqlite3" else ".mcap"
    if not compressed:
        assert_read((bag / f"bag{ending}").rename(tmp_path / f"alone{ending}"))


@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_messages_without_the_joints_are_passed_over_and_order_may_change_and_be_late(tmp_path, storage):
    # Two publishers on one topic: the gripper alone, and the arm, whose names change places half-way.
    mixed = []
    for k, each in enumerate(samples()):
        turned = [3, 0, 1, 2] if k > 30 else [0, 1, 2, 3]
        changes = {"names": [LOGGED[j] for j in turned], "position": Q[k, turned], "effort": V[k, turned]}
        mixed.append(replace(each, **changes, frame="base" * (k % 3)))
        mixed.append(Sample(stamp=each.stamp, names=("jaw",), position=(0.1,), logged=each.logged))
    for first, last in ((10, 80), (24, 26)):  # logged late
        mixed[first], mixed[last] = mixed[last], mixed[first]
    assert_read(write_bag(tmp_path / "bag", mixed, storage=storage))


def test_values_by_interface_are_read_beside_a_topic_of_joint_states(tmp_path):
    dynamic = samples(topic="/dynamic_joint_states", kind=DYNAMIC)
    bag = write_bag(tmp_path / "bag", dynamic)
    assert_read(bag)
    assert read_log(bag, DESCRIPTION).description.v.columns == tuple(f"{joint}.current" for joint in JOINTS)
    halved = [replace(each, effort=0.5 * np.array(each.effort), topic="/dynamic", kind=DYNAMIC) for each in samples()]
    both = write_bag(tmp_path / "both", [each for pair in zip(samples(), halved, strict=True) for each in pair])
    assert_read(both)  # the only topic of its kind
    chosen = read_recording(both, replace(DESCRIPTION, topic="/dynamic"))
    np.testing.assert_array_equal(chosen.v, 0.5 * V[:, WANTED])


def test_joints_in_different_messages_and_stamps_out_of_order_are_refused(tmp_path):
    two = [
        replace(each, names=LOGGED[part], position=Q[k, part], effort=V[k, part], velocity=())
        for k, each in enumerate(samples())
        for part in (slice(2), slice(2, None))
    ]
    mixed = samples()
    mixed[41] = replace(mixed[41], stamp=float(T[38]) - 0.001)  # in the order of logging, row 42 goes back
    for name, logged, said in (
        ("two", two, r"no message has all .*shoulder.position.*; record a single publisher"),
        ("mixed", mixed, "time does not increase at row 42"),
    ):
        unread(said, write_bag(tmp_path / name, logged), DESCRIPTION)


def test_of_several_topics_one_has_to_be_chosen(tmp_path):
    two = samples(topic="/left/joint_states") + samples(topic="/right/joint_states", position=[0.3, 0.1, 0.2, 0.4])
    bag = write_bag(tmp_path / "bag", two, others=["/chatter"])
    unread(r"several topics of .*: /left/joint_states, /right/joint_states; choose", bag, DESCRIPTION)
    assert_read(bag, replace(DESCRIPTION, topic="/left/joint_states"))
    with pytest.raises(RecordingError, match=r"no topic '/left/joint_state' of .*JointState; did you mean"):
        read_recording(bag, replace(DESCRIPTION, topic="/left/joint_state"))


REFUSED = {
    "no joints": ({}, replace(DESCRIPTION, joints=None), r"order of the joints is not declared.*elbow, gripper, wrist"),
    "a strange joint": (
        {},
        replace(DESCRIPTION, joints=("shoulder_1", "elbow")),
        r"joint 'shoulder_1'; did you mean 'shoulder'\?; there are elbow, gripper",
    ),
    "no effort": ({"effort": ()}, DESCRIPTION, "no column is declared for currents.*; found stamp, elbow.position"),
    "no stamp": ({"stamp": 0.0}, DESCRIPTION, r"the stamp of every header is 0; the publisher has to set it"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_a_bag_lacks_is_said_in_one_line(tmp_path, name):
    changes, description, text = REFUSED[name]
    bag = write_bag(tmp_path / "bag", samples(**changes))
    assert unread(text, bag, description).startswith(f"{bag}: ")


def test_what_is_no_bag_of_joint_states_is_named(tmp_path, monkeypatch):
    with Writer(tmp_path / "texts", version=9) as writer:
        topic = writer.add_connection("/chatter", "std_msgs/msg/String", typestore=STORE)
        text = STORE.types["std_msgs/msg/String"](data="x")
        writer.write(topic, 1, STORE.serialize_cdr(text, "std_msgs/msg/String"))
    with Writer(tmp_path / "silent", version=9) as writer:
        writer.add_connection("/joint_states", KIND, typestore=STORE)
    (tmp_path / "other.mcap").write_bytes(b"\x89MCAP0\r\n\x01" + struct.pack("<QI4sI", 12, 4, b"ros1", 0))
    (tmp_path / "old.bag").write_bytes(b"#ROSBAG V2.0\n")
    for name, said in {
        "texts": r"no topic of .*JointState; there are /chatter \(std_msgs/msg/String\)",
        "silent": "topic /joint_states has no message",
        "other.mcap": "of other messages than those of ROS 2; write its messages as JSON lines",
        "old.bag": r"old\.bag: this is a ROS 1 bag; convert it to ROS 2 with rosbags-convert",
        ".": "is a folder; expected a regular file",
    }.items():
        unread(said, tmp_path / name, DESCRIPTION)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    unread(r"for ROS 2 bags and MCAP files: pip install .*\[ros\]", tmp_path / "texts", DESCRIPTION)


@pytest.mark.parametrize(("storage", "ending"), [("sqlite3", "db3"), ("mcap", "mcap")])
def test_a_damaged_file_is_one_line(tmp_path, storage, ending):
    bag = write_bag(tmp_path / "bag", samples(), storage=storage, compressed="storage" if storage == "mcap" else "")
    path = bag / f"bag.{ending}"
    whole = path.read_bytes()
    half = len(whole) // 2
    for broken in (whole[: half // 50], whole[:half], whole[:half] + b"\xa7" * half):
        path.write_bytes(broken)
        unread(rf"{re.escape(str(bag))}: [^\n]*$", bag, DESCRIPTION)
    (bag / "metadata.yaml").write_text("rosbag2: [")
    unread("not a readable ROS 2 bag or MCAP file", bag, DESCRIPTION)


LIMITS = [
    ("formats.MOST_VALUES", "storage", 10 * N + 9, 10 * N + 8, f"{10 * N + 9} numbers; up to {10 * N + 8} are read"),
    ("formats.ros.LARGEST_CHUNK", "storage", 10**5, 3000, r"more than 0\.003 MB unpacked"),
    ("formats.ros.LARGEST_CHUNK", "message", 3000, 150, r"more than 0\.00015 MB unpacked"),
]


@pytest.mark.parametrize(("limit", "compressed", "enough", "few", "said"), LIMITS)
def test_more_than_is_plausible_is_refused(tmp_path, monkeypatch, limit, compressed, enough, few, said):
    jaws = [Sample(stamp=1.0, names=(f"jaw_{k}",), position=(0.1,)) for k in range(3)]  # three numbers each
    storage = "mcap" if compressed == "storage" else "sqlite3"
    bag = write_bag(tmp_path / "bag", [*samples(), *jaws], storage=storage, compressed=compressed)
    monkeypatch.setattr(f"ident.recordings.{limit}", enough)
    assert_read(bag)
    monkeypatch.setattr(f"ident.recordings.{limit}", few)
    unread(said, bag, DESCRIPTION)


def test_what_an_mcap_file_says_of_the_size_of_a_chunk_is_not_believed(tmp_path, monkeypatch):
    bag = write_bag(tmp_path / "bag", samples(), compressed="storage")
    content = (bag / "bag.mcap").read_bytes()
    chunk = content.index(b"\x06", 40)  # after the header
    size = chunk + 25  # of its code, length and times
    assert int.from_bytes(content[size : size + 8], "little") > 3000
    (bag / "bag.mcap").write_bytes(content[:size] + (17).to_bytes(8, "little") + content[size + 8 :])
    monkeypatch.setattr("ident.recordings.formats.ros.LARGEST_CHUNK", 3000)
    unread("unpacked; take a part of it", bag, DESCRIPTION)


def test_messages_whose_numbers_do_not_fit_their_joints_are_refused(tmp_path):
    for number, changes in enumerate(({"position": Q[0, :3]}, {"effort": V[0, :3]})):
        bag = write_bag(tmp_path / f"{number}", samples(**changes))
        counts = f"4 names, {4 - (number == 0)} positions, {4 - (number == 1)} efforts$"
        unread(counts, bag, DESCRIPTION)


def test_messages_that_end_early_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("bags.message", lambda sample: message(sample)[:90])
    unread(r"cut: .*JointState.* at offset 84", write_bag(tmp_path / "cut", samples()), DESCRIPTION)
