"""Datasets as LeRobot v3 writes them, file by file, apart from our own writer: float32, stamped `frame_index / fps`."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute
import pyarrow.parquet as pq

FPS = 50
LENGTHS = (60, 80, 70)
"""Frames of the episodes."""
JOINTS = ("shoulder_pan", "shoulder_lift", "gripper")


def motion(episode: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (N,), positions and currents (N, 3) of an episode, the latter two as float32 holds them."""
    t = np.arange(LENGTHS[episode]) / FPS
    phase = 3.0 * t[:, None] * (1.0 + 0.2 * np.arange(3)) + 0.4 * np.arange(3) + episode
    q, v = 40.0 * np.sin(phase), 200.0 * np.cos(phase) + 20.0 * (episode + 1)
    return t, q.astype(np.float32).astype(float), v.astype(np.float32).astype(float)


def feature(dtype: str, width: int, names: object = None) -> dict[str, Any]:
    return {"dtype": dtype, "shape": [width], "names": names}


def openarm() -> tuple[dict[str, Any], list[np.ndarray]]:
    """Features and rows of a robot whose state has `.pos`, `.vel` and `.torque`, joint after joint."""
    names = [f"{joint}.{kind}" for joint in JOINTS for kind in ("pos", "vel", "torque")]
    rows = [np.stack((q, -q, v), axis=2).reshape(len(q), 9) for _, q, v in map(motion, range(len(LENGTHS)))]
    return {"observation.state": feature("float32", 9, names)}, rows


def write(
    folder: Path,
    features: dict[str, dict[str, Any]],
    rows: dict[str, Sequence[np.ndarray]],
    *,
    files: Sequence[Sequence[tuple[int, slice]]] = ([(0, slice(None)), (1, slice(None))], [(2, slice(None))]),
    t: Sequence[np.ndarray] | None = None,
    **info: object,
) -> Path:
    """Write a dataset."""
    stamps = [np.arange(length) / FPS for length in LENGTHS] if t is None else t
    for number, parts in enumerate(files):
        table = {
            name: pa.array(np.concatenate([each[e][s] for e, s in parts]).astype(features[name]["dtype"]).tolist(),
                           _type(features[name]))
            for name, each in rows.items()
        }  # fmt: skip
        table["timestamp"] = pa.array(np.concatenate([stamps[e][s] for e, s in parts]), pa.float64()).cast(pa.float32())
        table["frame_index"] = pa.array(np.concatenate([np.arange(LENGTHS[e])[s] for e, s in parts]))
        table["episode_index"] = pa.array(np.concatenate([np.full(LENGTHS[e], e)[s] for e, s in parts]))
        path = folder / f"data/chunk-000/file-{number:03d}.parquet"
        path.parent.mkdir(parents=True, exist_ok=True)
        pq.write_table(pa.table(table), path)
    (folder / "meta/episodes/chunk-000").mkdir(parents=True)
    episodes = {"episode_index": range(len(LENGTHS)), "length": LENGTHS, "tasks": [["wave"]] * len(LENGTHS)}
    pq.write_table(
        pa.table({k: list(v) for k, v in episodes.items()}), folder / "meta/episodes/chunk-000/file-000.parquet"
    )
    said = {
        "codebase_version": "v3.0",
        "robot_type": "so101_follower",
        "total_episodes": len(LENGTHS),
        "total_frames": sum(LENGTHS),
        "fps": FPS,
        "features": {
            **features,
            "observation.images.front": {"dtype": "video", "shape": [480, 640, 3], "names": ["height", "width", "c"]},
            "timestamp": feature("float32", 1),
            "frame_index": feature("int64", 1),
            "episode_index": feature("int64", 1),
        },
    } | info
    (folder / "meta/info.json").write_text(json.dumps(said, indent=4))
    return folder


def as_version_2(folder: Path) -> Path:
    """The same dataset as LeRobot wrote it before: a file an episode, lists of any length, JSON lines."""
    whole = pa.concat_tables([pq.read_table(each) for each in sorted(folder.glob("data/*/*.parquet"))])
    for old in (*folder.glob("data/*/*.parquet"), *folder.glob("meta/episodes/*/*.parquet")):
        old.unlink()
    for e in range(len(LENGTHS)):
        part = whole.filter(pa.compute.equal(whole["episode_index"], e))
        columns = {name: pa.array(part[name].to_pylist()) for name in part.column_names}
        pq.write_table(pa.table(columns), folder / f"data/chunk-000/episode_{e:06d}.parquet")
    rows = [json.dumps({"episode_index": e, "tasks": ["wave"], "length": n}) for e, n in enumerate(LENGTHS)]
    (folder / "meta/episodes.jsonl").write_text("\n".join(rows) + "\n")
    info = json.loads((folder / "meta/info.json").read_text()) | {"codebase_version": "v2.1"}
    (folder / "meta/info.json").write_text(json.dumps(info))
    return folder


def _type(said: dict[str, Any]) -> pa.DataType:
    kind = pa.from_numpy_dtype(np.dtype(said["dtype"]))
    (width,) = said["shape"]
    return kind if width == 1 else pa.list_(kind, width)
