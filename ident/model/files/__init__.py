"""Robot model files, reduced to the kinematics of the arm for Pinocchio.

`MODEL_FILES` has the readers by file ending; `minimal_model` reads any of them.
"""

from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree as ET

from ident.model.files.mjcf import MinimalModel, minimal_mjcf
from ident.model.files.urdf import minimal_urdf
from ident.model.files.xml_tree import read_xml, title
from ident.support.errors import RobotModelError
from ident.support.naming import one_line, shown

MODEL_FILES: dict[str, Callable[[ET.Element, Path, str | None], MinimalModel]] = {
    ".urdf": minimal_urdf,
    ".xml": minimal_mjcf,
    ".mjcf": minimal_mjcf,
}
"""Readers by the ending of a file's name."""
EXPAND = "this is a xacro template; run xacro first, and give the file that it writes"


def minimal_model(path: Path, flange: str | None = None) -> MinimalModel:
    """Reduce a robot model to its kinematics.

    Args:
        path: The file.
        flange: Last body of the arm; joints that do not lead to it are locked. None where all joints are the arm's.

    Raises:
        RobotModelError: If the file is missing, of an unknown kind, unreadable, or not valid.
    """
    check_ending(path)
    root = read_xml(path)
    for element in root.iter():
        left = next((value for value in element.attrib.values() if "${" in value), None)
        if left is not None or element.tag.startswith("xacro:"):
            raise RobotModelError(f"{title(element)}: {'' if left is None else f'{shown(left)}: '}{EXPAND}")
    return MODEL_FILES[path.suffix.lower()](root, path, flange)


def check_ending(path: Path) -> None:
    """Check that a file's name has the ending of a robot model.

    Raises:
        RobotModelError: If it has not.
    """
    ending = path.suffix.lower()
    if ending not in MODEL_FILES:
        what = EXPAND if ending == ".xacro" else "expected a .urdf, .xml or .mjcf file"
        raise RobotModelError(f"robot model {one_line(path)}: {what}")
