"""Attributes of a URDF's joints: `limit effort`, `dynamics damping friction`. URDF has no armature."""

from collections.abc import Sequence

from scenarios.gains_in_use.model_update.places import Change, Patched, left, scaled_effort, shown
from scenarios.gains_in_use.model_update.values import JointValues, Unknown, Value
from scenarios.gains_in_use.model_update.xml_text import Tag, attribute_edit, child_edit

NO_ARMATURE = "URDF has no such attribute"


def urdf_changes(content: bytes, tags: Sequence[Tag], joints: Sequence[JointValues]) -> list[Patched]:
    """What becomes of a URDF.

    Args:
        content: The file.
        tags: Its start tags.
        joints: What is known; their names are those of joints in the file.
    """
    number = {
        tag.attributes.get("name", ""): k
        for k, tag in enumerate(tags)
        if tag.name == "joint" and tag.parent is not None and tags[tag.parent].parent is None
    }
    return [patched for joint in joints for patched in _joint(content, tags, number[joint.name], joint)]


def _joint(content: bytes, tags: Sequence[Tag], at: int, joint: JointValues) -> list[Patched]:
    parts = {tag.name: tag for tag in tags if tag.parent == at}
    limit, dynamics = parts.get("limit"), parts.get("dynamics")
    change = scaled_effort(joint.name, "effort", limit and limit.attributes.get("effort"), joint.effort)
    edits = () if limit is None or change.after is None else (attribute_edit(content, limit, "effort", change.after),)
    found = [Patched(change, edits)]
    wanted = dict[str, str]()
    for name, known in (("damping", joint.damping), ("friction", joint.friction)):
        before = dynamics and dynamics.attributes.get(name)
        if isinstance(known, Unknown):
            found.append(left(joint.name, name, before, known.reason))
            continue
        wanted[name] = shown(known.value)
        changed = Change(joint=joint.name, attribute=name, before=before, after=wanted[name], rel_std=known.rel_std)
        found.append(
            Patched(changed, () if dynamics is None else (attribute_edit(content, dynamics, name, wanted[name]),))
        )
    if dynamics is None and wanted:
        text = "".join(f' {name}="{value}"' for name, value in wanted.items())
        found[-1] = Patched(found[-1].change, (child_edit(content, tags[at], f"<dynamics{text}/>"),))
    if isinstance(joint.armature, Value):
        reason = f"{NO_ARMATURE}; found {joint.armature.value:.4g}"
        found.append(left(joint.name, "armature", None, reason))
    return found
