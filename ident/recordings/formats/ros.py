"""Logs in ROS 2 bags: folders, their `.db3` and `.mcap` files, and MCAP files of other recorders.

One topic of `sensor_msgs/JointState` is read: `stamp` of the headers [s], and `NAME.position`, `NAME.effort` of each
joint. Needs the package `rosbags`.
"""

import importlib.util
import struct
from array import array
from collections.abc import Generator, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias, cast

import numpy as np

from ident.recordings.formats.columns import MOST_VALUES, Columns, LogFormat, Request, listed
from ident.recordings.formats.layouts import EFFORT, POSITION, STAMP
from ident.support.arrays import Array
from ident.support.errors import RecordingError
from ident.support.extras import needed_extra
from ident.support.file_access import check_file
from ident.support.naming import nearest, one_line, shown

if TYPE_CHECKING:
    from rosbags.interfaces import Connection
    from rosbags.rosbag2 import Reader
    from rosbags.typesys.stores.latest import sensor_msgs__msg__JointState as JointState

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


def _numbers() -> "array[float]":
    return array("d")


@dataclass(frozen=True, slots=True)
class _Group:
    """Messages with the same joints.

    Attributes:
        names: Names of the n joints.
        logged: Times of logging [ns], of k messages.
        stamp: Times of their headers [s].
        position: Positions of all joints, message by message, k n numbers.
        effort: Efforts in the same order; empty if there are none.
    """

    names: tuple[str, ...]
    logged: "array[int]" = field(default_factory=lambda: array("q"))
    stamp: "array[float]" = field(default_factory=_numbers)
    position: "array[float]" = field(default_factory=_numbers)
    effort: "array[float]" = field(default_factory=_numbers)

    def add(self, logged: int, state: "JointState") -> None:
        """Append a message."""
        self.logged.append(logged)
        self.stamp.append(state.header.stamp.sec + 1e-9 * state.header.stamp.nanosec)
        self.position.extend(state.position.tolist())
        self.effort.extend(state.effort.tolist())

    @property
    def columns(self) -> dict[str, Array]:
        """Columns by name, each of shape (k,)."""
        position, effort = (np.array(each).reshape(len(self.stamp), -1) for each in (self.position, self.effort))
        found = {STAMP: np.array(self.stamp)}
        for joint, name in enumerate(self.names):
            found[name + POSITION] = position[:, joint]
            if effort.size:
                found[name + EFFORT] = effort[:, joint]
        return found


def read_ros(path: Path, request: Request) -> Columns:
    """Read the columns of a log.

    Raises:
        RecordingError: If `rosbags` is missing, the file is not a bag, a topic must be chosen, or joints are missing.
    """
    _check(path)
    from rosbags.rosbag2 import Reader

    with ExitStack() as opened:
        with _readable(path):
            reader = opened.enter_context(Reader(path))
            there = reader.connections
        connections = _connections(path, there, request)
        groups = _groups(path, _each_readable(path, _messages(reader, connections)))
    if not groups:
        raise RecordingError(f"{one_line(path)}: topic {one_line(connections[0].topic)} has no message")
    tables = [(np.array(group.logged), group.columns) for group in groups]
    names = dict.fromkeys(name for _, columns in tables for name in columns)
    return _columns(path, tables, request.chosen(path, list(names)).names)


def _check(path: Path) -> None:
    """Check that the path is a bag before imports."""
    if path.suffix.lower() == ".bag":
        raise RecordingError(f"{one_line(path)}: this is a ROS 1 bag; convert it to ROS 2 with rosbags-convert")
    if path.is_dir() and (path / METADATA).is_file():
        check_file(path / METADATA, most_bytes=10_000_000, error=RecordingError)
    else:
        check_file(path, most_bytes=LARGEST, error=RecordingError)
    if importlib.util.find_spec("rosbags") is None:
        raise RecordingError(f"{one_line(path)}: {needed_extra('rosbags')}")


@contextmanager
def _readable(path: Path) -> Generator[None]:
    """Convert errors of the library to errors of the file."""
    try:
        yield
    except _broken() as error:
        reason = one_line(str(error).splitlines()[0])[:150] if str(error) else type(error).__name__
        raise RecordingError(f"{one_line(path)}: not a readable ROS 2 bag or MCAP file ({reason})") from error


def _each_readable(path: Path, messages: Messages) -> Messages:
    """Yield messages with errors of the library converted."""
    while True:
        with _readable(path):
            found = next(messages, None)
        if found is None:
            return
        yield found


def _broken() -> tuple[type[Exception], ...]:
    """Exceptions of the library for files of other formats or damaged files."""
    import apsw
    from rosbags.rosbag2 import ReaderError
    from rosbags.rosbag2.storage_mcap import zstd
    from ruamel.yaml.error import YAMLError

    plain = (OSError, EOFError, ValueError, TypeError, KeyError, IndexError, AttributeError, AssertionError)
    other = (struct.error, RuntimeError, MemoryError, OverflowError)
    return (ReaderError, apsw.Error, YAMLError, zstd.ZstdError, *plain, *other)


def _connections(path: Path, there: "Sequence[Connection]", request: Request) -> "list[Connection]":
    """Return the connections of the requested topic."""
    states = [each for each in there if each.msgtype == TYPE]
    topics = sorted({each.topic for each in states})
    if not topics:
        kinds = sorted({f"{each.topic} ({each.msgtype})" for each in there})
        raise RecordingError(f"{one_line(path)}: no topic of {TYPE}; there are {listed(kinds) or 'none'}")
    topic = request.topic or topics[0]
    if request.topic is None and len(topics) > 1:
        raise RecordingError(f"{one_line(path)}: several topics of {TYPE}: {listed(topics)}; choose one (--topic)")
    if topic not in topics:
        raise RecordingError(
            f"{one_line(path)}: no topic {shown(topic)} of {TYPE}{nearest(topic, topics)}; there are {listed(topics)}"
        )
    found = [each for each in states if each.topic == topic]
    for each in found:
        encoding = getattr(each.ext, "serialization_format", "cdr")
        if encoding != "cdr":
            raise RecordingError(f"{one_line(path)}: messages of {one_line(topic)} are {encoding}, expected CDR")
    return found


def _messages(reader: "Reader", connections: "Sequence[Connection]") -> Messages:
    """Messages of some connections."""
    for storage in getattr(reader.storage, "storages", [reader.storage]):
        largest = max((chunk.uncompressed_size for chunk in getattr(storage, "chunks", ())), default=0)
        if largest > LARGEST_CHUNK:
            raise ValueError(f"a chunk of {largest / 1e6:.4g} MB")
    for _, time, message in reader.messages(connections):
        yield time, message


def _groups(path: Path, messages: Messages) -> list[_Group]:
    """Return the numbers of all messages, grouped by joints."""
    from rosbags.serde import SerdeError
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.LATEST)
    groups: dict[tuple[tuple[str, ...], bool], _Group] = {}
    values = 0
    for logged, message in messages:
        try:
            state = cast("JointState", store.deserialize_cdr(message, TYPE))
        except SerdeError as error:
            raise RecordingError(f"{one_line(path)}: a message cannot be read as {TYPE}: {one_line(error)}") from error
        names, efforts = tuple(state.name), len(state.effort)
        if len(state.position) != len(names) or efforts not in (0, len(names)):
            counts = f"{len(names)} names, {len(state.position)} positions and {efforts} efforts"
            raise RecordingError(f"{one_line(path)}: a message cannot be read as {TYPE}: it has {counts}")
        values += 2 * len(names) + 1
        if values > MOST_VALUES:
            raise RecordingError(f"{one_line(path)}: over {MOST_VALUES} numbers on one topic; take a part of it")
        groups.setdefault((names, efforts > 0), _Group(names)).add(logged, state)
        if len(groups) > MOST_KINDS:
            raise RecordingError(f"{one_line(path)}: over {MOST_KINDS} kinds of messages on one topic")
    return list(groups.values())


def _columns(path: Path, tables: Sequence[tuple[np.ndarray, Columns]], wanted: Sequence[str]) -> Columns:
    """Return the requested columns in order of logging, from messages with all of them."""
    whole: list[tuple[np.ndarray, Columns]] = []
    for logged, columns in tables:
        lacking = [name for name in wanted if name not in columns]
        if not lacking:
            whole.append((logged, columns))
        elif len(lacking) < len(set(wanted) - {STAMP}):
            raise RecordingError(
                f"{one_line(path)}: {len(lacking)} of the needed values, {listed(lacking, 3)}, are not in the same "
                "messages as the others; record a single publisher, whose messages have all of them"
            )
    order = np.argsort(np.concatenate([logged for logged, _ in whole]), kind="stable")
    found = {name: np.concatenate([columns[name] for _, columns in whole])[order] for name in wanted}
    if STAMP in found and not found[STAMP].any():
        raise RecordingError(f"{one_line(path)}: the stamp of every header is 0; the publisher has to set it")
    return found


ROS = LogFormat((".mcap", ".db3", ".bag"), read_ros, METADATA)
