"""A copy of a model file with what was identified."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ident.model.files.xml_tree import LARGEST_FILE as LARGEST
from ident.support.errors import RobotModelError
from ident.support.file_access import read_bytes
from ident.support.naming import one_line
from scenarios.gains_in_use.model_update.link_values import LinkValues
from scenarios.gains_in_use.model_update.mjcf import mjcf_changes
from scenarios.gains_in_use.model_update.mjcf_links import mjcf_link_changes
from scenarios.gains_in_use.model_update.places import Change, Patched
from scenarios.gains_in_use.model_update.urdf import urdf_changes
from scenarios.gains_in_use.model_update.urdf_links import urdf_link_changes
from scenarios.gains_in_use.model_update.values import JointValues
from scenarios.gains_in_use.model_update.xml_text import Tag, edited, start_tags

FORMATS: dict[str, Callable[[bytes, Sequence[Tag], Sequence[JointValues]], list[Patched]]] = {
    "robot": urdf_changes,
    "mujoco": mjcf_changes,
}
"""By the name of the outermost element."""
LINK_FORMATS: dict[str, Callable[[bytes, Sequence[Tag], Sequence[LinkValues]], list[Patched]]] = {
    "robot": urdf_link_changes,
    "mujoco": mjcf_link_changes,
}
"""The same of links."""


@dataclass(frozen=True, slots=True)
class PatchedModel:
    """A patched model.

    Attributes:
        content: Of the file.
        changes: What was changed, and what was left alone.
    """

    content: bytes
    changes: tuple[Change, ...]


def patched_model(path: Path, joints: Sequence[JointValues], links: Sequence[LinkValues] | None = None) -> PatchedModel:
    """Put what is known of an arm's joints, and of its links, into a copy of its model file.

    Args:
        path: MJCF or URDF file, read as a model before.
        joints: What is known.
        links: What is known of links; None to leave them alone.

    Raises:
        ScenarioError: If its text cannot be changed in place, or a link cannot be stated there.
        RobotModelError: If it cannot be read.
    """
    content = read_bytes(path, most_bytes=LARGEST, error=RobotModelError)
    tags = start_tags(content, one_line(path))
    if links is None:
        found = FORMATS[tags[0].name](content, tags, joints)
    else:  # a motor's inertia goes with the links
        found = FORMATS[tags[0].name](content, tags, [replace(each, armature=None) for each in joints])
        found += LINK_FORMATS[tags[0].name](content, tags, links)
    edits = [edit for each in found for edit in each.edits]
    return PatchedModel(edited(content, edits), tuple(each.change for each in found))
