"""Meshes of a model file: found in ROS packages, omitted if missing or not a solid.

A mesh is only visual if its link states an inertia; it is required if the inertia is computed from it.
"""

from pathlib import Path
from xml.etree import ElementTree

import mujoco

from sim.errors import ModelFileError

PACKAGE, FILE = "package://", "file://"


def drop_unusable_meshes(
    spec: mujoco.MjSpec, path: Path, arm: list[mujoco.MjsBody] | None, *, compiled: bool = False
) -> tuple[str, ...]:
    """Remove meshes without a file or that MuJoCo cannot compile to a solid, and their shapes, from a model.

    Args:
        spec: Changed in place; meshes in packages get the paths at which they were found.
        path: The model file; paths of meshes are relative to it.
        arm: Bodies whose inertia is used; None for all.
        compiled: Whether meshes are test-compiled, which takes time.

    Returns:
        Files of these meshes, as named in the model.

    Raises:
        ModelFileError: If the inertia of a link of the arm is computed from such a shape.
    """
    folder = path.parent / (spec.compiler.meshdir or "")
    unusable: dict[str, str] = {}
    for mesh in spec.meshes:
        stated, name = mesh.file, mesh.name or Path(mesh.file).stem
        if stated.startswith((PACKAGE, FILE)):
            mesh.file = str(_in_package(stated, path))
        if stated and not ((folder / mesh.file).is_file() and (not compiled or _is_solid(mesh, folder / mesh.file))):
            unusable[name] = stated
    from_shapes = spec.compiler.inertiafromgeom != mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    for shape in [geom for geom in spec.geoms if geom.meshname in unusable]:
        link, weighs = shape.parent, shape.mass != 0.0 and shape.density != 0.0  # NaN where no mass is stated
        counts = from_shapes and weighs and not link.explicitinertial and _moves(link)
        if counts and (arm is None or any(link is each for each in arm)):
            fault = "from which MuJoCo cannot make a solid; correct" if compiled else "which does not exist; add"
            raise ModelFileError(
                f"link {link.name!r} has its inertia from the mesh {unusable[shape.meshname]!r}, {fault} the "
                "file, or state an inertial"
            )
        spec.delete(shape)
    for mesh in [mesh for mesh in spec.meshes if (mesh.name or Path(mesh.file).stem) in unusable]:
        spec.delete(mesh)
    return tuple(unusable.values())


def _in_package(stated: str, path: Path) -> Path:
    """Return the file of a URI; packages are found above the model by folder name or by `package.xml`."""
    if stated.startswith(FILE):
        return Path(stated.removeprefix(FILE))
    package, _, inside = stated.removeprefix(PACKAGE).partition("/")
    for folder in path.resolve().parents:
        beside = folder / package
        if folder.name == package or _package_name(folder) == package:
            beside = folder
        if (beside / inside).is_file():
            return beside / inside
    return path.parent / package / inside


def _package_name(folder: Path) -> str:
    try:
        return ElementTree.parse(folder / "package.xml").findtext("name", "").strip()
    except (OSError, ElementTree.ParseError):
        return ""


def _is_solid(mesh: mujoco.MjsMesh, file: Path) -> bool:
    """Return whether MuJoCo can compile a mesh."""
    alone = mujoco.MjSpec()
    alone.add_mesh(name="mesh", file=str(file), scale=mesh.scale, inertia=mesh.inertia)
    alone.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="mesh")
    try:
        alone.compile()
    except ValueError:
        return False
    return True


def _moves(body: mujoco.MjsBody) -> bool:
    while body is not None and not body.joints:
        body = body.parent
    return body is not None
