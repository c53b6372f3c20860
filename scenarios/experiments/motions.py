"""Motion files: the Fourier coefficients of an exciting motion, with the command that found them."""

import hashlib
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from ident.support.arrays import Array
from ident.support.files import LARGEST, read_bytes, read_toml
from ident.support.naming import nearest, shown
from scenarios.experiments.scenario_files import BUILT_IN, CATALOG, MOTION
from scenarios.support.errors import ScenarioError, WrongValue
from scenarios.support.texts import schema_line
from sim.tables import Table, validated_table
from sim.trajectory import FourierTrajectory, at_rest

LONGEST = 600.0
"""Longest motion that is simulated [s]."""
REST = 1e-6
"""Largest distance of a coefficient from those of a motion that starts at rest [rad]."""
Coefficient = Annotated[float, Field(ge=-1e4, le=1e4)]  # a joint turns a few rad
Row = Annotated[list[Coefficient], Field(min_length=1)]


class MotionFile(Table):
    """A motion as a Fourier series that starts and ends at rest, in radians; one entry or row per joint."""

    duration: float = Field(gt=0.0, le=LONGEST)  # duration of one period [s]
    center: Row  # mean position [rad]
    sine: list[Row]  # coefficients of sin(2 pi k t / duration), k = 1, 2, ... [rad]
    cosine: list[Row]  # coefficients of cos(2 pi k t / duration) [rad]


@lru_cache(maxsize=32)
def read_motion(name: str, folder: Path) -> FourierTrajectory:
    """Read a built-in motion, or a file relative to `folder`; cached, so that trials share the object."""
    path = _motion_path(name, folder)
    file = validated_table(MotionFile, read_toml(path, error=ScenarioError), str(path), ScenarioError)
    sizes = [len(file.center), *map(len, file.sine), *map(len, file.cosine)]
    if len(file.sine) != sizes[0] or len(file.cosine) != sizes[0] or len(set(sizes[1:])) > 1:
        raise ScenarioError(
            f"{path}: {sizes[0]} numbers in center, and rows of {shown(sizes[1:])} in sine and cosine, do not fit; "
            "expected one row per joint, all of one length"
        )
    center, sine, cosine = (np.array(each, dtype=np.float64) for each in (file.center, file.sine, file.cosine))
    motion = at_rest(center, sine, cosine, file.duration)
    change = max(np.abs(motion.sine - sine).max(), np.abs(motion.cosine - cosine).max())
    if change > REST:
        raise ScenarioError(f"{path}: the motion does not start at rest (coefficients off by {change:.2g} rad)")
    return motion


def motion_digest(name: str, folder: Path) -> str:
    """Return the digest of a motion's file, 16 hexadecimal digits; raises `WrongValue` if it does not exist."""
    content = read_bytes(_motion_path(name, folder), most_bytes=LARGEST, error=ScenarioError)
    return hashlib.sha256(content).hexdigest()[:16]


def _motion_path(name: str, folder: Path) -> Path:
    builtin = BUILT_IN[MOTION]
    path = CATALOG / "motions" / f"{name}.toml" if name in builtin else folder / name
    if not path.exists():
        raise WrongValue(f"unknown motion {shown(name)}{nearest(name, builtin)}; built-in: {', '.join(builtin)}")
    return path


def write_motion(motion: FourierTrajectory, path: Path, comments: Sequence[str]) -> None:
    """Write a motion file with all digits, below the line that names its schema."""

    def rows(name: str, values: Array) -> list[str]:
        return [f"{name} = [", *(f"    {row.tolist()!r}," for row in values), "]"]

    lines = [schema_line("motion"), *(f"# {comment}" for comment in comments), f"duration = {motion.duration!r}  # s"]
    lines += [f"center = {motion.center.tolist()!r}  # rad", *rows("sine", motion.sine), *rows("cosine", motion.cosine)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
