"""Writing of recordings as episodes of a LeRobot dataset, version 3, without loss of digits.

`observation.state` has the positions, then v, of all joints as float64, and `timestamp` is t as it was recorded,
float64 too. In addition to the keys of LeRobot, the feature has `units` of its entries and `signal`, the quantity of v.
Recordings have no commands, so there is no `action`.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ident.recordings.formats.lerobot import EPISODE, FPS_TOL, FRAME, LENGTH, TIME
from ident.recordings.formats.lerobot_info import DATA, EPISODES, FILES, INFO, STATE, STATS, TASKS
from ident.recordings.formats.meaning import MEANINGS
from ident.recordings.formats.parquet import arrow_array
from ident.recordings.recording import JITTER_TOL, Recording
from ident.support.arrays import Array
from ident.support.errors import RecordingError
from ident.support.naming import one_line

DATA_PATH = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
TASK = "motion for the identification of drive gains"
PANDAS = {
    "index_columns": ["task"],
    "column_indexes": [],
    "columns": [
        {"name": name, "field_name": name, "pandas_type": kind, "numpy_type": stored, "metadata": None}
        for name, kind, stored in (("task_index", "int64", "int64"), ("task", "unicode", "object"))
    ],
    "pandas_version": "2.0.0",
}
"""Metadata that make `task` the index of the table of tasks, as LeRobot requires."""


def write_dataset(
    recordings: Sequence[Recording],
    folder: str | Path,
    *,
    joints: Sequence[str] | None = None,
    signal: str | None = None,
) -> None:
    """Write recordings as the episodes of a dataset.

    Args:
        recordings: At least one, with the same joints and rate.
        folder: The folder, created if missing.
        joints: Names of the joints, base to flange; `joint_1` .. if None.
        signal: Quantity of v, a name of `MEANINGS`; None for drive units.

    Raises:
        RecordingError: If recordings differ in joints or rates, or the folder has other data.
    """
    folder = Path(folder)
    names = _names(recordings, joints)
    fps = _fps(recordings)
    others = [p for kind in ("data", "meta/episodes") for p in sorted((folder / kind).glob("*/*.parquet"))]
    foreign = [path for path in others if path not in (folder / DATA, folder / EPISODES)]
    if foreign:
        raise RecordingError(
            f"{one_line(folder)}: contains another dataset, {one_line(foreign[0])}; give another folder"
        )
    for name in FILES:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
    unit = MEANINGS[signal].unit if signal else ""
    ending = "torque" if unit == "N m" else "current"
    state = {
        "dtype": "float64",
        "shape": [2 * len(names)],
        "names": [*(f"{name}.pos" for name in names), *(f"{name}.{ending}" for name in names)],
        "units": ["rad"] * len(names) + [unit] * len(names),
    } | ({"signal": signal} if signal else {})
    columns = _columns(recordings)
    lengths = [len(each.t) for each in recordings]
    info = {
        "codebase_version": "v3.0",
        "robot_type": None,
        "total_episodes": len(recordings),
        "total_frames": sum(lengths),
        "total_tasks": 1,
        "chunks_size": 1000,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": fps,
        "splits": {"train": f"0:{len(recordings)}"},
        "data_path": DATA_PATH,
        "video_path": None,
        "features": {STATE: state}
        | {name: {"dtype": str(x.dtype), "shape": [1], "names": None} for name, x in columns.items() if x.ndim == 1},
    }
    _write_tables(folder, columns, lengths)
    (folder / INFO).write_text(json.dumps(info, indent=4) + "\n", encoding="utf-8")
    (folder / STATS).write_text(json.dumps(_stats(columns), indent=4) + "\n", encoding="utf-8")


def _names(recordings: Sequence[Recording], joints: Sequence[str] | None) -> tuple[str, ...]:
    numbers = {each.n for each in recordings}
    if len(numbers) != 1:
        raise RecordingError(
            f"{len(recordings)} recordings of {', '.join(map(str, sorted(numbers))) or 'no'} joints; a dataset has "
            "episodes of the same joints"
        )
    (n,) = numbers
    names = tuple(joints) if joints is not None else tuple(f"joint_{j + 1}" for j in range(n))
    if len(set(names)) != n:
        raise RecordingError(f"{len(set(names))} different names for {n} joints; give each joint its own name")
    return names


def _fps(recordings: Sequence[Recording]) -> float:
    """Return the frames per second [1/s], rounded to an integer if within jitter."""
    rates = [1.0 / each.period for each in recordings]
    if max(rates) > (1.0 + FPS_TOL) * min(rates):
        raise RecordingError(
            f"recordings of {min(rates):.4g} to {max(rates):.4g} Hz; a dataset has "
            "one rate, so write a dataset for each rate"
        )
    mean = float(np.mean(rates))
    return round(mean) if abs(round(mean) / mean - 1.0) <= JITTER_TOL else mean


def _columns(recordings: Sequence[Recording]) -> dict[str, np.ndarray]:
    """Return the concatenated columns of all episodes, (N,) and (N, 2 n)."""
    lengths = [len(each.t) for each in recordings]
    return {
        STATE: np.concatenate([np.column_stack((each.q, each.v)) for each in recordings]),
        TIME: np.concatenate([each.t for each in recordings]),
        FRAME: np.concatenate([np.arange(length) for length in lengths]),
        EPISODE: np.repeat(np.arange(len(lengths)), lengths),
        "index": np.arange(sum(lengths)),
        "task_index": np.zeros(sum(lengths), dtype=np.int64),
    }


def _write_tables(folder: Path, columns: Mapping[str, np.ndarray], lengths: Sequence[int]) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    data = {name: _arrow(x) for name, x in columns.items()}
    ends = np.cumsum(lengths).tolist()
    with pq.ParquetWriter(folder / DATA, pa.table(data).schema) as writer:  # one row group per episode, as in LeRobot
        for end, length in zip(ends, lengths, strict=True):
            writer.write_table(pa.table(data).slice(end - length, length))
    zeros = [0] * len(lengths)
    episodes = {
        EPISODE: list(range(len(lengths))),
        "tasks": [[TASK]] * len(lengths),
        LENGTH: list(lengths),
        "data/chunk_index": zeros,
        "data/file_index": zeros,
        "dataset_from_index": [end - length for end, length in zip(ends, lengths, strict=True)],
        "dataset_to_index": ends,
        "meta/episodes/chunk_index": zeros,
        "meta/episodes/file_index": zeros,
    }
    pq.write_table(pa.table(episodes), folder / EPISODES)
    tasks = pa.table({"task_index": [0], "task": [TASK]}, metadata={"pandas": json.dumps(PANDAS)})
    pq.write_table(tasks, folder / TASKS)


def _arrow(x: np.ndarray) -> "object":
    """Return a column of numbers or arrays."""
    import pyarrow as pa

    values = arrow_array(x.reshape(-1))
    return values if x.ndim == 1 else pa.FixedSizeListArray.from_arrays(values, x.shape[1])


def _stats(columns: Mapping[str, np.ndarray]) -> dict[str, dict[str, list[float]]]:
    """Return statistics of each feature, with which policies scale it."""
    wide: dict[str, Array] = {name: x.reshape(len(x), -1).astype(np.float64) for name, x in columns.items()}
    return {
        name: {
            "min": x.min(axis=0).tolist(),
            "max": x.max(axis=0).tolist(),
            "mean": x.mean(axis=0).tolist(),
            "std": x.std(axis=0).tolist(),
            "count": [len(x)],
        }
        for name, x in wide.items()
    }
