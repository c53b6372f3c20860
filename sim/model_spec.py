"""The arm of a model file, read once per process.

A simulation needs no shapes, and compiles and steps faster without them. Shapes are removed unless inertias are
computed from them. The result is cached, because the removal takes longer than compiling a trial.
"""

from functools import lru_cache
from pathlib import Path

import mujoco
import numpy as np

from sim.errors import ModelFileError
from sim.frozen_joints import bodies_to, hold_all_but_arm
from sim.meshes import drop_unusable_meshes

INERTIAL = ("body_mass", "body_inertia", "body_ipos", "body_iquat", "body_pos", "body_quat")
"""Attributes of a model that are the same with and without shapes, if no inertia is computed from them."""


def full_spec(path: Path, flange: str | None = None) -> mujoco.MjSpec:
    """Return the arm with the shapes of its file, without contacts.

    Args:
        path: MJCF or URDF file.
        flange: Last body of the arm; joints outside the chain to it are locked.

    Raises:
        ValueError: If MuJoCo cannot read it.
        ModelFileError: If the model is not an arm, or the mesh of a link's inertia is missing or not a solid.
    """
    spec, _ = _drawn(path, flange, file_stamp(path))
    return spec.copy()


def unusable_meshes(path: Path, flange: str | None = None) -> tuple[str, ...]:
    """Return the files of meshes that are missing or not solids; arguments and errors as `full_spec`."""
    return _drawn(path, flange, file_stamp(path))[1]


def file_stamp(path: Path) -> int:
    """Time of the last change of a file, 0 if there is none: part of the key of whatever is cached of a model."""
    return path.stat().st_mtime_ns if path.is_file() else 0


@lru_cache(maxsize=8)
def _drawn(path: Path, flange: str | None, stamp: int) -> tuple[mujoco.MjSpec, tuple[str, ...]]:
    """The arm with all shapes that can be compiled, and the files of others."""
    spec, missing = _read(path, flange)
    solid = spec.copy()
    for geom in solid.geoms:
        geom.contype = geom.conaffinity = 1  # as for distances: a visual mesh may have no convex hull
    try:
        solid.compile()
    except ValueError:
        missing += _drop_meshes(spec, path, flange, compiled=True)
    return spec, missing


def _read(path: Path, flange: str | None) -> tuple[mujoco.MjSpec, tuple[str, ...]]:
    """The arm with shapes that have their files, and the files that are missing."""
    spec = mujoco.MjSpec.from_file(str(path))
    if path.suffix.lower() == ".urdf":  # inertias are stated; a collision shape is not a link
        spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    try:
        hold_all_but_arm(spec, flange)
    except ModelFileError as error:
        raise ModelFileError(f"robot model {path}: {error}") from error
    missing = _drop_meshes(spec, path, flange)
    spec.compiler.fusestatic = False  # bodies keep their names, and an empty payload is a body
    # Without islands the solver is faster with the same result: an arm is a single island.
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_ISLAND
    return spec, missing


def _drop_meshes(spec: mujoco.MjSpec, path: Path, flange: str | None, *, compiled: bool = False) -> tuple[str, ...]:
    arm = None if flange is None else bodies_to(spec, flange)
    try:
        return drop_unusable_meshes(spec, path, arm, compiled=compiled)
    except ModelFileError as error:
        raise ModelFileError(f"robot model {path}: {error}") from error


def lean_spec(path: Path, flange: str | None = None) -> mujoco.MjSpec:
    """Return a copy of the arm without visual elements, or with them if inertia is computed from shapes.

    Raises:
        ValueError: If MuJoCo cannot read it.
        ModelFileError: If the model is not an arm.
    """
    try:
        stamp = path.stat().st_mtime_ns
    except OSError as error:
        raise ValueError(f"{error.strerror}") from error
    return _lean(path, flange, stamp).copy()


def compiler_reason(error: ValueError) -> str:
    """Return the message of MuJoCo's compiler in one line that names the element."""
    what, *details = str(error).removeprefix("Error: ").splitlines()
    element = next(
        (line.partition("'")[2].partition("'")[0] for line in details if line.startswith("Element name")), ""
    )
    if "mass and inertia of moving bodies" in what:
        return f"link {element!r} has no mass or no moments of inertia; state an inertial with both"
    return f"{what} (element {element!r})" if element else what


@lru_cache(maxsize=8)
def _lean(path: Path, flange: str | None, stamp: int) -> mujoco.MjSpec:
    (full, _), (lean, _) = _read(path, flange), _read(path, flange)
    for kind in ("geoms", "materials", "textures", "meshes", "hfields", "lights", "cameras"):
        for element in list(getattr(lean, kind)):
            lean.delete(element)
    try:
        stripped = lean.compile()
    except ValueError:
        return full_spec(path, flange)  # a moving body that states no inertia
    stated = all(body.explicitinertial or not body.geoms for body in full.bodies[1:])
    if stated and full.compiler.inertiafromgeom != mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE:
        return lean
    whole = full_spec(path, flange).compile()
    same = all(np.array_equal(getattr(stripped, name), getattr(whole, name)) for name in INERTIAL)
    return lean if same else full_spec(path, flange)
