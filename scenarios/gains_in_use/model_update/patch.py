"""A copy of a model file with identified values."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from scenarios.gains_in_use.model_update.edits import Change, model_text
from scenarios.gains_in_use.model_update.link_values import LinkValues
from scenarios.gains_in_use.model_update.mjcf import mjcf_changes, mjcf_link_changes
from scenarios.gains_in_use.model_update.urdf import urdf_changes, urdf_link_changes
from scenarios.gains_in_use.model_update.values import JointValues

FORMATS = {"robot": (urdf_changes, urdf_link_changes), "mujoco": (mjcf_changes, mjcf_link_changes)}
"""Functions that change joints and links, by the name of the root element."""


@dataclass(frozen=True, slots=True)
class PatchedModel:
    """A patched model.

    Attributes:
        content: Content of the file.
        changes: Changed and unchanged attributes.
    """

    content: bytes
    changes: tuple[Change, ...]


def patched_model(path: Path, joints: Sequence[JointValues], links: Sequence[LinkValues] | None = None) -> PatchedModel:
    """Return a copy of a model file with identified values of joints and links.

    Args:
        path: MJCF or URDF file, already validated.
        joints: Identified values of the joints.
        links: Identified links; None to keep those of the file.

    Raises:
        ScenarioError: If its text cannot be edited in place, or a link cannot be written.
        RobotModelError: If it cannot be read.
    """
    file = model_text(path)
    of_joints, of_links = FORMATS[file.root.tag]
    if links is None:
        found = of_joints(file, joints)
    else:  # rotor inertia is written with the links
        found = of_joints(file, [replace(each, armature=None) for each in joints]) + of_links(file, links)
    edits = [edit for each in found for edit in each.edits]
    return PatchedModel(file.edited(edits), tuple(each.change for each in found))
