"""Logs in datasets of LeRobot, version 3: one episode of the folder with `meta/info.json`.

A feature of `info.json` is a column of numbers, or of rows of numbers with a name each: `shoulder_pan.pos` of
`observation.state`. A position is an entry of `observation.state` that ends in `.pos` or has no ending; a current is
one that ends in `.current`, `.torque`, `.effort` or `.eff`, or an entry of a feature `observation.current`, `.torque`
or `.effort`. Columns have the names of the Parquet files, `observation.state[0]`, .., and also those of the entries,
`observation.state.shoulder_pan.pos`. Videos are ignored.
"""

import json
import math
import re
from collections.abc import Collection, Mapping, Sequence, Set
from pathlib import Path
from typing import NamedTuple, TypeAlias, cast

import numpy as np

from ident.recordings.description import EPISODE, Channels, LogDescription
from ident.recordings.formats import (
    MOST_COLUMNS,
    MOST_VALUES,
    Columns,
    LogFormat,
    Table,
    check_joint,
    entry,
    listed,
)
from ident.recordings.formats.arrays import arrow_numbers
from ident.support.arrays import Array
from ident.support.errors import RecordingError
from ident.support.files import check_file, read_bytes
from ident.support.naming import one_line, shown

INFO = "meta/info.json"
LARGEST, LARGEST_DATA = 10_000_000, 4_000_000_000
"""Largest sizes of `meta/info.json` and of a Parquet file [bytes]."""
FPS_TOL = 0.01
"""Largest relative difference between the stamps' rate and `fps`: a larger one indicates another unit or rate.

Velocities have this relative error, inertial torques twice of it.
"""
FRAME, TIME, LENGTH = "frame_index", "timestamp", "length"
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


class Feature(NamedTuple):
    """A feature of numbers; `names` of the entries of a row are empty if not stated."""

    kind: str
    width: int
    names: tuple[str, ...]


class DatasetInfo(NamedTuple):
    """Metadata of a dataset.

    Attributes:
        robot: Type of the robot, None if not stated.
        fps: Frames per second [1/s].
        episodes: Number of episodes.
        features: Features by name; None for videos, images and texts.
    """

    robot: object
    fps: float
    episodes: int
    features: Mapping[str, Feature | None]

    @property
    def columns(self) -> dict[str, tuple[str, int]]:
        """Feature and number of the entry of each column, by all its names."""
        stored, named = dict[str, tuple[str, int]](), dict[str, tuple[str, int]]()
        for name, feature in self.features.items():
            for k in range(feature.width if feature else 0):
                stored[name if feature and feature.width == 1 else entry(name, k)] = name, k
            named |= {f"{name}.{each}": (name, k) for k, each in enumerate(feature.names if feature else ())}
        return named | stored

    def entries(self, *, currents: bool) -> Mapping[str, Entries]:
        """Return columns and units of the joints' currents, or positions, by pattern: `{joint}` stands for a name."""
        found: dict[str, dict[str, tuple[str, str]]] = {}
        for feature in (STATE, *CURRENT_COLUMNS):
            stated = self.features.get(feature)
            for name in stated.names if stated else ():
                stem, _, ending = name.rpartition(".")
                known = bool(stem) and ending in (*POSITIONS, *CURRENTS)
                if feature == STATE and "." in name and not known:
                    continue  # a velocity, a temperature, ..
                current = feature != STATE or (known and ending in CURRENTS)
                if current != currents:
                    continue
                of_degrees = "deg" if not current else "N m" if known and ending == "torque" else ""
                unit = of_degrees if self.robot in DEGREES else ""
                pattern = f"{feature}.{{joint}}" + (f".{ending}" if known else "")
                found.setdefault(pattern, {})[stem if known else name] = f"{feature}.{name}", unit
        return found


def read_info(folder: Path) -> DatasetInfo:
    """Return the metadata of a dataset; raises `RecordingError` if it is not one of LeRobot, version 3."""
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
    read = {name: _feature(each) for name, each in cast("dict[str, object]", features).items()}
    return DatasetInfo(table.get("robot_type"), float(fps), episodes, read)


def _feature(stated: object) -> Feature | None:
    """Return a feature of numbers or rows of numbers, None for any other."""
    table = cast("dict[str, object]", stated if isinstance(stated, dict) else {})
    kind, shape = table.get("dtype"), table.get("shape")
    if not isinstance(kind, str) or not kind.startswith(("float", "int", "uint")):
        return None
    (width,) = cast("list[object]", shape) if isinstance(shape, list) and len(shape) == 1 else (None,)
    if isinstance(width, bool) or not isinstance(width, int) or not 1 <= width <= MOST_COLUMNS:
        return None
    stated = table.get("names")  # of entries: a list, or a single list within a list or an object
    inner = list(cast("dict[str, object]", stated).values()) if isinstance(stated, dict) else stated
    if isinstance(inner, list) and len(inner) == 1 and isinstance(inner[0], list):
        inner = cast("list[object]", inner[0])
    elif isinstance(stated, dict):
        inner = None
    names = [each for each in cast("list[object]", inner) if isinstance(each, str)] if isinstance(inner, list) else []
    return Feature(kind, width, tuple(names) if len(names) == width else ())


def dataset_layout(path: Path, description: LogDescription) -> LogDescription:
    """Return the columns of joints that a description does not declare, from the names of features.

    Raises:
        RecordingError: If joints have no names, there are no currents or several kinds of them, or a joint lacks one.
    """
    info, place = read_info(path), one_line(path)
    features = [f"{name} ({listed(each.names, 3)})" if each and each.names else name
                for name, each in sorted(info.features.items(), key=lambda each: each[1] is None)]  # fmt: skip
    there = f"its features are {listed(features, 12)}"
    positions = {joint: each for found in info.entries(currents=False).values() for joint, each in found.items()}
    kinds = info.entries(currents=True)
    q, v = not description.q.columns, not description.v.columns  # which of them are undeclared
    if q and not positions:
        raise RecordingError(
            f"{place}: entries of {STATE} have no names of joints; declare which of them are positions and currents: "
            f"--columns 'q=NAME[{{0..5}}][unit]' 'v=..'; {there}"
        )
    if v and not kinds:
        raise RecordingError(
            f"{place}: the dataset has no currents, which identification needs: no name ends in .current, .torque or "
            f".effort; {there}"
        )
    if v and len(kinds) > 1:
        raise RecordingError(
            f"{place}: several kinds of current: {listed(list(kinds))}; choose one, --columns 'v={next(iter(kinds))}', "
            "and name the joints (--joints, or --model)"
        )
    joints, currents = description.joints or tuple(positions), next(iter(kinds.values()), {})
    for joint in joints:
        if q:
            check_joint(place, joint, list(positions))
        if v and joint not in currents:
            raise RecordingError(
                f"{place}: joint {shown(joint)} has no current; those that have one are {listed(list(currents))}; name "
                "the others (--joints)"
            )

    def channels(entries: Sequence[tuple[str, str]]) -> Channels:
        units = tuple(unit for _, unit in entries)
        return Channels(columns=tuple(column for column, _ in entries), unit=units if all(units) else ())

    return LogDescription(
        joints=joints,
        t=Channels(columns=(TIME,), unit=("s",)),
        q=channels([positions[joint] for joint in joints if q]),
        v=channels([currents[joint] for joint in joints if v]),
    )


def open_lerobot(path: Path, description: LogDescription) -> Table:
    """Open one episode.

    Raises:
        RecordingError: If the folder is no dataset, or an episode must be chosen; `load`, if frames are missing.
    """
    info, place = read_info(path), one_line(path)
    meta = _read(path, "meta/episodes", (EPISODE, LENGTH))
    if not all(np.isfinite(values).all() for values in meta.values()):
        raise RecordingError(f"{place}: meta/episodes lacks a number or length; copy the dataset again")
    lengths = dict(zip(meta[EPISODE].tolist(), meta[LENGTH].tolist(), strict=True))
    if len(lengths) != info.episodes:
        raise RecordingError(
            f"{place}: {INFO} says {info.episodes} episodes, meta/episodes lists {len(lengths)}; copy the dataset again"
        )
    there = f"{len(lengths)} episode{'s'[: len(lengths) > 1]}, {min(lengths):g} to {max(lengths):g}"
    chosen = dict(description.only).get(EPISODE)
    if chosen is None and len(lengths) > 1:
        raise RecordingError(
            f"{place}: {there}; choose one (--episode, or only = {{ episode_index = .. }} of a description)"
        )
    chosen = min(lengths) if chosen is None else chosen
    if chosen not in lengths:
        raise RecordingError(f"{place}: no episode {chosen:g}; there are {there}")
    episode, frames = int(chosen), int(lengths[chosen])

    def load(names: Sequence[str], _: Set[str]) -> Columns:
        places = {name: info.columns[name] for name in names}
        table = _read(
            path, "data", dict.fromkeys((EPISODE, FRAME, *(column for column, _ in places.values()))), episode
        )
        frame = table[FRAME].reshape(-1)
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
            table[TIME] = _time(place, info, table[TIME].reshape(-1), frame)
        found: dict[str, Array] = {}
        for name, (column, k) in places.items():
            values = table[column].reshape(frames, -1)
            if k >= values.shape[1]:
                raise _lacking(path, entry(column, k))
            found[name] = values[:, k]
        return found

    return Table(list(info.columns), load)


def _lacking(path: Path, column: str) -> RecordingError:
    return RecordingError(f"{one_line(path)}: no column {shown(column)}, which LeRobot datasets of this kind have")


def _read(path: Path, folder: str, names: Collection[str], episode: int | None = None) -> dict[str, Array]:
    """Return columns of the Parquet files of a folder of the dataset, those of an episode or all rows."""
    import pyarrow as pa
    from pyarrow import dataset as ds

    files = sorted((path / folder).glob("*/*.parquet"))
    if not files:
        raise RecordingError(f"{one_line(path)}: {folder} has no Parquet file; copy the dataset again")
    for file in files:
        check_file(file, most_bytes=LARGEST_DATA, error=RecordingError)
    try:
        data = ds.dataset([str(file) for file in files], format="parquet")
        lacking = [name for name in names if name not in data.schema.names]
        if lacking:
            raise _lacking(path / folder, lacking[0])
        wanted = None if episode is None else ds.field(EPISODE) == episode
        rows = data.count_rows(filter=wanted)
        if not rows:
            what = "a row" if episode is None else f"episode {episode}"
            raise RecordingError(f"{one_line(path)}: no file of {folder}/ contains {what}; copy the dataset again")
        if rows * len(names) > MOST_VALUES:
            raise RecordingError(f"{one_line(path)}: over {MOST_VALUES} numbers in {folder}/; take a part of it")
        table = data.to_table(columns=list(names), filter=wanted)
    except (OSError, pa.ArrowException) as error:
        raise RecordingError(f"{one_line(path / folder)}: not readable ({one_line(error)[:200]})") from error
    return {name: arrow_numbers(path / folder, name, table[name]) for name in names}


def _time(place: str, info: DatasetInfo, t: Array, frame: Array) -> Array:
    """Return times of frames [s]; stamps of LeRobot, `frame_index / fps`, without rounding to float32."""
    made, stated = frame / info.fps, info.features.get(TIME)
    if stated and stated.kind == "float32" and np.array_equal(made.astype(np.float32), t):
        return made
    if len(t) > 1 and np.isfinite(t).all():
        period = float(t[-1] - t[0]) / (len(t) - 1)
        if not abs(period * info.fps - 1.0) <= FPS_TOL:
            raise RecordingError(
                f"{place}: timestamps advance by {period:.4g} s a frame, but fps = {info.fps:g} of {INFO} says "
                f"{1.0 / info.fps:.4g} s; correct the one that is wrong"
            )
    return t


LEROBOT = LogFormat((".lerobot",), open_lerobot, INFO)
