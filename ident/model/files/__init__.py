"""Robot model files: checked here, reduced to their kinematics, then read by Pinocchio.

`MODEL_FILES` names what each ending is; `minimal_model` reads any of them.
"""

from collections.abc import Callable
from pathlib import Path

from ident.model.files.minimal import MinimalModel
from ident.model.files.mjcf import minimal_mjcf
from ident.model.files.urdf import minimal_urdf
from ident.model.files.xml_tree import Element, read_xml
from ident.support.errors import RobotModelError
from ident.support.naming import one_line

MODEL_FILES: dict[str, Callable[[Element, Path, str | None], MinimalModel]] = {
    ".urdf": minimal_urdf,
    ".xml": minimal_mjcf,
    ".mjcf": minimal_mjcf,
}
"""Readers by the ending of a file's name."""


def minimal_model(path: Path, flange: str | None = None) -> MinimalModel:
    """Read a robot model and check every number of its kinematics.

    Args:
        path: The file.
        flange: Last body of the arm; joints that do not lead to it are held. None where all joints are the arm's.

    Raises:
        RobotModelError: If the file is missing, of an unknown kind, unreadable, or states what cannot be.
    """
    reader = MODEL_FILES.get(path.suffix.lower())
    if reader is None:
        raise RobotModelError(f"robot model {one_line(path)}: expected a .urdf, .xml or .mjcf file")
    return reader(read_xml(path), path, flange)
