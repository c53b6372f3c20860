"""Motion files: the Fourier coefficients of an exciting motion, with the command that found them."""

import hashlib
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np

from scenarios.errors import ScenarioError
from scenarios.files.tables import CATALOG, nearest, read_table
from sim.trajectory import FourierTrajectory, at_rest

LONGEST = 600.0
"""Longest motion that is simulated [s]."""
MOTIONS = CATALOG / "motions"
"""Folder of the built-in motions."""


@lru_cache(maxsize=32)
def read_motion(name: str, folder: Path) -> FourierTrajectory:
    """Read a built-in motion, or a file relative to `folder`; once a process, so that trials share the object.

    Raises:
        ScenarioError: If there is none, or it is not a motion that starts and ends at rest.
    """
    path = _motion_path(name, folder)
    table = read_table(path)
    try:
        center, sine, cosine = (np.array(table[key], dtype=np.float64) for key in ("center", "sine", "cosine"))
        duration = float(str(table["duration"]))
    except (KeyError, ValueError, TypeError) as error:
        raise ScenarioError(f"{path}: expected duration, center (n), sine and cosine (n x H); {error}") from error
    values = np.concatenate((center.ravel(), sine.ravel(), cosine.ravel(), [duration]))
    if not np.isfinite(values).all() or not 0.0 < duration <= LONGEST:
        raise ScenarioError(f"{path}: expected finite coefficients and a duration up to {LONGEST:g} s")
    unknown = set(table) - {"center", "sine", "cosine", "duration"}
    if unknown:
        raise ScenarioError(f"{path}: unknown key {min(unknown)!r}; known: duration, center, sine, cosine")
    if (
        center.ndim != 1
        or sine.size == 0
        or sine.ndim != 2
        or sine.shape != cosine.shape
        or len(sine) != len(center)
        or not duration > 0
    ):
        raise ScenarioError(f"{path}: center {center.shape}, sine {sine.shape} and cosine {cosine.shape} do not fit")
    motion = at_rest(center, sine, cosine, duration)
    change = max(np.abs(motion.sine - sine).max(), np.abs(motion.cosine - cosine).max())
    if change > 1e-6:
        raise ScenarioError(f"{path}: the motion does not start at rest (coefficients off by {change:.2g} rad)")
    return motion


def motion_digest(name: str, folder: Path) -> str:
    """What tells a motion's file from another, 16 hexadecimal digits.

    Raises:
        ScenarioError: If there is none.
    """
    return hashlib.sha256(_motion_path(name, folder).read_bytes()).hexdigest()[:16]


def _motion_path(name: str, folder: Path) -> Path:
    builtin = sorted(path.stem for path in MOTIONS.glob("*.toml"))
    path = MOTIONS / f"{name}.toml" if name in builtin else folder / name
    if not path.is_file():
        raise ScenarioError(f"unknown motion {name!r}{nearest(name, builtin)}; built-in: {', '.join(builtin)}")
    return path


def write_motion(motion: FourierTrajectory, path: Path, comments: Sequence[str]) -> None:
    """Write a motion file, every digit kept."""

    def rows(name: str, values: np.ndarray) -> list[str]:
        return [f"{name} = [", *(f"    {row.tolist()!r}," for row in values), "]"]

    lines = [*(f"# {comment}" for comment in comments), f"duration = {motion.duration!r}  # s"]
    lines += [f"center = {motion.center.tolist()!r}  # rad", *rows("sine", motion.sine), *rows("cosine", motion.cosine)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
