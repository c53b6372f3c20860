"""Logs in datasets of LeRobot, version 3: one episode of the folder with `meta/info.json`, read or written.

A feature of `info.json` is a column of numbers, or of rows of numbers with a name each: `shoulder_pan.pos` of
`observation.state`. A position is an entry of `observation.state` that ends in `.pos` or has no ending; a current is
one that ends in `.current`, `.torque`, `.effort` or `.eff`, or an entry of a feature `observation.current`, `.torque`
or `.effort`. Columns have the names of the Parquet files, `observation.state[0]`, .., and also those of the entries,
`observation.state.shoulder_pan.pos`. Videos are ignored.

Recordings are written without loss of digits: `observation.state` has the positions, then v, of all joints as float64,
and `timestamp` is t as it was recorded, float64 too. In addition to the keys of LeRobot, the feature has `units` of its
entries and `signal`, the quantity of v. Recordings have no commands, so there is no `action`.
"""

import json
import math
import re
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias, cast

import numpy as np

from ident.recordings.description import MEANINGS, LogDescription
from ident.recordings.formats.parquet import arrow_array, open_parquet
from ident.recordings.formats.table import MOST_COLUMNS, Columns, LogFormat, Table, entry
from ident.recordings.recording import JITTER_TOL, Recording
from ident.support.arrays import Array
from ident.support.errors import RecordingError
from ident.support.files import read_bytes
from ident.support.naming import one_line, shown

ENDING = ".lerobot"
"""Ending of names of written datasets; a folder of any name is read."""
INFO, STATS, TASKS = "meta/info.json", "meta/stats.json", "meta/tasks.parquet"
DATA, EPISODES = "data/chunk-000/file-000.parquet", "meta/episodes/chunk-000/file-000.parquet"
FILES = (INFO, STATS, TASKS, EPISODES, DATA)
"""Files of a written dataset; others may have more files of data and of episodes."""
LARGEST = 10_000_000
"""Largest size of `meta/info.json` [bytes]."""
FPS_TOL = 0.01
"""Largest relative difference between the stamps' rate and `fps`: a larger one indicates another unit or rate.

Velocities have this relative error, inertial torques twice of it.
"""
EPISODE, FRAME, TIME, LENGTH = "episode_index", "frame_index", "timestamp", "length"
STATE = "observation.state"
POSITIONS = ("pos", "position")
CURRENTS = ("current", "torque", "effort", "eff")
CURRENT = re.compile(r"^observation\.current\.|\.current$")
"""Name of a column of currents, not torques."""
CURRENT_COLUMNS = ("observation.current", "observation.torque", "observation.effort")
"""Features with only currents."""
DEGREES = ("openarm_follower", "bi_openarm_follower")
"""Types of robots that LeRobot always logs in degrees and newton metres (its `DamiaoMotorsBus`)."""
Entries: TypeAlias = Mapping[str, tuple[str, str]]
"""Column and unit of each joint; the unit is empty if not stated."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Feature:
    """A feature of numbers; `names` and `units` of the entries of a row are empty if not stated."""

    name: str
    kind: str
    width: int
    names: tuple[str, ...]
    units: tuple[str, ...]
    signal: str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class DatasetInfo:
    """Metadata of a dataset.

    Attributes:
        robot: Type of the robot, None if not stated.
        fps: Frames per second [1/s].
        episodes: Number of episodes.
        features: Numeric features.
        others: Names of the other features: videos, images, texts.
    """

    robot: object
    fps: float
    episodes: int
    features: tuple[Feature, ...]
    others: tuple[str, ...]

    @property
    def columns(self) -> dict[str, str]:
        """Columns of the Parquet files by all their names."""
        stored, named = dict[str, str](), dict[str, str]()
        for each in self.features:
            columns = [each.name] if each.width == 1 else [entry(each.name, k) for k in range(each.width)]
            stored |= {column: column for column in columns}
            named |= {f"{each.name}.{name}": column for name, column in zip(each.names, columns, strict=False)}
        return named | stored

    @property
    def signal(self) -> str | None:
        """Quantity of the currents, if stated."""
        return next((feature.signal for feature in self.features if feature.signal), None)

    def entries(self, *, currents: bool) -> Mapping[str, Entries]:
        """Return columns and units of the joints' currents, or positions, by pattern: `{joint}` stands for a name."""
        found: dict[str, dict[str, tuple[str, str]]] = {}
        for feature in self.features:
            if feature.name not in (STATE, *CURRENT_COLUMNS):
                continue
            for number, name in enumerate(feature.names):
                stem, _, ending = name.rpartition(".")
                known = bool(stem) and ending in (*POSITIONS, *CURRENTS)
                if feature.name == STATE and "." in name and not known:
                    continue  # a velocity, a temperature, ..
                joint = stem if known else name
                pattern = f"{feature.name}.{{joint}}" + (f".{ending}" if known else "")
                current = pattern.startswith(CURRENT_COLUMNS) or pattern.rpartition(".")[2] in CURRENTS
                if current != currents:
                    continue
                unit = ""
                if feature.units:
                    unit = feature.units[number]
                elif self.robot in DEGREES:
                    unit = "deg" if not current else "N m" if pattern.endswith(".torque") else ""
                found.setdefault(pattern, {})[joint] = (f"{feature.name}.{name}", unit)
        return found


def read_info(folder: Path) -> DatasetInfo:
    """Return the metadata of a dataset.

    Raises:
        RecordingError: If it is not a dataset of LeRobot, version 3.
    """
    path = folder / INFO
    if not path.is_file():
        raise RecordingError(f"{one_line(folder)}: expected the folder of a LeRobot dataset, with {INFO}")
    place, content = one_line(path), read_bytes(path, most_bytes=LARGEST, error=RecordingError)
    try:
        stated = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise RecordingError(f"{place}: not JSON ({one_line(error)[:120]}); copy the dataset again") from error
    if not isinstance(stated, dict):
        raise RecordingError(f"{place}: {shown(stated)}; expected an object as LeRobot writes it")
    table = cast("dict[str, object]", stated)
    version, fps, episodes, features = map(table.get, ("codebase_version", "fps", "total_episodes", "features"))
    if version == "v2.1":  # the only older one that LeRobot converts
        raise RecordingError(
            f"{place}: a LeRobot dataset of version v2.1; convert it to v3.0 with LeRobot: python -m "
            "lerobot.scripts.convert_dataset_v21_to_v30 --repo-id=USER/NAME"
        )
    if not (isinstance(version, str) and version.startswith("v3.")):
        raise RecordingError(f"{place}: codebase_version = {shown(version)}; LeRobot datasets of version v3.0 are read")
    if isinstance(fps, bool) or not isinstance(fps, int | float) or not 0.0 < fps < math.inf:
        raise RecordingError(f"{place}: fps = {shown(fps)}; expected the frames per second, a number above 0")
    if isinstance(episodes, bool) or not isinstance(episodes, int) or episodes < 1:
        raise RecordingError(f"{place}: total_episodes = {shown(episodes)}; expected a number of at least 1")
    if not isinstance(features, dict):
        raise RecordingError(f"{place}: features = {shown(features)}; expected an object with one entry per feature")
    read = {name: _feature(name, each) for name, each in cast("dict[str, object]", features).items()}
    return DatasetInfo(
        robot=table.get("robot_type"),
        fps=float(fps),
        episodes=episodes,
        features=tuple(feature for feature in read.values() if feature is not None),
        others=tuple(name for name, feature in read.items() if feature is None),
    )


def _feature(name: str, stated: object) -> Feature | None:
    """Return a feature of numbers or rows of numbers, None for any other."""
    table = cast("dict[str, object]", stated if isinstance(stated, dict) else {})
    kind, shape, signal = map(table.get, ("dtype", "shape", "signal"))
    if not isinstance(kind, str) or not kind.startswith(("float", "int", "uint")):
        return None
    (width,) = cast("list[object]", shape) if isinstance(shape, list) and len(shape) == 1 else (None,)
    if isinstance(width, bool) or not isinstance(width, int) or not 1 <= width <= MOST_COLUMNS:
        return None
    names, units = _texts(table.get("names"), width), _texts(table.get("units"), width)
    return Feature(
        name=name, kind=kind, width=width, names=names, units=units, signal=signal if isinstance(signal, str) else None
    )


def _texts(stated: object, width: int) -> tuple[str, ...]:
    """Return names of entries: a list, or a single list within a list or an object; otherwise empty."""
    inner = list(cast("dict[str, object]", stated).values()) if isinstance(stated, dict) else stated
    if isinstance(inner, list) and len(inner) == 1 and isinstance(inner[0], list):
        inner = cast("list[object]", inner[0])
    elif isinstance(stated, dict):
        return ()
    texts = [each for each in cast("list[object]", inner) if isinstance(each, str)] if isinstance(inner, list) else []
    return tuple(texts) if len(texts) == width else ()


def open_lerobot(path: Path, description: LogDescription) -> Table:
    """Open one episode.

    Raises:
        RecordingError: If the folder is not such a dataset, an episode must be chosen, or frames are missing.
    """
    info, place = read_info(path), one_line(path)
    episode, frames = _episode(path, info, dict(description.only).get(EPISODE))

    def load(names: Sequence[str], _: Set[str]) -> Columns:
        stored = {name: info.columns[name] for name in names}
        files = [file for file in _parquets(path, "data") if _may_hold(file, episode)]
        if not files:
            raise RecordingError(f"{place}: no file of data/ contains episode {episode}; copy the dataset again")
        whole = _together(files, list(dict.fromkeys((EPISODE, FRAME, *stored.values()))))
        table = {name: values[whole[EPISODE] == episode] for name, values in whole.items()}
        frame = table[FRAME]
        if len(frame) != frames:
            raise RecordingError(
                f"{place}: episode {episode} has {len(frame)} of its {frames} frames; a file of data/ is missing"
            )
        wrong = np.flatnonzero(frame != np.arange(frames))
        if len(wrong):
            raise RecordingError(
                f"{place}: frame_index of episode {episode} is {frame[wrong[0]]:g} at its row {wrong[0] + 1}, expected "
                f"{wrong[0]}; frames are lost or out of order"
            )
        if TIME in table:
            table[TIME] = _time(place, info, table[TIME], frame)
        return {name: table[column] for name, column in stored.items()}

    return Table(list(info.columns), load)


def _episode(path: Path, info: DatasetInfo, wanted: float | None) -> tuple[int, int]:
    """Return the number of the episode to read, and its number of frames."""
    place, listed = one_line(path), _together(_parquets(path, "meta/episodes"), (EPISODE, LENGTH))
    if not all(np.isfinite(values).all() for values in listed.values()):
        raise RecordingError(f"{place}: meta/episodes lacks a number or length; copy the dataset again")
    lengths = dict(zip(listed[EPISODE].tolist(), listed[LENGTH].tolist(), strict=True))
    if len(lengths) != info.episodes:
        raise RecordingError(
            f"{place}: {INFO} says {info.episodes} episodes, meta/episodes lists {len(lengths)}; copy the dataset again"
        )
    there = f"{len(lengths)} episode{'s'[: len(lengths) > 1]}, {min(lengths):g} to {max(lengths):g}"
    if wanted is None and len(lengths) > 1:
        raise RecordingError(
            f"{place}: {there}; choose one (--episode, or only = {{ episode_index = .. }} of a description)"
        )
    number = min(lengths) if wanted is None else wanted
    if number not in lengths:
        raise RecordingError(f"{place}: no episode {number:g}; there are {there}")
    return int(number), int(lengths[number])


def _parquets(path: Path, folder: str) -> list[Path]:
    """Return Parquet files of a folder of the dataset, in the order of their rows."""
    found = sorted((path / folder).glob("*/*.parquet"))
    if not found:
        raise RecordingError(f"{one_line(path)}: {folder} has no Parquet file; copy the dataset again")
    return found


def _may_hold(file: Path, episode: int) -> bool:
    """Return whether a file may have rows of an episode, from the statistics of its row groups."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        footer = pq.read_metadata(file)
    except (OSError, pa.ArrowException):
        return True  # reading it reports the error
    places = [k for k in range(footer.num_columns) if footer.schema.column(k).path == EPISODE]
    ranges = [footer.row_group(k).column(places[0]).statistics for k in range(footer.num_row_groups) if places]
    return not places or any(each is None or not each.has_min_max or each.min <= episode <= each.max for each in ranges)


def _together(files: Sequence[Path], columns: Sequence[str]) -> dict[str, Array]:
    """Return the concatenated columns of Parquet files; one of one-element arrays has the name of its only entry."""
    parts: list[list[Array]] = []
    for file in files:
        table = open_parquet(file)
        found = [next((n for n in (column, f"{column}[0]") if n in table.names), "") for column in columns]
        if "" in found:
            lacking = columns[found.index("")]
            raise RecordingError(
                f"{one_line(file)}: no column {shown(lacking)}, which LeRobot datasets of this kind have"
            )
        loaded = table.load(found, frozenset())
        parts.append([loaded[name] for name in found])
    return {column: np.concatenate(each) for column, each in zip(columns, zip(*parts, strict=True), strict=True)}


def _time(place: str, info: DatasetInfo, t: Array, frame: Array) -> Array:
    """Return times of frames [s]; stamps of LeRobot, `frame_index / fps`, without rounding to float32."""
    made = frame / info.fps
    single = any(feature.name == TIME and feature.kind == "float32" for feature in info.features)
    if single and np.array_equal(made.astype(np.float32), t):
        return made
    if len(t) > 1 and np.isfinite(t).all():
        period = float(t[-1] - t[0]) / (len(t) - 1)
        if not abs(period * info.fps - 1.0) <= FPS_TOL:
            raise RecordingError(
                f"{place}: timestamps advance by {period:.4g} s a frame, but fps = {info.fps:g} of {INFO} says "
                f"{1.0 / info.fps:.4g} s; correct the one that is wrong"
            )
    return t


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
    import pyarrow as pa
    import pyarrow.parquet as pq

    folder, names, fps = Path(folder), _names(recordings, joints), _fps(recordings)
    others = [p for kind in ("data", "meta/episodes") for p in sorted((folder / kind).glob("*/*.parquet"))]
    foreign = [path for path in others if path not in (folder / DATA, folder / EPISODES)]
    if foreign:
        raise RecordingError(
            f"{one_line(folder)}: contains another dataset, {one_line(foreign[0])}; give another folder"
        )
    for name in FILES:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
    lengths = [len(each.t) for each in recordings]
    ends, count, total = np.cumsum(lengths).tolist(), len(lengths), sum(lengths)
    columns = {
        STATE: np.concatenate([np.column_stack((each.q, each.v)) for each in recordings]),
        TIME: np.concatenate([each.t for each in recordings]),
        FRAME: np.concatenate([np.arange(length) for length in lengths]),
        EPISODE: np.repeat(np.arange(count), lengths),
        "index": np.arange(total),
        "task_index": np.zeros(total, dtype=np.int64),
    }
    unit = MEANINGS[signal].unit if signal else ""
    ending = "torque" if unit == "N m" else "current"
    state = {
        "dtype": "float64",
        "shape": [2 * len(names)],
        "names": [f"{name}.{kind}" for kind in ("pos", ending) for name in names],
        "units": ["rad"] * len(names) + [unit] * len(names),
    } | ({"signal": signal} if signal else {})
    plain = {name: {"dtype": str(x.dtype), "shape": [1], "names": None} for name, x in columns.items() if x.ndim == 1}
    info = {
        "codebase_version": "v3.0",
        "robot_type": None,
        "total_episodes": count,
        "total_frames": total,
        "total_tasks": 1,
        "chunks_size": 1000,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": fps,
        "splits": {"train": f"0:{count}"},
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "video_path": None,
        "features": {STATE: state} | plain,
    }
    data = pa.table({name: arrow_array(x.reshape(-1)) for name, x in columns.items() if name != STATE})
    rows = pa.FixedSizeListArray.from_arrays(arrow_array(columns[STATE].reshape(-1)), 2 * len(names))
    data = data.add_column(0, STATE, rows)
    with pq.ParquetWriter(folder / DATA, data.schema) as writer:  # one row group per episode, as in LeRobot
        for end, length in zip(ends, lengths, strict=True):
            writer.write_table(data.slice(end - length, length))
    task = "motion for the identification of drive gains"
    chunks = ("data/chunk_index", "data/file_index", "meta/episodes/chunk_index", "meta/episodes/file_index")
    episodes = {
        EPISODE: list(range(count)),
        "tasks": [[task]] * count,
        LENGTH: lengths,
        "dataset_from_index": [end - length for end, length in zip(ends, lengths, strict=True)],
        "dataset_to_index": ends,
        **{name: [0] * count for name in chunks},
    }
    pq.write_table(pa.table(episodes), folder / EPISODES)
    tasks = pa.table({"task_index": [0], "task": [task]}, metadata={"pandas": json.dumps(PANDAS)})
    pq.write_table(tasks, folder / TASKS)
    wide = {name: x.reshape(total, -1).astype(np.float64) for name, x in columns.items()}
    stats = {
        name: {kind: getattr(x, kind)(axis=0).tolist() for kind in ("min", "max", "mean", "std")} | {"count": [total]}
        for name, x in wide.items()
    }
    for name, content in ((INFO, info), (STATS, stats)):
        (folder / name).write_text(json.dumps(content, indent=4) + "\n", encoding="utf-8")


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
            f"recordings of {min(rates):.4g} to {max(rates):.4g} Hz; a dataset has one rate, so write a dataset for "
            "each rate"
        )
    mean = float(np.mean(rates))
    return round(mean) if abs(round(mean) / mean - 1.0) <= JITTER_TOL else mean


LEROBOT = LogFormat((ENDING,), open_lerobot, INFO)
