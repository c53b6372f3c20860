"""A copy of a model file with what was identified."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from scenarios.gains_in_use.model_update.edits import Change, model_text
from scenarios.gains_in_use.model_update.link_values import LinkValues
from scenarios.gains_in_use.model_update.mjcf import mjcf_changes, mjcf_link_changes
from scenarios.gains_in_use.model_update.urdf import urdf_changes, urdf_link_changes
from scenarios.gains_in_use.model_update.values import JointValues

FORMATS = {"robot": (urdf_changes, urdf_link_changes), "mujoco": (mjcf_changes, mjcf_link_changes)}
"""What changes joints and links, by the name of the outermost element."""


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
    file = model_text(path)
    of_joints, of_links = FORMATS[file.root.tag]
    if links is None:
        found = of_joints(file, joints)
    else:  # a motor's inertia goes with the links
        found = of_joints(file, [replace(each, armature=None) for each in joints]) + of_links(file, links)
    edits = [edit for each in found for edit in each.edits]
    return PatchedModel(file.edited(edits), tuple(each.change for each in found))
