"""A URDF reduced to links and joints, with what Pinocchio's reader ignores checked; the reader checks the rest."""

import math
from pathlib import Path
from xml.etree import ElementTree as ET

from ident.model.files.mjcf import NAME_IT, MinimalModel, refuse_unknown_flange
from ident.model.files.xml_tree import check_attributes, title, where
from ident.support.errors import RobotModelError
from ident.support.naming import nearest, one_line, shown

MOST_LINKS = 1000
"""Largest number of links, as the readers are recursive."""
FARTHEST_TURN, ENDLESS = 4.0 * math.pi, 1000.0
"""Limits of a revolute joint between these values [rad] are probably in degrees; larger ones mean no limit."""
PARTS = {
    "parent": {"link": 0},
    "child": {"link": 0},
    "origin": {"xyz": 3, "rpy": 3},
    "axis": {"xyz": 3},
    "limit": {"lower": 0, "upper": 0, "effort": 0, "velocity": 0},
    "mimic": {},
}
"""Kinematic elements of a joint with their attributes; a misspelt one would leave a default."""


def minimal_urdf(root: ET.Element, path: Path, flange: str | None = None) -> MinimalModel:
    """Reduce a URDF, to the chain to a flange if named; changes `root`.

    Raises:
        RobotModelError: If an attribute, the number of links or their order is wrong; the message names the line.
    """
    if root.tag != "robot":
        raise RobotModelError(
            f"{where(root)}: the root element is {root.tag}, expected robot; MJCF files end in .xml or .mjcf"
        )
    if flange is not None:
        urdf_to_flange(root, flange)
    links, joints = root.findall("link"), root.findall("joint")
    if not 0 < len(links) <= MOST_LINKS:
        raise RobotModelError(f"{title(root)}: {len(links)} links, expected 1 to {MOST_LINKS}")
    arm = ET.Element("robot", {"name": root.get("name") or path.stem})
    arm.extend([ET.Element("link", {"name": link.get("name", "")}) for link in links])
    arm.extend([_joint(joint) for joint in joints])
    _refuse_loops(root, joints)
    return MinimalModel("urdf", ET.tostring(arm, encoding="unicode"))


def urdf_to_flange(root: ET.Element, flange: str) -> None:
    """Remove the links and joints outside the chain from the base to a flange.

    Raises:
        RobotModelError: If no link has that name.
    """
    refuse_unknown_flange(root, flange, [link.get("name", "") for link in root.findall("link")])
    above = {_end(joint, "child"): joint for joint in root.findall("joint")}
    joints, links = list[ET.Element](), [flange]
    while links[-1] in above and above[links[-1]] not in joints:
        joints.append(above[links[-1]])
        links.append(_end(joints[-1], "parent"))
    root[:] = [each for each in root if each in joints or (each.tag == "link" and each.get("name") in links)]


def _refuse_loops(root: ET.Element, joints: list[ET.Element]) -> None:
    above: dict[str, str] = {}
    for joint in joints:
        link = _end(joint, "child")
        if link in above:
            raise RobotModelError(
                f"{title(joint)}: link {link!r} has two parent joints; closed loops are not supported"
            )
        if link:
            above[link] = _end(joint, "parent")
    for link in above:
        at, steps = link, 0
        while at in above and steps <= len(above):
            at, steps = above[at], steps + 1
        if steps > len(above):
            raise RobotModelError(f"{title(root)}: link {link!r} is its own ancestor through its joints")


def _end(joint: ET.Element, end: str) -> str:
    part = joint.find(end)
    return "" if part is None else part.get("link", "")


def _joint(joint: ET.Element) -> ET.Element:
    """Return the kinematics of a joint."""
    kind, name = joint.get("type", ""), f"joint {one_line(joint.get('name', ''))!r}"
    found = ET.Element("joint", {"name": joint.get("name", ""), "type": kind})
    for part in joint:
        if kind == "fixed" and part.tag in ("axis", "limit"):
            continue
        if part.tag not in PARTS:
            if close := nearest(part.tag.lower(), PARTS):
                raise RobotModelError(f"{title(part)} in {name} is unknown{close}")
            continue
        if part.tag == "mimic":
            raise RobotModelError(
                f"{title(joint)}: it mimics another joint; only arms with a drive on every joint are read; {NAME_IT}"
            )
        if found.find(part.tag) is not None:
            raise RobotModelError(f"{where(part)}: {name} has a second {part.tag}")
        check_attributes(part, PARTS[part.tag])
        if part.tag == "axis" and "xyz" not in part.attrib:
            raise RobotModelError(f"{title(part)}: xyz is missing")
        stated = {key: value for key, value in part.attrib.items() if key in PARTS[part.tag]}
        if part.tag == "limit":
            stated |= {"effort": "0", "velocity": "0"}  # required by the reader but not used
            _refuse_degrees(part, kind)
        ET.SubElement(found, part.tag, stated)
    return found


def _refuse_degrees(limit: ET.Element, kind: str) -> None:
    for key in ("lower", "upper"):
        try:
            value = float(limit.get(key, "0"))
        except ValueError:  # Pinocchio's reader names it
            continue
        if kind == "revolute" and FARTHEST_TURN < abs(value) <= ENDLESS:
            raise RobotModelError(
                f"{where(limit)}: limit: {key} = {shown(value)} rad is {abs(value) / math.tau:.2g} turns; a URDF is in "
                "radians, and a joint that turns without end is of type continuous"
            )
