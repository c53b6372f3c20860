"""Logs in ROS 2 bags: folders, their `.db3` and `.mcap` files, and MCAP files of other recorders.

One topic of `sensor_msgs/JointState` or `control_msgs/DynamicJointState` is read: `stamp` of the headers [s], and
`NAME.position`, `NAME.effort` of each joint, or what its interfaces are. Needs the package `rosbags`.
"""

import importlib.util
import os
import struct
from array import array
from collections.abc import Iterable, Sequence, Set
from contextlib import AbstractContextManager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ident.recordings.description import JOINT_STATES, LogDescription
from ident.recordings.formats import Columns, LogFormat, Table, check_size, check_unpacked, listed, readable
from ident.support.arrays import Array
from ident.support.errors import RecordingError
from ident.support.files import check_file
from ident.support.naming import nearest, needed_extra, one_line, shown

if TYPE_CHECKING:
    from rosbags.interfaces import Connection
    from rosbags.typesys.stores.latest import sensor_msgs__msg__JointState as JointState

STAMP, POSITION, EFFORT = "stamp", ".position", ".effort"
LOGGED = ""
"""Name of the times of logging [ns], which no table has."""
TYPE, DYNAMIC = "sensor_msgs/msg/JointState", "control_msgs/msg/DynamicJointState"
INTERFACES = f"""std_msgs/Header header
string[] joint_names
control_msgs/InterfaceValue[] interface_values
{"=" * 80}
MSG: control_msgs/InterfaceValue
string[] interface_names
float64[] values
"""
"""Definition of `DYNAMIC`, which the library has not."""
NO_CURRENT = (POSITION, ".velocity", ".acceleration")
"""Endings of values that are neither a current nor a torque."""
METADATA = "metadata.yaml"
LARGEST = 16_000_000_000
"""Largest size of a file [bytes]; chunks are read one at a time."""
HEADER, CHUNK = 1, 6
"""Codes of records of an MCAP file: the first one, and those that hold others, compressed."""
LARGEST_CHUNK = 100_000_000
"""Largest size of an unpacked chunk or message [bytes]; writers begin a new one after some megabytes."""


def open_ros(path: Path, description: LogDescription) -> Table:
    """Read the messages of one topic; raises without `rosbags`, for no bag, or if a topic must be chosen."""
    if path.suffix.lower() == ".bag":
        raise RecordingError("this is a ROS 1 bag; convert it to ROS 2 with rosbags-convert")
    if path.is_dir() and (path / METADATA).is_file():
        check_file(path / METADATA, most_bytes=10_000_000, error=RecordingError)
    else:
        check_file(path, most_bytes=LARGEST, error=RecordingError)
    if importlib.util.find_spec("rosbags") is None:
        raise RecordingError(needed_extra("rosbags") or "")
    from rosbags.rosbag2 import Reader
    from rosbags.rosbag2.storage_mcap import zstd

    with _readable():
        for each in path.glob("*.mcap") if path.is_dir() else [path] * (path.suffix == ".mcap"):
            _check_chunks(each)
    with _readable(), Reader(path) as reader:
        for storage in getattr(reader.storage, "storages", ()) if reader.compression_mode == "message" else ():
            for *_, message in storage.messages(storage.connections):
                check_unpacked(zstd.open(BytesIO(message)), LARGEST_CHUNK)
        connections = _connections(reader.connections, description.topic)
        tables = _tables(reader.messages(connections))
    if not tables:
        raise RecordingError(f"topic {one_line(connections[0].topic)} has no message")

    def load(wanted: Sequence[str], _: Set[str]) -> Columns:
        whole = [columns for columns in tables if columns.keys() >= set(wanted)]
        if not whole:
            raise RecordingError(
                f"no message has all needed values, {listed(wanted, 3)}; record a single publisher, whose "
                "messages have all of them"
            )
        order = np.argsort(np.concatenate([columns[LOGGED] for columns in whole]), kind="stable")
        found = {name: np.concatenate([columns[name] for columns in whole])[order] for name in wanted}
        if STAMP in found and not found[STAMP].any():
            raise RecordingError("the stamp of every header is 0; the publisher has to set it")
        return found

    names = dict.fromkeys(name for columns in tables for name in columns if name not in (LOGGED, STAMP))
    endings = dict.fromkeys(name[name.rindex(".") :] for name in names)

    def by_joint(ending: str, unit: str) -> dict[str, tuple[str, str]]:
        return {name.removesuffix(ending): (name, unit) for name in names if name.endswith(ending)}

    return Table(
        [STAMP, *names],
        load,
        layout=JOINT_STATES,
        time=STAMP,
        positions=by_joint(POSITION, "rad"),
        currents={f"{{joint}}{each}": by_joint(each, "") for each in endings if each not in NO_CURRENT},
    )


def _check_chunks(path: Path) -> None:
    """Refuse an MCAP file not of ROS 2, or with a chunk of more than `LARGEST_CHUNK`, which is unpacked whole."""
    import lz4.frame
    from rosbags.rosbag2.storage_mcap import zstd

    opened = {b"zstd": zstd.open, b"lz4": lz4.frame.open}
    with path.open("rb") as file:
        file.seek(len(b"\x89MCAP0\r\n"))
        while len(head := file.read(9)) == 9:
            kind, size = struct.unpack("<BQ", head)
            end = file.tell() + size
            if kind == HEADER and file.read(8)[4:] != b"ros2":  # a length, and the profile
                advice = "write its messages as JSON lines, such as by `mcap cat --json`, and name that file .jsonl"
                raise RecordingError(f"an MCAP file of other messages than those of ROS 2; {advice}")
            if kind == CHUNK:
                *_, length = struct.unpack("<QQQII", file.read(32))  # of the name of the compression
                if compression := opened.get(file.read(length)):
                    file.seek(8, os.SEEK_CUR)
                    check_unpacked(compression(BytesIO(file.read(end - file.tell()))), LARGEST_CHUNK)
            file.seek(end)


def _readable() -> AbstractContextManager[None]:
    """Convert errors of the library for damaged files and other formats to errors of the file."""
    import apsw
    from rosbags.rosbag2 import ReaderError
    from rosbags.rosbag2.storage_mcap import zstd
    from rosbags.serde import SerdeError
    from ruamel.yaml.error import YAMLError

    errors = (ReaderError, SerdeError, apsw.Error, YAMLError, zstd.ZstdError)
    return readable(f"a readable ROS 2 bag or MCAP file with messages {TYPE}", *errors)


def _connections(there: "Sequence[Connection]", topic: str | None) -> "list[Connection]":
    """Return the connections of a topic, or of the only one."""
    kinds = (TYPE,) if topic is None and any(each.msgtype == TYPE for each in there) else (TYPE, DYNAMIC)
    states = [each for each in there if each.msgtype in kinds]
    topics = sorted({each.topic for each in states})
    if not topics:
        there_are = sorted({f"{each.topic} ({each.msgtype})" for each in there})
        raise RecordingError(f"no topic of {TYPE}; there are {listed(there_are) or 'none'}")
    if topic is None and len(topics) > 1:
        raise RecordingError(f"several topics of {TYPE}: {listed(topics)}; choose one (--topic)")
    topic = topic or topics[0]
    if topic not in topics:
        raise RecordingError(f"no topic {shown(topic)} of {TYPE}{nearest(topic, topics)}; there are {listed(topics)}")
    return [each for each in states if each.topic == topic]


def _tables(messages: "Iterable[tuple[Connection, int, bytes]]") -> list[dict[str, Array]]:
    """Return columns of the messages with the same joints, and their times of logging [ns]."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store, count = get_typestore(Stores.LATEST), 0
    store.register(get_types_from_msg(INTERFACES, DYNAMIC))
    tables: dict[tuple[str, ...], array[float]] = {}  # by names of columns, row after row
    for connection, logged, message in messages:
        state = store.deserialize_cdr(message, connection.msgtype)
        values = _by_interface(state) if connection.msgtype == DYNAMIC else _by_joint(cast("JointState", state))
        stamp = state.header.stamp.sec + 1e-9 * state.header.stamp.nanosec
        values = {LOGGED: logged, STAMP: stamp, **values}
        count += len(values)
        check_size(count)
        tables.setdefault(tuple(values), array("d")).extend(values.values())
    return [dict(zip(names, np.reshape(rows, (-1, len(names))).T, strict=True)) for names, rows in tables.items()]


def _by_joint(state: "JointState") -> dict[str, float]:
    names, *counts = state.name, len(state.position), len(state.effort)
    if counts[0] != len(names) or counts[1] not in (0, len(names)):
        raise RecordingError(f"a message of {len(names)} names, {counts[0]} positions, {counts[1]} efforts")
    found = {name + POSITION: value for name, value in zip(names, state.position.tolist(), strict=True)}
    return found | dict(zip((name + EFFORT for name in names), state.effort.tolist(), strict=False))


def _by_interface(state: Any) -> dict[str, float]:  # of a type that only the library's store knows
    return {
        f"{joint}.{name}": value
        for joint, own in zip(state.joint_names, state.interface_values, strict=True)
        for name, value in zip(own.interface_names, own.values.tolist(), strict=True)
    }


ROS = LogFormat((".mcap", ".db3", ".bag"), open_ros, METADATA)
