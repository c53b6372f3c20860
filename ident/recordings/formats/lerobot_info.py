"""Content of `meta/info.json` of a LeRobot v3 dataset: rate, episodes, and features with joint names.

A feature is a column of numbers, or of rows of numbers with a name each: `shoulder_pan.pos` of `observation.state`. A
position is an entry of `observation.state` that ends in `.pos` or has no ending; a current is one that ends in
`.current`, `.torque`, `.effort` or `.eff`, or an entry of a feature `observation.current`, `.torque` or `.effort`.
"""

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias, cast

from ident.recordings.formats.columns import MOST_COLUMNS, entry
from ident.support.errors import RecordingError
from ident.support.file_access import read_bytes
from ident.support.naming import one_line, shown

INFO, STATS, TASKS = "meta/info.json", "meta/stats.json", "meta/tasks.parquet"
DATA, EPISODES = "data/chunk-000/file-000.parquet", "meta/episodes/chunk-000/file-000.parquet"
FILES = (INFO, STATS, TASKS, EPISODES, DATA)
"""Files of a written dataset; others may have more files of data and of episodes."""
LARGEST = 10_000_000
"""Largest size of `meta/info.json` [bytes]."""
VERSION = "v3."
CONVERTED = "v2.1"
"""The only older version that LeRobot converts."""
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
    """A feature of numbers.

    Attributes:
        name: Its name.
        kind: Type of its numbers.
        width: Length of a row, 1 for a plain column.
        names: Names of the entries of a row, empty without names.
        units: Units of the entries, if stated by `write_dataset`.
        signal: Quantity of its currents, if stated by `write_dataset`.
    """

    name: str
    kind: str
    width: int
    names: tuple[str, ...]
    units: tuple[str, ...]
    signal: str | None

    @property
    def stored(self) -> tuple[str, ...]:
        """Its columns with their names in the Parquet files."""
        return (self.name,) if self.width == 1 else tuple(entry(self.name, k) for k in range(self.width))

    @property
    def named(self) -> tuple[str, ...]:
        """Its columns by the names of the entries, empty without names."""
        return tuple(f"{self.name}.{name}" for name in self.names)


@dataclass(frozen=True, slots=True)
class DatasetInfo:
    """Metadata of a dataset.

    Attributes:
        robot: Type of the robot, empty if not stated.
        fps: Frames per second [1/s].
        episodes: Number of episodes.
        features: Numeric features.
        others: Names of the other features: videos, images, texts.
    """

    robot: str
    fps: float
    episodes: int
    features: tuple[Feature, ...]
    others: tuple[str, ...]

    @property
    def columns(self) -> dict[str, str]:
        """Stored columns by all their names."""
        stored = {name: name for feature in self.features for name in feature.stored}
        named = {n: s for each in self.features for n, s in zip(each.named, each.stored, strict=bool(each.names))}
        return named | stored

    @property
    def signal(self) -> str | None:
        """Quantity of the currents, if stated."""
        return next((feature.signal for feature in self.features if feature.signal), None)

    def positions(self) -> Entries:
        """Positions by joint, in the order of the dataset."""
        return {
            joint: (column, unit)
            for pattern, joints in self._entries().items()
            if pattern.startswith(STATE) and not is_current(pattern)
            for joint, (column, unit) in joints.items()
        }

    def currents(self) -> dict[str, Entries]:
        """Currents by joint, for each pattern of columns that exists."""
        return {pattern: joints for pattern, joints in self._entries().items() if is_current(pattern)}

    def _entries(self) -> dict[str, dict[str, tuple[str, str]]]:
        """Return columns and units of joints by pattern; `{joint}` is replaced by the joint's name."""
        found: dict[str, dict[str, tuple[str, str]]] = {}
        for feature in self.features:
            if feature.name not in (STATE, *CURRENT_COLUMNS):
                continue
            for number, (name, column) in enumerate(zip(feature.names, feature.named, strict=True)):
                stem, _, ending = name.rpartition(".")
                known = bool(stem) and ending in (*POSITIONS, *CURRENTS)
                if feature.name == STATE and "." in name and not known:
                    continue  # a velocity, a temperature, ..
                joint, pattern = (
                    (stem, f"{feature.name}.{{joint}}.{ending}") if known else (name, f"{feature.name}.{{joint}}")
                )
                unit = feature.units[number] if feature.units else self._unit(pattern)
                found.setdefault(pattern, {})[joint] = (column, unit)
        return found

    def _unit(self, pattern: str) -> str:
        if self.robot not in DEGREES:
            return ""
        if is_current(pattern):
            return "N m" if pattern.endswith(".torque") else ""
        return "deg"


def is_current(column: str) -> bool:
    """Return whether a column of a dataset is a current or torque, by its name."""
    return column.startswith(CURRENT_COLUMNS) or column.rpartition(".")[2] in CURRENTS


def read_info(folder: Path) -> DatasetInfo:
    """Metadata of a dataset.

    Raises:
        RecordingError: If it is not a dataset of LeRobot, version 3.
    """
    path = folder / INFO
    if not path.is_file():
        raise RecordingError(f"{one_line(folder)}: expected the folder of a LeRobot dataset, with {INFO}")
    place = one_line(path)
    try:
        said = json.loads(read_bytes(path, most_bytes=LARGEST, error=RecordingError))
    except (ValueError, RecursionError) as error:
        if isinstance(error, RecordingError):
            raise
        raise RecordingError(f"{place}: not JSON ({one_line(error)[:120]}); copy the dataset again") from error
    if not isinstance(said, dict):
        raise RecordingError(f"{place}: {shown(said)}; expected an object as LeRobot writes it")
    table = cast("dict[str, object]", said)
    _check_version(place, table.get("codebase_version"))
    fps, episodes, features = table.get("fps"), table.get("total_episodes"), table.get("features")
    if isinstance(fps, bool) or not isinstance(fps, int | float) or not 0.0 < fps < math.inf:
        raise RecordingError(f"{place}: fps = {shown(fps)}; expected the frames per second, a number above 0")
    if isinstance(episodes, bool) or not isinstance(episodes, int) or episodes < 1:
        raise RecordingError(f"{place}: total_episodes = {shown(episodes)}; expected a number of at least 1")
    if not isinstance(features, dict):
        raise RecordingError(f"{place}: features = {shown(features)}; expected an object with one entry per feature")
    every = cast("dict[str, object]", features)
    read = {name: _feature(name, feature) for name, feature in every.items()}
    robot = table.get("robot_type")
    return DatasetInfo(
        robot if isinstance(robot, str) else "",
        float(fps),
        episodes,
        tuple(feature for feature in read.values() if feature is not None),
        tuple(name for name, feature in read.items() if feature is None),
    )


def _check_version(place: str, version: object) -> None:
    if isinstance(version, str) and version.startswith(VERSION):
        return
    if version == CONVERTED:
        raise RecordingError(
            f"{place}: a LeRobot dataset of version {CONVERTED}; convert it to v3.0 with LeRobot: python -m "
            "lerobot.scripts.convert_dataset_v21_to_v30 --repo-id=USER/NAME"
        )
    raise RecordingError(f"{place}: codebase_version = {shown(version)}; LeRobot datasets of version v3.0 are read")


def _feature(name: str, said: object) -> Feature | None:
    """Return a feature of numbers or rows of numbers, None for any other."""
    if not isinstance(said, dict):
        return None
    table = cast("dict[str, object]", said)
    kind, shape = table.get("dtype"), table.get("shape")
    if not isinstance(kind, str) or not kind.startswith(("float", "int", "uint")):
        return None
    if not isinstance(shape, list) or len(cast("list[object]", shape)) != 1:
        return None
    (width,) = cast("list[object]", shape)
    if isinstance(width, bool) or not isinstance(width, int) or not 1 <= width <= MOST_COLUMNS:
        return None
    names, units, signal = _texts(table.get("names")), _texts(table.get("units")), table.get("signal")
    return Feature(
        name=name,
        kind=kind,
        width=width,
        names=names if len(names) == width else (),
        units=units if len(units) == width else (),
        signal=signal if isinstance(signal, str) else None,
    )


def _texts(said: object) -> tuple[str, ...]:
    """Return names of entries: a list, or a single list within a list or an object; otherwise empty."""
    inner: Sequence[object] = ()
    if isinstance(said, dict):
        inner = list(cast("dict[str, object]", said).values())
    elif isinstance(said, list):
        inner = cast("list[object]", said)
    if len(inner) == 1 and isinstance(inner[0], list):
        inner = cast("list[object]", inner[0])
    elif isinstance(said, dict):
        return ()
    texts = [each for each in inner if isinstance(each, str)]
    return tuple(texts) if len(texts) == len(inner) else ()
