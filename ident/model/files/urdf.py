"""Reduction of a URDF to links and joints, with all numbers and the tree checked."""

import math
from pathlib import Path

from ident.model.files.chain import NAME_IT, urdf_to_flange
from ident.model.files.xml_tree import FARTHEST, Element, MinimalModel, direction, tag, vector
from ident.support.errors import RobotModelError
from ident.support.naming import nearest, one_line, shown

MOVING = ("revolute", "continuous", "prismatic")
MOST_LINKS = 1000
"""Largest number of links, as the readers are recursive."""
FARTHEST_TURN, ENDLESS = 4.0 * math.pi, 1000.0
"""Limits of a revolute joint between these values [rad] are probably in degrees; larger ones mean no limit."""
PARTS = {
    "parent": ("link",),
    "child": ("link",),
    "origin": ("xyz", "rpy"),
    "axis": ("xyz",),
    "limit": ("lower", "upper"),
    "mimic": (),
}
"""Kinematic elements of a joint and their attributes; a misspelt attribute would leave a default."""


def minimal_urdf(root: Element, path: Path, flange: str | None = None) -> MinimalModel:
    """Reduce a URDF, to the chain to a flange if named.

    Raises:
        RobotModelError: If a number, name, type or the tree of links is wrong; the message names line and element.
    """
    if root.tag != "robot":
        raise RobotModelError(
            f"{root.where}: the root element is {root.tag}, expected robot; MJCF files end in .xml or .mjcf"
        )
    if flange is not None:
        root = urdf_to_flange(root, flange)
    links, joints = _by_name(root.all("link")), _by_name(root.all("joint"))
    if not 0 < len(links) <= MOST_LINKS:
        raise RobotModelError(f"{root.title}: {len(links)} links, expected 1 to {MOST_LINKS}")
    inside = [_joint(joint, links) for joint in joints.values()]
    _check_tree(root, links, joints)
    name = root.attributes.get("name") or path.stem
    return MinimalModel("urdf", tag("robot", {"name": name}, *(tag("link", {"name": k}) for k in links), *inside))


def _by_name(elements: list[Element]) -> dict[str, Element]:
    found: dict[str, Element] = {}
    for element in elements:
        name = element.attributes.get("name", "")
        if not name.strip():
            raise RobotModelError(f"{element.where}: a {element.tag} without a name")
        if name in found:
            raise RobotModelError(f"{element.title} appears twice; the first one is in {found[name].line}")
        found[name] = element
    return found


def _joint(joint: Element, links: dict[str, Element]) -> str:
    kind, known = joint.attributes.get("type", ""), (*MOVING, "fixed")
    if kind in ("floating", "planar"):
        raise RobotModelError(
            f"{joint.title}: type {kind!r} is not supported; only fixed-base arms of revolute and prismatic joints are"
        )
    if kind not in known:
        raise RobotModelError(
            f"{joint.title}: type {shown(joint.attributes.get('type'))} is unknown{nearest(kind, known)}; "
            f"known: {', '.join(known)}"
        )
    parts = _parts(joint)
    if "mimic" in parts:
        raise RobotModelError(
            f"{joint.title}: it mimics another joint; only arms with a drive on every joint are read; {NAME_IT}"
        )
    for end in ("parent", "child"):
        link = parts[end].attributes.get("link", "") if end in parts else ""
        if link not in links:
            raise RobotModelError(f"{joint.title}: its {end} link {shown(link)} does not exist{nearest(link, links)}")
    unread = ("limit", "axis") if kind == "fixed" else ("limit",)
    inside = [tag(e.tag, _checked(e)) for e in parts.values() if e.tag not in unread]
    if kind in ("revolute", "prismatic"):
        inside.append(tag("limit", _limit(joint, parts.get("limit"), turns=kind == "revolute")))
    return tag("joint", {"name": joint.attributes["name"], "type": kind}, *inside)


def _parts(joint: Element) -> dict[str, Element]:
    """Return the kinematic elements of a joint, one of each."""
    parts: dict[str, Element] = {}
    name = f"joint {one_line(joint.attributes['name'])!r}"
    for element in joint.children:
        if element.tag in parts:
            raise RobotModelError(f"{element.where}: {name} has a second {element.tag}")
        if element.tag in PARTS:
            parts[element.tag] = element
        elif close := nearest(element.tag.lower(), PARTS):
            raise RobotModelError(f"{element.title} in {name} is unknown{close}")
    return parts


def _checked(part: Element) -> dict[str, str]:
    known = PARTS[part.tag]
    for attribute in part.attributes:
        if attribute not in known:
            raise RobotModelError(
                f"{part.title}: unknown attribute {shown(attribute)}{nearest(attribute, known)}; "
                f"known: {', '.join(known)}"
            )
    if part.tag == "axis":
        if "xyz" not in part.attributes:
            raise RobotModelError(f"{part.title}: xyz is missing")
        direction(part, "xyz")
    if part.tag == "origin":
        vector(part, "xyz", 3, largest=FARTHEST)
        vector(part, "rpy", 3)
    return part.attributes


def _limit(joint: Element, limit: Element | None, *, turns: bool) -> dict[str, str]:
    """Return limits; effort and velocity are required by the reader but not used."""
    if limit is None:
        raise RobotModelError(f"{joint.title}: limit is missing; a joint without limits is of type continuous")
    ends = {key: (vector(limit, key, 1, largest=1e300) or (0.0,))[0] for key in PARTS["limit"]}
    for key, value in ends.items():
        if turns and FARTHEST_TURN < abs(value) <= ENDLESS:
            raise RobotModelError(
                f"{limit.where}: limit: {key} = {value:g} rad is {abs(value) / math.tau:.2g} turns; a URDF is in "
                "radians, and a joint that turns without end is of type continuous"
            )
    if ends["lower"] > ends["upper"]:
        raise RobotModelError(f"{joint.title}: its range is reversed: from {ends['lower']:g} to {ends['upper']:g}")
    return {key: repr(value) for key, value in ends.items()} | {"effort": "0", "velocity": "0"}


def _check_tree(root: Element, links: dict[str, Element], joints: dict[str, Element]) -> None:
    """Check that every link but the base has exactly one parent joint."""
    parent_of: dict[str, str] = {}
    for joint in joints.values():
        parent, child = (joint.all(end)[0].attributes["link"] for end in ("parent", "child"))
        if child in parent_of:
            raise RobotModelError(
                f"{joint.title}: link {child!r} has two parent joints; closed loops are not supported"
            )
        parent_of[child] = parent
    bases = [link for link in links if link not in parent_of]
    if len(bases) != 1:
        names = ", ".join(one_line(base) for base in bases[:5]) or "none"
        raise RobotModelError(f"{root.title}: expected one base link without a parent joint, found {names}")
    for link in links:
        above = [link]
        while above[-1] in parent_of:
            above.append(parent_of[above[-1]])
            if len(above) > len(links):
                raise RobotModelError(f"{links[link].title} is its own ancestor through its joints")
