"""The arm as its model file draws it, read once a process.

A simulation needs no shapes, and compiles and steps faster without them; they are taken off where no inertia comes from
them. Taking them off costs more than all the compiling of a trial, so that what is left is kept.
"""

from functools import lru_cache
from pathlib import Path

import mujoco
import numpy as np

INERTIAL = ("body_mass", "body_inertia", "body_ipos", "body_iquat", "body_pos", "body_quat")
"""What a model has with and without its shapes, if no inertia comes from them."""


def full_spec(path: Path) -> mujoco.MjSpec:
    """The arm with everything that its file has; its shapes touch nothing.

    Raises:
        ValueError: If MuJoCo cannot read it.
    """
    spec = mujoco.MjSpec.from_file(str(path))
    # Without islands the solver is faster, and the same: an arm is one.
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_ISLAND
    return spec


def lean_spec(path: Path) -> mujoco.MjSpec:
    """The arm without what is for the eye, a copy that may be changed; with it, where inertia comes from shapes.

    Raises:
        ValueError: If MuJoCo cannot read it.
    """
    try:
        stamp = path.stat().st_mtime_ns
    except OSError as error:
        raise ValueError(f"{error.strerror}") from error
    return _lean(path, stamp).copy()


@lru_cache(maxsize=8)
def _lean(path: Path, stamp: int) -> mujoco.MjSpec:
    full, lean = full_spec(path), full_spec(path)
    for kind in (
        "sensors",
        "keys",
        "pairs",
        "geoms",
        "materials",
        "textures",
        "meshes",
        "hfields",
        "lights",
        "cameras",
    ):
        for element in list(getattr(lean, kind)):
            lean.delete(element)
    try:
        stripped, whole = lean.compile(), full.compile()
    except ValueError:
        return full_spec(path)  # a moving body without an inertia of its own
    same = all(np.array_equal(getattr(stripped, name), getattr(whole, name)) for name in INERTIAL)
    return lean if same else full
