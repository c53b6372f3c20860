"""Meshes of a model file that are not there: left out if they are for the eye, refused if an inertia hangs on them."""

from pathlib import Path

import mujoco

from sim.errors import ModelFileError


def drop_missing_meshes(spec: mujoco.MjSpec, path: Path) -> tuple[str, ...]:
    """Take meshes without a file, and the shapes made of them, out of a model.

    Args:
        spec: Changed in place.
        path: Of the model file, which places of meshes are relative to.

    Returns:
        Their files, as the model names them.

    Raises:
        ModelFileError: If a link has its inertia from such a shape alone.
    """
    folder = path.parent / (spec.compiler.meshdir or "")
    missing = {
        mesh.name or Path(mesh.file).stem: mesh
        for mesh in spec.meshes
        if mesh.file and not (folder / mesh.file).is_file()
    }
    if not missing:
        return ()
    from_shapes = spec.compiler.inertiafromgeom != mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    for shape in [geom for geom in spec.geoms if geom.meshname in missing]:
        link = shape.parent
        if from_shapes and not link.explicitinertial and _moves(link):
            raise ModelFileError(
                f"link {link.name!r} has its inertia from the mesh {missing[shape.meshname].file!r}, "
                "which does not exist; add the file, or state an inertial"
            )
        spec.delete(shape)
    files = tuple(mesh.file for mesh in missing.values())
    for mesh in missing.values():
        spec.delete(mesh)
    return files


def _moves(body: mujoco.MjsBody) -> bool:
    while body is not None and not body.joints:
        body = body.parent
    return body is not None
