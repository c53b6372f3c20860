"""Logs in datasets of LeRobot, version 2 or 3: one episode of the folder with `meta/info.json`.

A feature of `info.json` is a column of numbers, or of rows of numbers with a name each: `shoulder_pan.pos` of
`observation.state`. A position is an entry of `observation.state` that ends in `.pos` or has no ending; a current is
one that ends in `.current`, `.torque`, `.effort` or `.eff`, or an entry of a feature `observation.current`, `.torque`
or `.effort`. Columns have the names of the Parquet files, `observation.state[0]`, .., and also those of the entries,
`observation.state.shoulder_pan.pos`. Videos are ignored.
"""

import json
from collections.abc import Sequence, Set
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ident.recordings.description import EPISODE, LogDescription
from ident.recordings.description import LEROBOT as LAYOUT
from ident.recordings.formats import Columns, LogFormat, Table, check_size, readable
from ident.recordings.formats.arrays import LARGEST as LARGEST_DATA
from ident.recordings.formats.arrays import arrow_table
from ident.support.arrays import Array
from ident.support.errors import RecordingError, placed
from ident.support.files import check_file, read_bytes
from ident.support.options import Key, is_number, is_table, strict_table

if TYPE_CHECKING:
    import pyarrow as pa

INFO, LIST = "meta/info.json", "meta/episodes.jsonl"
LARGEST = 10_000_000
"""Largest size of these files [bytes]."""
FPS_TOL = 0.01
"""Largest relative difference between the stamps' rate and `fps`: a larger one indicates another unit or rate.

Velocities have this relative error, inertial torques twice of it.
"""
FRAME, TIME, LENGTH = "frame_index", "timestamp", "length"
STATE = "observation.state"
POSITIONS = ("pos", "position")
CURRENTS = ("current", "torque", "effort", "eff")
CURRENT_FEATURES = ("observation.current", "observation.torque", "observation.effort")
"""Features with only currents."""
DEGREES = ("openarm_follower", "bi_openarm_follower")
"""Types of robots that LeRobot always logs in degrees and newton metres (its `DamiaoMotorsBus`)."""


KEYS = {
    "codebase_version": Key("v2.0 to v3.0", lambda value: isinstance(value, str) and value.startswith(("v2.", "v3."))),
    "fps": Key("the frames per second, a number above 0", lambda value: is_number(value) and value > 0.0),
    "features": Key("an object with one entry per feature", is_table),
}
"""Needed keys of `meta/info.json`."""


def open_lerobot(path: Path, description: LogDescription) -> Table:
    """Open one episode; raises if the folder is no dataset or one must be chosen; `load`, if frames are lost."""
    info = _info(path)
    frames_of = _lengths(path, info["codebase_version"])
    there = f"{len(frames_of)} episode{'s'[: len(frames_of) > 1]}, {min(frames_of):g} to {max(frames_of):g}"
    episode = dict(description.only).get(EPISODE, min(frames_of) if len(frames_of) == 1 else None)
    if episode is None or episode not in frames_of:
        what = there if episode is None else f"no episode {episode:g}; there are {there}"
        raise RecordingError(f"{what}; choose one (--episode, or only = {{ episode_index = .. }} of a description)")
    data, frames, stored = _parquet(path, "data", int(episode)), frames_of[episode], dict[str, str]()
    positions, currents = dict[str, tuple[str, str]](), dict[str, dict[str, tuple[str, str]]]()
    for feature, stated in info["features"].items():
        names, own = _names(stated), [each for each in data.names if each.partition("[")[0] == feature]
        if len(names) != len(own):
            continue
        stored |= {f"{feature}.{name}": each for name, each in zip(names, own, strict=True)}
        for name in names if feature in (STATE, *CURRENT_FEATURES) else ():
            joint, _, ending = name.rpartition(".")
            if not joint or ending not in (*POSITIONS, *CURRENTS):
                joint, ending = name, ""
            if feature != STATE or ending in CURRENTS:
                unit = "N m" if ending == "torque" else ""
                of = currents.setdefault(f"{feature}.{{joint}}{ending and '.'}{ending}", {})
            elif ending or "." not in name:  # not a velocity, a temperature, ..
                unit, of = "deg", positions
            else:
                continue
            of[joint] = f"{feature}.{name}", unit if info.get("robot_type") in DEGREES else ""

    def load(names: Sequence[str], _: Set[str]) -> Columns:
        found = dict(data.load([FRAME, *(stored.get(name, name) for name in names)], frozenset()))
        frame = found[FRAME]
        if len(frame) != frames:
            raise RecordingError(
                f"episode {episode:g} has {len(frame)} of its {frames:g} frames; a file of data/ is missing"
            )
        wrong = np.flatnonzero(frame != np.arange(frames))
        if len(wrong):
            raise RecordingError(
                f"frame_index of episode {episode:g} is {frame[wrong[0]]:g} at its row {wrong[0] + 1}, "
                f"expected {wrong[0]}; frames are lost or out of order"
            )
        if TIME in found:
            found[TIME] = _time(info["fps"], found[TIME], frame)
        return {name: found[stored.get(name, name)] for name in names}

    return replace(
        data, names=[*stored, *data.names], load=load, layout=LAYOUT, time=TIME, positions=positions, currents=currents,
        joints=tuple(positions),
    )  # fmt: skip


def _info(path: Path) -> dict[str, Any]:
    """Return the metadata of a dataset; raises `RecordingError` if it is not one of LeRobot that is read."""
    if not (path / INFO).is_file():
        raise RecordingError(f"expected the folder of a LeRobot dataset, with {INFO}")
    content = read_bytes(path / INFO, most_bytes=LARGEST, error=RecordingError)
    with placed(INFO), readable("JSON as LeRobot writes it; copy the dataset again", RecursionError):
        info = json.loads(content)
        return info | strict_table({key: info.get(key) for key in KEYS}, KEYS, RecordingError)


def _lengths(path: Path, version: str) -> dict[float, float]:
    """Return the number of frames of each episode; datasets of version 2 have a list of episodes."""
    if not version.startswith("v2."):
        meta = _parquet(path, "meta/episodes").load((EPISODE, LENGTH), frozenset())
        return dict(zip(meta[EPISODE].tolist(), meta[LENGTH].tolist(), strict=True))
    if not (path / LIST).is_file():
        raise RecordingError(f"{LIST} is missing; copy the dataset again")
    content = read_bytes(path / LIST, most_bytes=LARGEST, error=RecordingError)
    with placed(LIST), readable("JSON lines as LeRobot writes them; copy the dataset again", RecursionError):
        rows = [json.loads(line) for line in content.splitlines() if line.strip()]
        return {float(row[EPISODE]): float(row[LENGTH]) for row in rows}


def _names(stated: object) -> list[str]:
    """Return the names of a feature's entries: a list, or a single list within a list or an object; empty if none."""
    names = stated.get("names") if isinstance(stated, dict) else None
    names = list(names.values()) if isinstance(names, dict) else names
    names = names[0] if isinstance(names, list) and len(names) == 1 and isinstance(names[0], list) else names
    return names if isinstance(names, list) and all(isinstance(each, str) for each in names) else []


def _parquet(path: Path, folder: str, episode: int | None = None) -> Table:
    """Open the Parquet files of a folder of the dataset, an episode or all rows."""
    from pyarrow import dataset

    files = sorted((path / folder).glob("*/*.parquet"))
    if not files:
        raise RecordingError(f"{folder} has no Parquet file; copy the dataset again")
    for file in files:
        check_file(file, most_bytes=LARGEST_DATA, error=RecordingError)
    wanted = None if episode is None else dataset.field(EPISODE) == episode
    with placed(folder), readable("readable"):
        data = dataset.dataset([str(file) for file in files], format="parquet")
        first = data.head(1)

    def read(names: Sequence[str]) -> "pa.Table":
        with placed(folder), readable("readable"):
            check_size(data.count_rows(filter=wanted) * len(names))
            return data.to_table(columns=list(names), filter=wanted)

    return arrow_table(data.schema, lambda name: len(first[name][0].as_py() or ()) if len(first) else 0, read)


def _time(fps: float, t: Array, frame: Array) -> Array:
    """Return times of frames [s]; stamps of LeRobot, `frame_index / fps`, without rounding to float32."""
    made = frame / fps
    if np.array_equal(made.astype(np.float32), t):
        return made
    if len(t) > 1 and np.isfinite(t).all():
        period = float(t[-1] - t[0]) / (len(t) - 1)
        if not abs(period * fps - 1.0) <= FPS_TOL:
            raise RecordingError(
                f"timestamps advance by {period:.4g} s a frame, but fps = {fps:g} of {INFO} says "
                f"{1.0 / fps:.4g} s; correct the one that is wrong"
            )
    return t


LEROBOT = LogFormat((".lerobot",), open_lerobot, INFO)
