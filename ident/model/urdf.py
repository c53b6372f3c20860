"""A URDF reduced to the links and joints of its arm, up to the flange.

Pinocchio's reader checks a URDF; what it ignores is checked here.
"""

import math
from pathlib import Path
from xml.etree import ElementTree as ET

from ident.model.mjcf import MinimalModel, refuse_unknown_flange
from ident.model.xml_tree import check_attributes, title, where
from ident.support.errors import RobotModelError
from ident.support.naming import nearest, one_line, shown

MOST_LINKS = 1000
"""Largest number of links of a URDF, as the readers are recursive."""
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
"""Kinematic elements of a joint of a URDF with their attributes; a misspelt one would leave a default."""
MASSES = {
    "origin": {"xyz": 3, "rpy": 3},
    "mass": {"value": 1},
    "inertia": {"ixx": 1, "ixy": 1, "ixz": 1, "iyy": 1, "iyz": 1, "izz": 1},
}
"""Elements of an inertial of a link of a URDF with their attributes."""


def minimal_urdf(root: ET.Element, path: Path, flange: str | None = None) -> MinimalModel:
    """Reduce a URDF, to the chain to a flange if named; changes `root`. Messages of `RobotModelError` name the line."""
    if flange is not None:
        urdf_to_flange(root, flange)
    links, joints = root.findall("link"), root.findall("joint")
    if not 0 < len(links) <= MOST_LINKS:
        raise RobotModelError(f"{title(root)}: {len(links)} links, expected 1 to {MOST_LINKS}")
    for part in (each for link in links for each in link.iterfind("inertial/*")):
        if part.tag in MASSES:
            check_attributes(part, MASSES[part.tag])
        elif close := nearest(part.tag.lower(), MASSES):
            raise RobotModelError(f"{title(part)} in an inertial is unknown{close}")
    arm = ET.Element("robot", {"name": root.get("name") or path.stem})
    arm.extend([ET.Element("link", {"name": link.get("name", "")}) for link in links])
    arm.extend([_joint(joint) for joint in joints])
    above: dict[str, str] = {}
    for joint in joints:
        link = _end(joint, "child")
        if link in above:
            raise RobotModelError(
                f"{title(joint)}: link {link!r} has two parent joints; closed loops are not supported"
            )
        if link:
            above[link] = _end(joint, "parent")
    while ends := [link for link in above if above[link] not in above]:
        for link in ends:
            del above[link]
    if above:
        raise RobotModelError(f"{title(root)}: link {next(iter(above))!r} is its own ancestor through its joints")
    names, shared = {joint.get("name") for joint in joints}, dict[str, dict[str, float]]()
    for each in root.findall("transmission"):  # ratios are not read: as a difference, which is refused
        own = [name for part in each.findall("joint") if (name := part.get("name", "")) in names]
        shared |= {title(each): {name: float(k) for k, name in enumerate(own)}} if len(own) > 1 else {}
    return MinimalModel("urdf", ET.tostring(arm, encoding="unicode"), shared=shared)


def urdf_to_flange(root: ET.Element, flange: str) -> None:
    """Remove links and joints outside the chain from the base to a flange; raises `RobotModelError` without one."""
    refuse_unknown_flange(root, flange, [link.get("name", "") for link in root.findall("link")])
    above = {_end(joint, "child"): joint for joint in root.findall("joint")}
    joints, links = list[ET.Element](), [flange]
    while links[-1] in above and above[links[-1]] not in joints:
        joints.append(above[links[-1]])
        links.append(_end(joints[-1], "parent"))
    kept = [each for each in root if each.tag == "transmission" or each in joints]
    root[:] = kept + [each for each in root if each.tag == "link" and each.get("name") in links]


def _end(joint: ET.Element, end: str) -> str:
    part = joint.find(end)
    return "" if part is None else part.get("link", "")


def _joint(joint: ET.Element) -> ET.Element:
    """Return the kinematics of a joint of a URDF."""
    kind, name = joint.get("type", ""), f"joint {one_line(joint.get('name', ''))!r}"
    if not joint.get("name"):
        raise RobotModelError(f"{where(joint)}: a joint without a name")
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
                f"{title(joint)}: it mimics another joint; only arms with a drive on every joint are read; if it is a "
                f"gripper's, the arm ends before it: --flange {_end(joint, 'parent')}, or flange in robot.toml"
            )
        if found.find(part.tag) is not None:
            raise RobotModelError(f"{where(part)}: {name} has a second {part.tag}")
        check_attributes(part, PARTS[part.tag])
        if part.tag == "axis" and "xyz" not in part.attrib:
            raise RobotModelError(f"{title(part)}: xyz is missing")
        stated = {key: value for key, value in part.attrib.items() if key in PARTS[part.tag]}
        if part.tag == "limit":
            stated |= {"effort": "0", "velocity": "0"}  # required by the reader but not used
            for key in ("lower", "upper") if kind == "revolute" else ():
                try:
                    value = abs(float(part.get(key, "0")))
                except ValueError:  # Pinocchio's reader names it
                    continue
                if FARTHEST_TURN < value <= ENDLESS:
                    raise RobotModelError(
                        f"{where(part)}: limit: {key} = {shown(float(part.attrib[key]))} rad is "
                        f"{value / math.tau:.2g} turns; a URDF is in radians, and a joint that turns without end is of "
                        "type continuous"
                    )
        ET.SubElement(found, part.tag, stated)
    return found
