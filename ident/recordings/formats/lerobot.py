"""Logs in datasets of LeRobot, version 3: one episode of the folder with `meta/info.json`.

Columns have the names of its Parquet files, `observation.state[0]`, .., and also those of the entries,
`observation.state.shoulder_pan.pos`. Videos are ignored.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ident.recordings.formats.columns import Chosen, Columns, LogFormat, Request
from ident.recordings.formats.lerobot_info import INFO, DatasetInfo, read_info
from ident.recordings.formats.parquet import read_parquet
from ident.support.arrays import Array
from ident.support.errors import RecordingError
from ident.support.naming import one_line, shown

ENDING = ".lerobot"
"""Ending of names of written datasets; a folder of any name is read."""
FPS_TOL = 0.01
"""Largest relative difference between the stamps' rate and `fps`: a larger one indicates another unit or rate.

Velocities have this relative error, inertial torques twice of it.
"""
EPISODE, FRAME, TIME, LENGTH = "episode_index", "frame_index", "timestamp", "length"


def read_lerobot(path: Path, request: Request) -> Columns:
    """Read the columns of one episode.

    Raises:
        RecordingError: If the folder is not such a dataset, an episode must be chosen, or frames are missing.
    """
    info = read_info(path)
    episode, frames = _episode(path, info, request.episode)
    chosen = request.chosen(path, list(info.columns))
    stored = {name: info.columns[name] for name in chosen.names}
    table = _rows(path, episode, dict.fromkeys((EPISODE, FRAME, *stored.values())))
    frame = table[FRAME]
    if len(frame) != frames:
        raise RecordingError(
            f"{one_line(path)}: episode {episode} has {len(frame)} of its {frames} frames; a file of data/ is missing"
        )
    wrong = np.flatnonzero(frame != np.arange(frames))
    if len(wrong):
        raise RecordingError(
            f"{one_line(path)}: frame_index of episode {episode} is {frame[wrong[0]]:g} at its row {wrong[0] + 1}, "
            f"expected {wrong[0]}; frames are lost or out of order"
        )
    if TIME in table:
        table[TIME] = _time(path, info, table[TIME], frame)
    return {name: table[column] for name, column in stored.items()}


def _episode(path: Path, info: DatasetInfo, wanted: float | None) -> tuple[int, int]:
    """Return the number of the episode to read, and its number of frames."""
    listed = _together(_parquets(path, "meta/episodes"), (EPISODE, LENGTH))
    if not all(np.isfinite(values).all() for values in listed.values()):
        raise RecordingError(f"{one_line(path)}: meta/episodes lacks a number or length; copy the dataset again")
    lengths = dict(zip(listed[EPISODE].tolist(), listed[LENGTH].tolist(), strict=True))
    if len(lengths) != info.episodes:
        raise RecordingError(
            f"{one_line(path)}: {INFO} says {info.episodes} episodes, meta/episodes lists {len(lengths)}; "
            "copy the dataset again"
        )
    there = f"{len(lengths)} episode{'s'[: len(lengths) > 1]}, {min(lengths):g} to {max(lengths):g}"
    if wanted is None and len(lengths) > 1:
        raise RecordingError(
            f"{one_line(path)}: {there}; choose one (--episode, or only = {{ episode_index = .. }} of a description)"
        )
    number = min(lengths) if wanted is None else wanted
    if number not in lengths:
        raise RecordingError(f"{one_line(path)}: no episode {number:g}; there are {there}")
    return int(number), int(lengths[number])


def _rows(path: Path, episode: int, columns: Mapping[str, None]) -> dict[str, Array]:
    """Return the columns of an episode from all files with its rows."""
    files = [file for file in _parquets(path, "data") if _may_hold(file, episode)]
    if not files:
        raise RecordingError(f"{one_line(path)}: no file of data/ contains episode {episode}; copy the dataset again")
    table = _together(files, tuple(columns))
    kept = table[EPISODE] == episode
    return {name: values[kept] for name, values in table.items()}


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
        with pq.ParquetFile(file) as opened:
            footer = opened.metadata
            places = [k for k in range(footer.num_columns) if footer.schema.column(k).path == EPISODE]
            if not places:
                return True
            ranges = [footer.row_group(k).column(places[0]).statistics for k in range(footer.num_row_groups)]
    except (OSError, pa.ArrowException):
        return True  # reading it reports the error
    return any(each is None or not each.has_min_max or each.min <= episode <= each.max for each in ranges)


def _together(files: Sequence[Path], columns: Sequence[str]) -> dict[str, Array]:
    """Return the concatenated columns of some Parquet files."""
    parts = [read_parquet(file, _request(columns)) for file in files]
    return {
        column: np.concatenate([list(part.values())[number] for part in parts]) for number, column in enumerate(columns)
    }


def _request(columns: Sequence[str]) -> Request:
    """Return the request for a Parquet file; a column of one-element arrays has the name of its only entry."""

    def chosen(path: Path, names: Sequence[str]) -> Chosen:
        there = set(names)
        found = [next((name for name in (column, f"{column}[0]") if name in there), "") for column in columns]
        if "" in found:
            lacking = columns[found.index("")]
            raise RecordingError(
                f"{one_line(path)}: no column {shown(lacking)}, which LeRobot datasets of this kind have"
            )
        return Chosen(tuple(found))

    return Request(chosen=chosen, known=len)


def _time(path: Path, info: DatasetInfo, t: Array, frame: Array) -> Array:
    """Return times of frames [s]; stamps of LeRobot, `frame_index / fps`, without rounding to float32."""
    made = frame / info.fps
    single = any(feature.name == TIME and feature.kind == "float32" for feature in info.features)
    if single and np.array_equal(made.astype(np.float32), t):
        return made
    if len(t) > 1 and np.isfinite(t).all():
        period = float(t[-1] - t[0]) / (len(t) - 1)
        if not abs(period * info.fps - 1.0) <= FPS_TOL:
            raise RecordingError(
                f"{one_line(path)}: timestamps advance by {period:.4g} s a frame, but fps = {info.fps:g} of {INFO} "
                f"says {1.0 / info.fps:.4g} s; correct the one that is wrong"
            )
    return t


LEROBOT = LogFormat((ENDING,), read_lerobot, INFO)
