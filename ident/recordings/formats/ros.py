"""Logs in ROS 2 bags: folders, their `.db3` and `.mcap` files, and MCAP files of other recorders.

One topic of `sensor_msgs/JointState` is read: `stamp` of the headers [s], and `NAME.position`, `NAME.effort` of each
joint. Needs the package `rosbags`.
"""

import importlib.util
import struct
from array import array
from collections.abc import Generator, Iterator, Sequence, Set
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np

from ident.recordings.description import LogDescription
from ident.recordings.formats import MOST_VALUES, Columns, LogFormat, Table, listed
from ident.support.arrays import Array
from ident.support.errors import RecordingError
from ident.support.files import check_file
from ident.support.naming import nearest, needed_extra, one_line, shown

if TYPE_CHECKING:
    from rosbags.interfaces import Connection
    from rosbags.rosbag2 import Reader
    from rosbags.typesys.stores.latest import sensor_msgs__msg__JointState as JointState

STAMP, POSITION, EFFORT = "stamp", ".position", ".effort"
LOGGED = ""
"""Name of the times of logging [ns], which no table has."""
TYPE = "sensor_msgs/msg/JointState"
METADATA = "metadata.yaml"
LARGEST = 16_000_000_000
"""Largest size of a file [bytes]; chunks are read one at a time."""
LARGEST_CHUNK = 1_000_000_000
"""Largest size of an unpacked chunk [bytes]; writers begin a new one after some megabytes."""
MOST_KINDS = 64
"""Largest number of sets of joints on one topic; each publisher has one."""
Messages: TypeAlias = Iterator[tuple[int, bytes]]
"""Times of logging [ns], and bytes."""


def open_ros(path: Path, description: LogDescription) -> Table:
    """Read the messages of one topic.

    Raises:
        RecordingError: If `rosbags` is missing, the file is not a bag, or a topic must be chosen; `load`, if joints are
            not in the same messages.
    """
    place = one_line(path)
    if path.suffix.lower() == ".bag":
        raise RecordingError(f"{place}: this is a ROS 1 bag; convert it to ROS 2 with rosbags-convert")
    if path.is_dir() and (path / METADATA).is_file():
        check_file(path / METADATA, most_bytes=10_000_000, error=RecordingError)
    else:
        check_file(path, most_bytes=LARGEST, error=RecordingError)
    if importlib.util.find_spec("rosbags") is None:
        raise RecordingError(f"{place}: {needed_extra('rosbags')}")
    from rosbags.rosbag2 import Reader

    with ExitStack() as opened:
        with _readable(place):
            reader = opened.enter_context(Reader(path))
            there = reader.connections
        connections = _connections(place, there, description.topic)
        tables = _tables(place, _messages(place, reader, connections))
    if not tables:
        raise RecordingError(f"{place}: topic {one_line(connections[0].topic)} has no message")

    def load(wanted: Sequence[str], _: Set[str]) -> Columns:
        whole: list[dict[str, Array]] = []
        for columns in tables:
            lacking = [name for name in wanted if name not in columns]
            if not lacking:
                whole.append(columns)
            elif len(lacking) < len(set(wanted) - {STAMP}):
                raise RecordingError(
                    f"{place}: {len(lacking)} of the needed values, {listed(lacking, 3)}, are not in the same messages "
                    "as the others; record a single publisher, whose messages have all of them"
                )
        order = np.argsort(np.concatenate([columns[LOGGED] for columns in whole]), kind="stable")
        found = {name: np.concatenate([columns[name] for columns in whole])[order] for name in wanted}
        if STAMP in found and not found[STAMP].any():
            raise RecordingError(f"{place}: the stamp of every header is 0; the publisher has to set it")
        return found

    names = dict.fromkeys(name for columns in tables for name in columns if name != LOGGED)
    return Table(list(names), load)


@contextmanager
def _readable(place: str) -> Generator[None]:
    """Convert errors of the library for damaged files and other formats to errors of the file."""
    import apsw
    from rosbags.rosbag2 import ReaderError
    from rosbags.rosbag2.storage_mcap import zstd
    from ruamel.yaml.error import YAMLError

    plain = (OSError, EOFError, ValueError, TypeError, KeyError, IndexError, AttributeError, AssertionError)
    other = (struct.error, RuntimeError, MemoryError, OverflowError)
    try:
        yield
    except (ReaderError, apsw.Error, YAMLError, zstd.ZstdError, *plain, *other) as error:
        reason = one_line(str(error).splitlines()[0])[:150] if str(error) else type(error).__name__
        raise RecordingError(f"{place}: not a readable ROS 2 bag or MCAP file ({reason})") from error


def _connections(place: str, there: "Sequence[Connection]", topic: str | None) -> "list[Connection]":
    """Return the connections of a topic, or of the only one."""
    states = [each for each in there if each.msgtype == TYPE]
    topics = sorted({each.topic for each in states})
    if not topics:
        kinds = sorted({f"{each.topic} ({each.msgtype})" for each in there})
        raise RecordingError(f"{place}: no topic of {TYPE}; there are {listed(kinds) or 'none'}")
    if topic is None and len(topics) > 1:
        raise RecordingError(f"{place}: several topics of {TYPE}: {listed(topics)}; choose one (--topic)")
    topic = topic or topics[0]
    if topic not in topics:
        raise RecordingError(
            f"{place}: no topic {shown(topic)} of {TYPE}{nearest(topic, topics)}; there are {listed(topics)}"
        )
    found = [each for each in states if each.topic == topic]
    for each in found:
        encoding = getattr(each.ext, "serialization_format", "cdr")
        if encoding != "cdr":
            raise RecordingError(f"{place}: messages of {one_line(topic)} are {encoding}, expected CDR")
    return found


def _messages(place: str, reader: "Reader", connections: "Sequence[Connection]") -> Messages:
    """Yield the messages of some connections, with errors of the library converted."""
    with _readable(place):
        for storage in getattr(reader.storage, "storages", [reader.storage]):
            largest = max((chunk.uncompressed_size for chunk in getattr(storage, "chunks", ())), default=0)
            if largest > LARGEST_CHUNK:
                raise ValueError(f"a chunk of {largest / 1e6:.4g} MB")
        messages = iter(reader.messages(connections))
    while True:  # errors of who uses the messages are not converted
        with _readable(place):
            found = next(messages, None)
        if found is None:
            return
        yield found[1], found[2]


def _tables(place: str, messages: Messages) -> list[dict[str, Array]]:
    """Return columns of the messages with the same joints, and their times of logging."""
    from rosbags.serde import SerdeError
    from rosbags.typesys import Stores, get_typestore

    store, values = get_typestore(Stores.LATEST), 0
    groups: dict[tuple[tuple[str, ...], bool], dict[str, array[Any]]] = {}
    for logged, message in messages:
        try:
            state = cast("JointState", store.deserialize_cdr(message, TYPE))
        except SerdeError as error:
            raise RecordingError(f"{place}: a message cannot be read as {TYPE}: {one_line(error)}") from error
        names, efforts = tuple(state.name), len(state.effort)
        if len(state.position) != len(names) or efforts not in (0, len(names)):
            counts = f"{len(names)} names, {len(state.position)} positions and {efforts} efforts"
            raise RecordingError(f"{place}: a message cannot be read as {TYPE}: it has {counts}")
        values += 2 * len(names) + 1
        if values > MOST_VALUES:
            raise RecordingError(f"{place}: over {MOST_VALUES} numbers on one topic; take a part of it")
        key = names, efforts > 0
        if key not in groups and len(groups) == MOST_KINDS:
            raise RecordingError(f"{place}: over {MOST_KINDS} kinds of messages on one topic")
        group = groups.setdefault(key, {LOGGED: array("q"), **{each: array("d") for each in (STAMP, POSITION, EFFORT)}})
        group[LOGGED].append(logged)
        group[STAMP].append(state.header.stamp.sec + 1e-9 * state.header.stamp.nanosec)
        group[POSITION].extend(state.position.tolist())
        group[EFFORT].extend(state.effort.tolist())
    found: list[dict[str, Array]] = []
    for (names, efforts), group in groups.items():
        columns = {each: np.array(group[each]) for each in (LOGGED, STAMP)}
        for ending in (POSITION, EFFORT) if efforts else (POSITION,):
            by_joint = np.reshape(group[ending], (len(group[STAMP]), len(names))).T
            columns |= {name + ending: each for name, each in zip(names, by_joint, strict=True)}
        found.append(columns)
    return found


ROS = LogFormat((".mcap", ".db3", ".bag"), open_ros, METADATA)
