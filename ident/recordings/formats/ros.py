"""Logs in ROS 2 bags: folders, their `.db3` and `.mcap` files, and MCAP files of other recorders.

One topic of `sensor_msgs/JointState` is read: `stamp` of the headers [s], and `NAME.position`, `NAME.effort` of each
joint. Needs the package `rosbags`.
"""

import importlib.util
import struct
from collections.abc import Generator, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from ident.recordings.formats.columns import MOST_VALUES, Columns, LogFormat, Request, listed
from ident.recordings.formats.joint_state_messages import (
    JointStates,
    NotJointStates,
    alike,
    joint_states,
    message_layout,
)
from ident.recordings.formats.layouts import EFFORT, POSITION, STAMP
from ident.support.arrays import Array, Indices
from ident.support.errors import RecordingError
from ident.support.extras import needed_extra
from ident.support.file_access import check_file
from ident.support.naming import nearest, one_line, shown

if TYPE_CHECKING:
    from rosbags.interfaces import Connection
    from rosbags.rosbag2 import Reader

TYPE = "sensor_msgs/msg/JointState"
METADATA = "metadata.yaml"
LARGEST = 16_000_000_000
"""Bytes of a file; chunks are read one at a time."""
LARGEST_CHUNK = 1_000_000_000
"""Bytes of an unpacked chunk; writers begin a new one after some megabytes."""
AT_ONCE = 4096
"""Messages that are taken as one array."""
MOST_LAYOUTS = 64
"""Layouts of messages on one topic; each publisher has one."""
Messages: TypeAlias = Iterator[tuple[Indices, np.ndarray]]
"""Times of logging [ns], shape (k,), and bytes, shape (k, length)."""
_Key: TypeAlias = tuple[tuple[str, ...], bool]
"""Names of joints, and whether they have efforts."""
_Logged: TypeAlias = tuple[Indices, JointStates]
"""Times of logging [ns], shape (k,), and numbers."""


def read_ros(path: Path, request: Request) -> Columns:
    """Read the columns of a log.

    Raises:
        RecordingError: If `rosbags` is missing, the file is no bag, a topic has to be chosen, or joints are missing.
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
    names = list[str]()
    for states in groups.values():
        names += _names(states[0][1])
    wanted = request.chosen(path, list(dict.fromkeys(names))).names
    return _columns(path, list(groups.values()), wanted)


def _check(path: Path) -> None:
    """Refuse what is there to be no bag, before anything is imported."""
    if path.suffix.lower() == ".bag":
        raise RecordingError(f"{one_line(path)}: a bag of ROS 1; make one of ROS 2 of it with rosbags-convert")
    if path.is_dir() and (path / METADATA).is_file():
        check_file(path / METADATA, most_bytes=10_000_000, error=RecordingError)
    else:
        check_file(path, most_bytes=LARGEST, error=RecordingError)
    if importlib.util.find_spec("rosbags") is None:
        raise RecordingError(f"{one_line(path)}: {needed_extra('rosbags')}")


@contextmanager
def _readable(path: Path) -> Generator[None]:
    """Around calls of the library alone: our own mistakes are no damage of a file."""
    try:
        yield
    except _broken() as error:
        reason = one_line(str(error).splitlines()[0])[:150] if str(error) else type(error).__name__
        raise RecordingError(f"{one_line(path)}: not a readable ROS 2 bag or MCAP file ({reason})") from error


def _each_readable(path: Path, messages: Messages) -> Messages:
    """The same messages, each one taken from the library by itself."""
    while True:
        with _readable(path):
            found = next(messages, None)
        if found is None:
            return
        yield found


def _broken() -> tuple[type[Exception], ...]:
    """What the library raises at files that are none, or are damaged."""
    import apsw
    from rosbags.rosbag2 import ReaderError
    from rosbags.rosbag2.storage_mcap import zstd
    from ruamel.yaml.error import YAMLError

    plain = (OSError, EOFError, ValueError, TypeError, KeyError, IndexError, AttributeError, AssertionError)
    other = (struct.error, RuntimeError, MemoryError, OverflowError)
    return (ReaderError, apsw.Error, YAMLError, zstd.ZstdError, *plain, *other)


def _connections(path: Path, there: "Sequence[Connection]", request: Request) -> "list[Connection]":
    """Those of the topic that is wanted."""
    states = [each for each in there if each.msgtype == TYPE]
    topics = sorted({each.topic for each in states})
    if not topics:
        kinds = sorted({f"{each.topic} ({each.msgtype})" for each in there})
        raise RecordingError(f"{one_line(path)}: no topic of {TYPE}; there are {listed(kinds) or 'none at all'}")
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
    """Messages of some connections, those of one length together."""
    for storage in getattr(reader.storage, "storages", [reader.storage]):
        largest = max((chunk.uncompressed_size for chunk in getattr(storage, "chunks", ())), default=0)
        if largest > LARGEST_CHUNK:
            raise ValueError(f"a chunk of {largest / 1e6:.4g} MB")
    walk = reader.messages(connections)
    while batch := list(islice(walk, AT_ONCE)):
        times = np.array([time for _, time, _ in batch], dtype=np.intp)
        sizes = np.array([len(message) for _, _, message in batch])
        for size in np.unique(sizes).tolist():
            own = np.flatnonzero(sizes == size)
            data = np.frombuffer(b"".join(bytes(batch[k][2]) for k in own), dtype=np.uint8)
            yield times[own], data.reshape(len(own), size)


def _groups(path: Path, messages: Messages) -> dict[_Key, list[_Logged]]:
    """Numbers of all messages, those of the same joints together."""
    groups: dict[_Key, list[_Logged]] = {}
    values, kinds = 0, set[bytes]()
    for times, rows in messages:
        while len(rows):
            try:
                layout = message_layout(rows[0].tobytes())
            except NotJointStates as error:
                raise RecordingError(f"{one_line(path)}: a message is no {TYPE}: {error}") from error
            same, kind = alike(rows, layout)
            kinds.add(kind)
            values += int(same.sum()) * (2 * len(layout.names) + 1)
            if len(kinds) > MOST_LAYOUTS:
                raise RecordingError(f"{one_line(path)}: over {MOST_LAYOUTS} kinds of messages on one topic")
            if values > MOST_VALUES:
                raise RecordingError(f"{one_line(path)}: over {MOST_VALUES} numbers on one topic; take a part of it")
            states = joint_states(rows if same.all() else rows[same], layout)
            groups.setdefault((layout.names, layout.effort is not None), []).append((times[same], states))
            times, rows = times[~same], rows[~same]
    return groups


def _columns(path: Path, groups: Sequence[list[_Logged]], wanted: Sequence[str]) -> Columns:
    """The wanted columns in order of logging, from the messages that have all of them."""
    whole: list[_Logged] = []
    for group in groups:
        table = _names(group[0][1])
        lacking = [name for name in wanted if name not in table]
        if not lacking:
            whole += group
        elif len(lacking) < len(set(wanted) - {STAMP}):
            raise RecordingError(
                f"{one_line(path)}: {len(lacking)} of the wanted values, {listed(lacking, 3)}, are not in the same "
                "messages as the others; record one publisher"
            )
    times = np.concatenate([time for time, _ in whole])
    order = slice(None) if (np.diff(times) >= 0).all() else np.argsort(times, kind="stable")
    tables = [_names(states) for _, states in whole]
    found = {name: np.concatenate([table[name] for table in tables])[order] for name in wanted}
    if STAMP in found and not found[STAMP].any():
        raise RecordingError(f"{one_line(path)}: the stamp of every header is 0; the publisher has to set it")
    return found


def _names(states: JointStates) -> dict[str, Array]:
    """Columns of messages by name."""
    found = {STAMP: states.stamp}
    for joint, name in enumerate(states.layout.names):
        found[name + POSITION] = states.position[:, joint]
        if states.effort is not None:
            found[name + EFFORT] = states.effort[:, joint]
    return found


ROS = LogFormat((".mcap", ".db3", ".bag"), read_ros, METADATA)
