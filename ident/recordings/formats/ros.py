"""Logs in ROS 2 bags: folders, their `.db3` and `.mcap` files, and MCAP files of other recorders.

One topic of `sensor_msgs/JointState` is read: `stamp` of the headers [s], and `NAME.position`, `NAME.effort` of each
joint. Needs the package `rosbags`.
"""

import importlib.util
from array import array
from collections.abc import Iterable, Sequence, Set
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from ident.recordings.description import JOINT_STATES, LogDescription
from ident.recordings.formats import Columns, LogFormat, Table, check_size, listed, readable
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
TYPE = "sensor_msgs/msg/JointState"
METADATA = "metadata.yaml"
LARGEST = 16_000_000_000
"""Largest size of a file [bytes]; chunks are read one at a time."""
LARGEST_CHUNK = 256_000_000
"""Largest size of an unpacked chunk [bytes]; writers begin a new one after some megabytes."""


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

    with _readable(), Reader(path) as reader:
        connections = _connections(reader.connections, description.topic)
        for storage in getattr(reader.storage, "storages", [reader.storage]):
            largest = max((chunk.uncompressed_size for chunk in getattr(storage, "chunks", ())), default=0)
            if largest > LARGEST_CHUNK:
                raise RecordingError(f"a chunk of {largest / 1e6:.4g} MB; up to {LARGEST_CHUNK / 1e6:g} are read")
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

    names = [name for name in dict.fromkeys(name for columns in tables for name in columns) if name != LOGGED]

    def by_joint(ending: str, unit: str) -> dict[str, tuple[str, str]]:
        return {name.removesuffix(ending): (name, unit) for name in names if name.endswith(ending)}

    return Table(
        names,
        load,
        layout=JOINT_STATES,
        time=STAMP,
        positions=by_joint(POSITION, "rad"),
        currents={f"{{joint}}{EFFORT}": by_joint(EFFORT, "")},
    )


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
    states = [each for each in there if each.msgtype == TYPE]
    topics = sorted({each.topic for each in states})
    if not topics:
        kinds = sorted({f"{each.topic} ({each.msgtype})" for each in there})
        raise RecordingError(f"no topic of {TYPE}; there are {listed(kinds) or 'none'}")
    if topic is None and len(topics) > 1:
        raise RecordingError(f"several topics of {TYPE}: {listed(topics)}; choose one (--topic)")
    topic = topic or topics[0]
    if topic not in topics:
        raise RecordingError(f"no topic {shown(topic)} of {TYPE}{nearest(topic, topics)}; there are {listed(topics)}")
    return [each for each in states if each.topic == topic]


def _tables(messages: Iterable[tuple[object, int, bytes]]) -> list[dict[str, Array]]:
    """Return columns of the messages with the same joints, and their times of logging [ns]."""
    from rosbags.typesys import Stores, get_typestore

    store, values = get_typestore(Stores.LATEST), 0
    tables: dict[tuple[str, ...], array[float]] = {}  # by names of columns, row after row
    for _, logged, message in messages:
        state = cast("JointState", store.deserialize_cdr(message, TYPE))
        counts = len(state.name), len(state.position), len(state.effort)
        if counts[1] != counts[0] or counts[2] not in (0, counts[0]):
            raise RecordingError(f"a message of {counts[0]} names, {counts[1]} positions, {counts[2]} efforts")
        endings = (POSITION, EFFORT) if counts[2] else (POSITION,)
        names = (LOGGED, STAMP, *(name + ending for ending in endings for name in state.name))
        values += len(names)
        check_size(values)
        stamp = state.header.stamp.sec + 1e-9 * state.header.stamp.nanosec
        tables.setdefault(names, array("d")).extend((logged, stamp, *state.position, *state.effort))
    return [dict(zip(names, np.reshape(rows, (-1, len(names))).T, strict=True)) for names, rows in tables.items()]


ROS = LogFormat((".mcap", ".db3", ".bag"), open_ros, METADATA)
