"""A URDF's joints, `limit effort` and `dynamics damping friction`, and links, `inertial`. URDF has no armature."""

from collections.abc import Sequence

from ident.model.files.xml_tree import Element
from ident.payload.payload import INERTIA_KEYS
from scenarios.gains_in_use.model_update.edits import (
    Change,
    ModelText,
    Patched,
    known_attribute,
    numbers,
    scaled_effort,
)
from scenarios.gains_in_use.model_update.link_values import COMMENT, LinkValues
from scenarios.gains_in_use.model_update.values import JointValues, Value
from scenarios.support.errors import ScenarioError


def urdf_changes(file: ModelText, joints: Sequence[JointValues]) -> list[Patched]:
    """Return the changes of the joints of a URDF.

    Args:
        file: The file.
        joints: Identified values, by names of joints in the file.
    """
    named = {joint.attributes.get("name", ""): joint for joint in file.root.all("joint")}
    return [patched for joint in joints for patched in _joint(file, named[joint.name], joint)]


def _joint(file: ModelText, element: Element, joint: JointValues) -> list[Patched]:
    parts = {child.tag: child for child in element.children}
    limit, dynamics = parts.get("limit"), parts.get("dynamics")
    stated = dynamics.attributes if dynamics else {}
    effort = limit.attributes.get("effort") if limit else None
    found = [scaled_effort(file, limit, joint.name, "effort", effort, joint.effort)]
    found += [
        known_attribute(file, dynamics, joint.name, name, stated.get(name), known)
        for name, known in (("damping", joint.damping), ("friction", joint.friction))
    ]
    new = "".join(f' {each.change.attribute}="{each.change.after}"' for each in found[1:] if each.change.after)
    if dynamics is None and new:
        found[-1] = Patched(found[-1].change, (file.child(element, f"<dynamics{new}/>"),))
    if isinstance(joint.armature, Value):
        found.append(_no_armature(joint.name, joint.armature.value))
    return found


def urdf_link_changes(file: ModelText, links: Sequence[LinkValues]) -> list[Patched]:
    """Return the changes of the links of a URDF.

    Raises:
        ScenarioError: If a link states no mass and inertia.
    """
    joints = {joint.attributes.get("name", ""): joint for joint in file.root.all("joint")}
    named = {link.attributes.get("name", ""): link for link in file.root.all("link")}
    found = list[Patched]()
    for each in links:
        child = joints[each.joint].all("child")[0]
        found += _link(file, named[child.attributes["link"]], each)
    comment = file.child(file.root, f"<!-- {COMMENT.format(elsewhere=', which URDF does not support')} -->")
    found[0] = Patched(found[0].change, (*found[0].edits, comment))
    return found


def _link(file: ModelText, element: Element, link: LinkValues) -> list[Patched]:
    inertial = next(iter(element.all("inertial")), None)
    parts = {child.tag: child for child in inertial.children} if inertial else {}
    if inertial is None or "mass" not in parts or "inertia" not in parts:
        raise ScenarioError(f"link {element.attributes.get('name')}: states no mass and inertia")
    xyz, origin, mass, inertia = numbers(link.com), parts.get("origin"), parts["mass"], parts["inertia"]
    stated = origin.attributes if origin else {}
    before, turned = stated.get("xyz", "0 0 0"), stated.get("rpy", "")
    if origin is None:
        place = [file.child(inertial, f'<origin xyz="{xyz}"/>')]
    else:
        place = [file.attribute(origin, "xyz", xyz)] + ([file.attribute(origin, "rpy", "0 0 0")] if turned else [])
    moments = [file.attribute(inertia, *pair) for pair in zip(INERTIA_KEYS, map(repr, link.inertia), strict=True)]
    old = " ".join(inertia.attributes.get(name, "0") for name in INERTIA_KEYS)
    found = [
        Patched(Change(joint=link.joint, attribute=name, before=was, after=now), tuple(edits))
        for name, was, now, edits in (
            ("mass", mass.attributes.get("value"), repr(link.mass), [file.attribute(mass, "value", repr(link.mass))]),
            ("inertial origin", f"{before}; rpy {turned}" if turned else before, xyz, place),
            ("inertia", old, numbers(link.inertia), moments),
        )
    ]
    return found if link.motor is None else [*found, _no_armature(link.joint, link.motor)]


def _no_armature(joint: str, found: float) -> Patched:
    reason = f"URDF has no such attribute; found {found:.4g}"
    return Patched(Change(joint=joint, attribute="armature", before=None, reason=reason))
