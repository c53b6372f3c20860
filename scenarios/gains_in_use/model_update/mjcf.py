"""Attributes of an MJCF file's joints and actuators, those of default classes looked up.

Damping, friction loss and armature are written into the joint itself, whatever its class says. An effort limit is
`actuatorfrcrange` of the joint, `forcerange` of its actuators, and `ctrlrange` of a `motor`, whose control is a force.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from scenarios.gains_in_use.model_update.places import Change, Patched, left, scaled_effort, shown
from scenarios.gains_in_use.model_update.values import JointValues, Unknown
from scenarios.gains_in_use.model_update.xml_text import Tag, attribute_edit

NOT_THERE = "the file has no joint of this name; it may be in an included file"
MAIN = "main"
ACTUATORS = ("general", "motor", "position", "velocity", "intvelocity", "damper", "cylinder", "muscle", "dcmotor")


@dataclass(frozen=True, slots=True, eq=False)
class _File:
    """An MJCF file.

    Attributes:
        content: Its bytes.
        tags: Its start tags.
        defaults: Attributes by default class and element, those of classes around it included.
    """

    content: bytes
    tags: Sequence[Tag]
    defaults: Mapping[tuple[str, str], Mapping[str, str]]

    def above(self, tag: Tag) -> list[Tag]:
        """The tags around one, innermost first."""
        found = list[Tag]()
        while tag.parent is not None:
            tag = self.tags[tag.parent]
            found.append(tag)
        return found

    def resolved(self, tag: Tag, attribute: str) -> str | None:
        """An attribute of an element, or what its class says."""
        inherited = (each.attributes.get("childclass") for each in self.above(tag))
        own = tag.attributes.get("class") or next((name for name in inherited if name), MAIN)
        return tag.attributes.get(attribute, self.defaults.get((own, _kind(tag)), {}).get(attribute))


def mjcf_changes(content: bytes, tags: Sequence[Tag], joints: Sequence[JointValues]) -> list[Patched]:
    """What becomes of an MJCF file; as `urdf_changes`, but a joint that the file does not name is left alone."""
    file = _File(content, tags, _defaults(tags))
    inside = {id(tag): {each.name for each in file.above(tag)} for tag in tags}
    bodies = {
        tag.attributes.get("name", ""): tag for tag in tags if tag.name == "joint" and "worldbody" in inside[id(tag)]
    }
    drives = [tag for tag in tags if tag.name in ACTUATORS and "actuator" in inside[id(tag)]]
    found = list[Patched]()
    for joint in joints:
        tag = bodies.get(joint.name)
        if tag is None:
            found.append(left(joint.name, "joint", None, NOT_THERE))
            continue
        found += _efforts(file, tag, drives, joint)
        for name, known in (
            ("damping", joint.damping), ("frictionloss", joint.friction), ("armature", joint.armature)
        ):  # fmt: skip
            if known is None:
                continue
            before = file.resolved(tag, name)
            if isinstance(known, Unknown):
                found.append(left(joint.name, name, before, known.reason))
                continue
            after = shown(known.value)
            change = Change(joint=joint.name, attribute=name, before=before, after=after, rel_std=known.rel_std)
            found.append(Patched(change, (attribute_edit(content, tag, name, after),)))
    return found


def _efforts(file: _File, joint: Tag, drives: Sequence[Tag], values: JointValues) -> list[Patched]:
    """Every effort limit that the file states of a joint; one line that says so if it states none."""
    name = values.name
    stated = [(joint, "actuatorfrcrange")]
    for tag in drives:
        if name in (tag.attributes.get("joint"), tag.attributes.get("jointinparent")):
            stated += [(tag, "forcerange"), *([(tag, "ctrlrange")] if tag.name == "motor" else [])]
    found = list[Patched]()
    for tag, attribute in stated:
        before = file.resolved(tag, attribute)
        if before is not None:
            change = scaled_effort(name, attribute, before, values.effort)
            edits = () if change.after is None else (attribute_edit(file.content, tag, attribute, change.after),)
            found.append(Patched(change, edits))
    return found or [Patched(scaled_effort(name, "forcerange", None, values.effort))]


def _kind(tag: Tag) -> str:
    """Default classes have one entry for all actuators, whatever they are called there."""
    return "actuator" if tag.name in ACTUATORS else tag.name


def _defaults(tags: Sequence[Tag]) -> dict[tuple[str, str], dict[str, str]]:
    """Attributes of default classes; outer ones come first in the file."""
    found: dict[tuple[str, str], dict[str, str]] = {}
    for tag in tags:
        section = None if tag.parent is None else tags[tag.parent]
        if section is None or section.name != "default" or tag.name == "default":
            continue
        found.setdefault((_class(section), _kind(tag)), {}).update(tag.attributes)
    for tag in tags:  # an inner class has what the one around it has, unless it says otherwise
        if tag.name == "default" and tag.parent is not None and tags[tag.parent].name == "default":
            outer, own = _class(tags[tag.parent]), _class(tag)
            for (name, kind), attributes in list(found.items()):
                if name == outer:
                    found[own, kind] = {**attributes, **found.get((own, kind), {})}
    return found


def _class(section: Tag) -> str:
    return section.attributes.get("class", MAIN)
