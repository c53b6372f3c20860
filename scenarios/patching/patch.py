"""A copy of a model file with what was identified."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ident.errors import RobotModelError
from ident.file_access import read_bytes
from ident.model_files.xml_tree import LARGEST
from ident.naming import one_line
from scenarios.patching.mjcf import mjcf_changes
from scenarios.patching.places import Change, Patched
from scenarios.patching.urdf import urdf_changes
from scenarios.patching.values import JointValues
from scenarios.patching.xml_text import Tag, edited, start_tags

FORMATS: dict[str, Callable[[bytes, Sequence[Tag], Sequence[JointValues]], list[Patched]]] = {
    "robot": urdf_changes,
    "mujoco": mjcf_changes,
}
"""By the name of the outermost element."""


@dataclass(frozen=True, slots=True)
class PatchedModel:
    """A patched model.

    Attributes:
        content: Of the file.
        changes: What was changed, and what was left alone.
    """

    content: bytes
    changes: tuple[Change, ...]


def patched_model(path: Path, joints: Sequence[JointValues]) -> PatchedModel:
    """Put what is known of an arm's joints into a copy of its model file.

    Args:
        path: MJCF or URDF file, read as a model before.
        joints: What is known.

    Raises:
        NotPatchable: If its text cannot be changed in place.
        RobotModelError: If it cannot be read.
    """
    content = read_bytes(path, most_bytes=LARGEST, error=RobotModelError)
    tags = start_tags(content, one_line(path))
    found = FORMATS[tags[0].name](content, tags, joints)
    edits = [edit for each in found for edit in each.edits]
    return PatchedModel(edited(content, edits), tuple(each.change for each in found))
