"""Time and memory of the doors for logs: a million samples of six joints in each format, read in a process of its own.

Run by `make bench`. What a recording is checked for besides, the same whatever the format, has a line of its own.
"""

import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from ident.recordings.checks import check_log
from ident.recordings.description import LogDescription
from ident.recordings.files import read_unchecked, write_recording
from ident.recordings.recording import Recording

SAMPLES, RUNS = 1_000_000, 3
JOINTS = tuple(f"joint_{j}" for j in range(1, 7))
KIND = "sensor_msgs/msg/JointState"


def motion() -> Recording:
    """A million samples at 1 kHz."""
    t = 1_710_000_000.0 + 1e-3 * np.arange(SAMPLES)
    q = np.sin(1e-3 * np.arange(SAMPLES)[:, None] * np.array([0.7, 0.9, 1.1, 0.5, 0.3, 1.3]) + np.arange(6))
    return Recording(t, q, 3.0 * np.cos(2.0 * q) + 0.1 * np.random.default_rng(0).standard_normal(q.shape))


def csv(log: Recording, path: Path, separator: str, names: list[str]) -> None:
    """Every digit."""
    table = pa.table(dict(zip(names, np.column_stack((log.t, log.q, log.v)).T, strict=True)))
    pa.csv.write_csv(table, path, pa.csv.WriteOptions(delimiter=separator, quoting_style="none"))


def bag(log: Recording, folder: Path, storage: StoragePlugin, packed: bool) -> None:
    """Messages with names, positions and efforts."""
    store = get_typestore(Stores.LATEST)
    State, Header, Time = (store.types[kind] for kind in (KIND, "std_msgs/msg/Header", "builtin_interfaces/msg/Time"))
    ns = np.round(1e6 * np.arange(SAMPLES)).astype(np.int64) + 1_710_000_000 * 10**9
    writer = Writer(folder, version=9, storage_plugin=storage)
    if packed:
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with writer:
        topic = writer.add_connection("/joint_states", KIND, typestore=store)
        for time_ns, q, v in zip(ns.tolist(), log.q, log.v, strict=True):
            header = Header(Time(*divmod(time_ns, 10**9)), "base_link")
            state = State(header, list(JOINTS), q, np.empty(0), v)
            writer.write(topic, time_ns, store.serialize_cdr(state, KIND))


def own_names() -> list[str]:
    return ["t", *(f"{kind}{j}" for kind in "qv" for j in range(1, 7))]


def rtde_names() -> list[str]:
    return ["timestamp", *(f"{kind}_{j}" for kind in ("actual_q", "actual_current") for j in range(6))]


FORMATS: dict[str, tuple[str, Callable[[Recording, Path], None]]] = {
    "Parquet": ("log.parquet", write_recording),
    "CSV": ("log.csv", lambda log, path: csv(log, path, ",", own_names())),
    "CSV of UR RTDE": ("rtde.csv", lambda log, path: csv(log, path, " ", rtde_names())),
    "NumPy": ("log.npz", lambda log, path: np.savez(path, t=log.t, q=log.q, v=log.v)),
    "MCAP": ("mcap", lambda log, path: bag(log, path, StoragePlugin.MCAP, packed=False)),
    "MCAP, zstd": ("packed", lambda log, path: bag(log, path, StoragePlugin.MCAP, packed=True)),
    "bag, sqlite3": ("sqlite3", lambda log, path: bag(log, path, StoragePlugin.SQLITE3, packed=False)),
}
"""A file name and how it is written."""


def read(path: Path) -> None:
    """Read once, and print what it took: the door, to a recording; the checks behind it; memory."""
    said = LogDescription(signal="current" if path.is_dir() else None, joints=JOINTS)
    started = time.perf_counter(), time.process_time()
    log = read_unchecked(path, said).recording
    door = time.perf_counter() - started[0], time.process_time() - started[1]
    started = time.perf_counter()
    check_log(log)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    print(*door, time.perf_counter() - started, memory)


def main() -> None:
    """Write each format, read it some times, print the best."""
    log = motion()
    with tempfile.TemporaryDirectory() as folder:
        for name, (file, write) in FORMATS.items():
            path = Path(folder) / file
            write(log, path)
            runs = [
                list(map(float, subprocess.check_output([sys.executable, __file__, str(path)], text=True).split()))
                for _ in range(RUNS)
            ]
            wall, cpu, checks, memory = map(min, zip(*runs, strict=True))
            size = sum(each.stat().st_size for each in [*path.glob("*"), path]) / 1e6
            print(
                f"{name}: {SAMPLES} samples of 6 joints, {size:.0f} MB, read in {wall:.2f} s ({cpu:.2f} s of CPU), "
                f"{memory:.0f} MB; checks of any recording {checks:.2f} s"
            )


if __name__ == "__main__":
    read(Path(sys.argv[1])) if len(sys.argv) > 1 else main()
