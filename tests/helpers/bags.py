"""ROS 2 bags and MCAP files, written by `rosbags`."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)
KIND, DYNAMIC = "sensor_msgs/msg/JointState", "control_msgs/msg/DynamicJointState"
STORE.register(get_types_from_msg("string[] interface_names\nfloat64[] values", "control_msgs/msg/InterfaceValue"))
FIELDS = "std_msgs/Header header\nstring[] joint_names\ncontrol_msgs/InterfaceValue[] interface_values"
STORE.register(get_types_from_msg(FIELDS, DYNAMIC))
PLUGINS = {"sqlite3": StoragePlugin.SQLITE3, "mcap": StoragePlugin.MCAP}


@dataclass(frozen=True, kw_only=True)
class Sample:
    """One message: time of its header and of logging [s], and values by joint."""

    stamp: float
    names: Sequence[str]
    position: Sequence[float]
    effort: Sequence[float] = ()
    velocity: Sequence[float] = ()
    frame: str = "base_link"
    topic: str = "/joint_states"
    logged: float | None = None
    kind: str = KIND  # of `DYNAMIC`, effort is a current, and some joints have a velocity


def message(sample: Sample) -> bytes:
    """As CDR, by the library."""
    sec = int(np.floor(sample.stamp))
    Time, Header = STORE.types["builtin_interfaces/msg/Time"], STORE.types["std_msgs/msg/Header"]
    header = Header(stamp=Time(sec=sec, nanosec=round(1e9 * (sample.stamp - sec))), frame_id=sample.frame)
    if sample.kind == DYNAMIC:
        Values, own = STORE.types["control_msgs/msg/InterfaceValue"], list[object]()
        for k, (q, v) in enumerate(zip(sample.position, sample.effort, strict=True)):
            named = {"position": q, "current": v} if k % 2 else {"velocity": 9.9, "current": v, "position": q}
            own.append(Values(interface_names=list(named), values=np.array([*named.values()])))
        dynamic = STORE.types[DYNAMIC](header=header, joint_names=list(sample.names), interface_values=own)
        return bytes(STORE.serialize_cdr(dynamic, DYNAMIC))
    state = STORE.types[KIND](
        header=header,
        name=list(sample.names),
        position=np.asarray(sample.position, dtype=np.float64),
        velocity=np.asarray(sample.velocity, dtype=np.float64),
        effort=np.asarray(sample.effort, dtype=np.float64),
    )
    return bytes(STORE.serialize_cdr(state, KIND))


def write_bag(
    folder: Path, samples: Iterable[Sample], *, storage: str = "mcap", compressed: str = "", others: Sequence[str] = ()
) -> Path:
    """Write a bag; SQLite waits for the disk."""
    writer = Writer(folder, version=9, storage_plugin=PLUGINS[storage])
    if compressed:
        writer.set_compression(CompressionMode[compressed.upper()], CompressionFormat.ZSTD)
    with writer:
        texts = [writer.add_connection(topic, "std_msgs/msg/String", typestore=STORE) for topic in others]
        connections = {}
        for number, sample in enumerate(samples):
            if sample.topic not in connections:
                connections[sample.topic] = writer.add_connection(sample.topic, sample.kind, typestore=STORE)
            logged = sample.stamp if sample.logged is None else sample.logged
            writer.write(connections[sample.topic], round(1e9 * logged), message(sample))
            for text in texts:
                said = STORE.types["std_msgs/msg/String"](data=f"text {number}")
                writer.write(text, round(1e9 * logged), STORE.serialize_cdr(said, "std_msgs/msg/String"))
    return folder
