"""Time and memory to read logs: a million samples of six joints in each format, in a process of its own.

Run by `make bench`. The checks of any recording, the same whatever the format, have a figure of their own.
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
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from ident.recordings.checks import check_log
from ident.recordings.description import LogDescription
from ident.recordings.files import read_log, write_recording
from ident.recordings.recording import Recording

SAMPLES, RUNS = 1_000_000, 3
JOINTS = tuple(f"joint_{j}" for j in range(1, 7))
KIND = "sensor_msgs/msg/JointState"


def motion() -> Recording:
    t = 1_710_000_000.0 + 1e-3 * np.arange(SAMPLES)
    q = np.sin(1e-3 * np.arange(SAMPLES)[:, None] * np.array([0.7, 0.9, 1.1, 0.5, 0.3, 1.3]) + np.arange(6))
    return Recording(t, q, 3.0 * np.cos(2.0 * q) + 0.1 * np.random.default_rng(0).standard_normal(q.shape))


def csv(log: Recording, path: Path) -> None:
    names = ["t", *(f"{kind}{j}" for kind in "qv" for j in range(1, 7))]
    pa.csv.write_csv(pa.table(dict(zip(names, np.column_stack((log.t, log.q, log.v)).T, strict=True))), path)


def bag(log: Recording, folder: Path) -> None:
    store = get_typestore(Stores.LATEST)
    State, Header, Time = (store.types[kind] for kind in (KIND, "std_msgs/msg/Header", "builtin_interfaces/msg/Time"))
    stamps = np.round(1e6 * np.arange(SAMPLES)).astype(np.int64) + 1_710_000_000 * 10**9
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topic = writer.add_connection("/joint_states", KIND, typestore=store)
        for ns, q, v in zip(stamps.tolist(), log.q, log.v, strict=True):
            state = State(Header(Time(*divmod(ns, 10**9)), "base_link"), list(JOINTS), q, np.empty(0), v)
            writer.write(topic, ns, store.serialize_cdr(state, KIND))


FORMATS: dict[str, Callable[[Recording, Path], None]] = {
    "log.parquet": write_recording,
    "log.csv": csv,
    "log.npz": lambda log, path: np.savez(path, t=log.t, q=log.q, v=log.v),
    "mcap": bag,
}


def read(path: Path) -> None:
    """Read once, and print what it took: reading, checks, memory."""
    said = LogDescription(signal="current" if path.is_dir() else None, joints=JOINTS)
    started = time.perf_counter(), time.process_time()
    log = read_log(path, said, check=None).recording
    reading = time.perf_counter() - started[0], time.process_time() - started[1]
    started = time.perf_counter()
    check_log(log)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    print(*reading, time.perf_counter() - started, memory)


def main() -> None:
    log = motion()
    with tempfile.TemporaryDirectory() as folder:
        for file, write in FORMATS.items():
            path = Path(folder) / file
            write(log, path)
            command = [sys.executable, __file__, str(path)]
            runs = [list(map(float, subprocess.check_output(command, text=True).split())) for _ in range(RUNS)]
            wall, cpu, checks, memory = map(min, zip(*runs, strict=True))
            print(
                f"{file}: {SAMPLES} samples of 6 joints read in {wall:.2f} s ({cpu:.2f} s of CPU), {memory:.0f} MB; "
                f"checks of any recording {checks:.2f} s"
            )


if __name__ == "__main__":
    read(Path(sys.argv[1])) if len(sys.argv) > 1 else main()
