"""Motion files: the Fourier coefficients of an exciting motion, with the command that found them."""

import hashlib
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np

from ident.support.arrays import Array
from ident.support.files import LARGEST as LARGEST_FILE
from ident.support.files import read_bytes, read_toml
from ident.support.naming import nearest, shown
from scenarios.experiments.scenario_files import BUILT_IN, CATALOG, MOTION
from scenarios.support.errors import ScenarioError, WrongValue
from scenarios.support.texts import schema_line
from sim.trajectory import FourierTrajectory, at_rest

LONGEST = 600.0
"""Longest motion that is simulated [s]."""
LARGEST = 1e4
"""Largest number of a motion file; a joint turns a few rad."""
KEYS = ("duration", "center", "sine", "cosine")
MOTIONS = CATALOG / "motions"
"""Folder of the built-in motions."""
FORMS = ("a number", "an array of numbers", "rows of numbers, all of one length")
"""Values by number of dimensions."""


@lru_cache(maxsize=32)
def read_motion(name: str, folder: Path) -> FourierTrajectory:
    """Read a built-in motion, or a file relative to `folder`; cached, so that trials share the object.

    Raises:
        ScenarioError: If it does not exist, or does not start and end at rest.
    """
    path = _motion_path(name, folder)
    table = read_toml(path, error=ScenarioError)
    for key in table:
        if key not in KEYS:
            raise ScenarioError(f"{path}: unknown key {shown(key)}{nearest(key, KEYS)}; known: {', '.join(KEYS)}")
    for key in KEYS:
        if key not in table:
            raise ScenarioError(f"{path}: {key} is missing; expected {', '.join(KEYS)}")
    duration = float(_numbers(path, table, "duration", 0))
    if not 0.0 < duration <= LONGEST:
        raise ScenarioError(f"{path}: duration = {duration:g}; expected up to {LONGEST:g} s")
    center, sine, cosine = (_numbers(path, table, key, d) for key, d in (("center", 1), ("sine", 2), ("cosine", 2)))
    if sine.size == 0 or sine.shape != cosine.shape or len(sine) != len(center):
        raise ScenarioError(f"{path}: center {center.shape}, sine {sine.shape} and cosine {cosine.shape} do not fit")
    motion = at_rest(center, sine, cosine, duration)
    change = max(np.abs(motion.sine - sine).max(), np.abs(motion.cosine - cosine).max())
    if change > 1e-6:
        raise ScenarioError(f"{path}: the motion does not start at rest (coefficients off by {change:.2g} rad)")
    return motion


def _numbers(path: Path, table: Mapping[str, object], key: str, dimensions: int) -> Array:
    def numbers(value: object, dimensions: int) -> bool:
        if dimensions:
            return isinstance(value, list) and all(numbers(inner, dimensions - 1) for inner in value)
        return isinstance(value, int | float) and not isinstance(value, bool)

    try:
        if not numbers(table[key], dimensions):
            raise ValueError
        values = np.array(table[key], dtype=np.float64)
    except (ValueError, OverflowError):  # rows of unequal length, or an integer too large for a float
        raise ScenarioError(f"{path}: {key} = {shown(table[key])}; expected {FORMS[dimensions]}") from None
    if not (np.abs(values) <= LARGEST).all():
        raise ScenarioError(f"{path}: {key} contains a number that is not finite or beyond {LARGEST:g}")
    return values


def motion_digest(name: str, folder: Path) -> str:
    """Return the digest of a motion's file, 16 hexadecimal digits.

    Raises:
        WrongValue: If it does not exist.
    """
    content = read_bytes(_motion_path(name, folder), most_bytes=LARGEST_FILE, error=ScenarioError)
    return hashlib.sha256(content).hexdigest()[:16]


def _motion_path(name: str, folder: Path) -> Path:
    builtin = BUILT_IN[MOTION]
    path = MOTIONS / f"{name}.toml" if name in builtin else folder / name
    if not path.exists():
        raise WrongValue(f"unknown motion {shown(name)}{nearest(name, builtin)}; built-in: {', '.join(builtin)}")
    return path


def write_motion(motion: FourierTrajectory, path: Path, comments: Sequence[str]) -> None:
    """Write a motion file with all digits, below the line that names its schema."""

    def rows(name: str, values: np.ndarray) -> list[str]:
        return [f"{name} = [", *(f"    {row.tolist()!r}," for row in values), "]"]

    lines = [schema_line("motion"), *(f"# {comment}" for comment in comments), f"duration = {motion.duration!r}  # s"]
    lines += [f"center = {motion.center.tolist()!r}  # rad", *rows("sine", motion.sine), *rows("cosine", motion.cosine)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
