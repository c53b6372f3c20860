"""Joints of an MJCF file: default classes resolved, every number checked."""

import math

from ident.model.files.minimal import tag
from ident.model.files.numbers import FARTHEST, direction, vector
from ident.model.files.xml_tree import Element
from ident.support.errors import RobotModelError
from ident.support.naming import nearest, shown

JOINT = ("type", "axis", "pos", "range", "ref", "limited")
"""Attributes of a joint that decide its kinematics."""
KINDS = ("hinge", "slide")


def joint_defaults(root: Element) -> dict[str, dict[str, str]]:
    """Attributes of joints by default class, `main` where none is named.

    Raises:
        RobotModelError: If a class has no name or a number is wrong.
    """
    defaults: dict[str, dict[str, str]] = {"main": {}}
    for section in root.all("default"):
        if section.attributes.get("class", "main") != "main":
            raise RobotModelError(f"{section.title}: the outermost default class is main and has no other name")
        _add_defaults(section, "main", defaults)
    return defaults


def minimal_joint(joint: Element, defaults: dict[str, str], *, unit: str, autolimits: bool, number: int) -> str:
    """A joint with every attribute that counts stated, angles in radians and ranges as Pinocchio takes them.

    Args:
        joint: A `joint` or `freejoint`.
        defaults: Attributes of its class.
        unit: Of angles, "degree" or "radian"; positions of a slide are in metres whatever it is.
        autolimits: Whether a range alone limits it.
        number: Its place among the joints from 1, for its name if it has none.

    Raises:
        RobotModelError: If it is no hinge or slide, or a number is wrong.
    """
    _check_numbers(joint)
    resolved = {**defaults, **_kinematic(joint)}
    kind = "free" if joint.tag == "freejoint" else resolved.get("type", "hinge")
    if kind in ("free", "ball"):
        raise RobotModelError(
            f"{joint.title}: a {kind} joint is not supported; only fixed-base arms of hinge and slide joints are"
        )
    if kind not in KINDS:
        raise RobotModelError(
            f"{joint.title}: type {shown(kind)} is unknown{nearest(kind, KINDS)}; known: hinge, slide"
        )
    limited = resolved.pop("limited", "auto")
    if limited == "false" or (limited == "auto" and not autolimits):
        resolved.pop("range", None)
    resolved |= _positions(resolved, math.radians(1.0) if unit == "degree" and kind == "hinge" else 1.0)
    return tag("joint", {"name": joint.attributes.get("name", f"joint{number}"), **resolved, "type": kind})


def _positions(resolved: dict[str, str], scale: float) -> dict[str, str]:
    """Range and ref of a joint times a scale.

    MuJoCo states a range in the joint's position, which is `ref` where the joint is drawn. Pinocchio takes `ref` off
    the ends, though its positions are the same; it is given ends that are that much larger.
    """
    ref = scale * float(resolved.get("ref", "0"))
    found = {"ref": repr(ref)} if "ref" in resolved else {}
    if "range" in resolved:
        found["range"] = " ".join(repr(scale * float(end) + ref) for end in resolved["range"].split())
    return found


def _add_defaults(section: Element, name: str, defaults: dict[str, dict[str, str]]) -> None:
    """The class of a section and those inside, each starting from the one around it."""
    for joint in section.all("joint"):
        _check_numbers(joint)
        defaults[name] = {**defaults[name], **_kinematic(joint)}
    for inner in section.all("default"):
        inner_name = inner.attributes.get("class")
        if inner_name is None:
            raise RobotModelError(f"{inner.where}: a default class inside another needs a name, class = ...")
        defaults[inner_name] = {**defaults[name], **defaults.get(inner_name, {})}
        _add_defaults(inner, inner_name, defaults)


def _kinematic(joint: Element) -> dict[str, str]:
    return {key: value for key, value in joint.attributes.items() if key in JOINT}


def _check_numbers(joint: Element) -> None:
    for attribute in joint.attributes:
        if attribute not in (*JOINT, "name", "class") and (close := nearest(attribute, JOINT)):
            raise RobotModelError(f"{joint.title}: unknown attribute {shown(attribute)}{close}")
    direction(joint, "axis")
    vector(joint, "pos", 3, largest=FARTHEST)
    vector(joint, "range", 2)
    vector(joint, "ref", 1)
