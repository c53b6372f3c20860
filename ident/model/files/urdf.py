"""A URDF reduced to links and joints, every number checked with its line, the tree checked before a reader sees it."""

import math
from pathlib import Path

from ident.model.files.chain import NAME_IT, urdf_to_flange
from ident.model.files.minimal import MinimalModel, tag
from ident.model.files.numbers import FARTHEST, direction, vector
from ident.model.files.xml_tree import Element
from ident.support.errors import RobotModelError
from ident.support.naming import nearest, one_line, shown

MOVING = ("revolute", "continuous", "prismatic")
MOST_LINKS = 1000
"""Links of a robot; the readers behind recurse."""
FARTHEST_TURN, ENDLESS = 4.0 * math.pi, 1000.0
"""Ends of a turning joint between these are degrees [rad]: cables of arms bear two turns each way at most, and larger
numbers stand in some files for a joint without ends."""
OTHER = ("fixed", "floating", "planar")
PARTS = ("parent", "child", "origin", "axis", "limit", "mimic")
"""Elements of a joint that decide its kinematics."""
KNOWN = {"origin": ("xyz", "rpy"), "axis": ("xyz",), "parent": ("link",), "child": ("link",)}
"""Their attributes, where no others may stand: a misspelt one would leave a default in silence."""


def minimal_urdf(root: Element, path: Path, flange: str | None = None) -> MinimalModel:
    """Reduce a URDF, to what leads to a flange where one is named.

    Raises:
        RobotModelError: Naming line and element, if a number, name, type or the tree of links is wrong.
    """
    if root.tag != "robot":
        raise RobotModelError(f"{root.where}: {root.tag} is no <robot>; MJCF files end in .xml or .mjcf")
    scripted = next((e for e in root.children if e.tag.startswith("xacro:")), None)
    if scripted is not None:
        raise RobotModelError(f"{scripted.where}: {scripted.tag}: run xacro first, and give what it writes")
    if flange is not None:
        root = urdf_to_flange(root, flange)
    links, joints = _unique(root.all("link")), _unique(root.all("joint"))
    if not 0 < len(links) <= MOST_LINKS:
        raise RobotModelError(f"{root.title}: {len(links)} links, expected 1 to {MOST_LINKS}")
    inside = [_joint(joint, links) for joint in joints.values()]
    _check_tree(root, links, joints)
    name = root.attributes.get("name") or path.stem
    return MinimalModel("urdf", tag("robot", {"name": name}, *(tag("link", {"name": k}) for k in links), *inside))


def _unique(elements: list[Element]) -> dict[str, Element]:
    """Elements by their names."""
    found: dict[str, Element] = {}
    for element in elements:
        name = element.attributes.get("name", "")
        if not name.strip():
            raise RobotModelError(f"{element.where}: a {element.tag} without a name")
        if name in found:
            raise RobotModelError(f"{element.title} is there twice; the first one is in {_line(found[name])}")
        found[name] = element
    return found


def _joint(joint: Element, links: dict[str, Element]) -> str:
    kind = joint.attributes.get("type")
    if kind not in (*MOVING, *OTHER):
        known = (*MOVING, "fixed")
        raise RobotModelError(
            f"{joint.title}: type {shown(kind)} is unknown{nearest(kind or '', known)}; known: {', '.join(known)}"
        )
    if kind in OTHER[1:]:
        raise RobotModelError(
            f"{joint.title}: type {kind!r} is not supported; only fixed-base arms of revolute and prismatic joints are"
        )
    parts = _parts(joint)
    if "mimic" in parts:
        raise RobotModelError(
            f"{joint.title}: it mimics another joint; only arms with a drive on every joint are read; {NAME_IT}"
        )
    for end in ("parent", "child"):
        link = parts[end].attributes.get("link", "") if end in parts else ""
        if link not in links:
            raise RobotModelError(f"{joint.title}: its {end} link {shown(link)} is not there{nearest(link, links)}")
    unread = ("limit", "axis") if kind == "fixed" else ("limit",)
    inside = [tag(e.tag, _checked(e)) for e in parts.values() if e.tag not in unread]
    if kind in ("revolute", "prismatic"):
        inside.append(tag("limit", _limit(joint, parts.get("limit"))))
    return tag("joint", {"name": joint.attributes["name"], "type": kind}, *inside)


def _parts(joint: Element) -> dict[str, Element]:
    """The elements of a joint that decide its kinematics, one of each."""
    parts: dict[str, Element] = {}
    for element in joint.children:
        if element.tag not in PARTS:
            if close := nearest(element.tag.lower(), PARTS):
                raise RobotModelError(f"{element.title} in {joint.title.split(': ')[-1]} is unknown{close}")
            continue
        if element.tag in parts:
            raise RobotModelError(f"{element.where}: {element.tag}: there twice in {joint.title.split(': ')[-1]}")
        parts[element.tag] = element
    return parts


def _checked(part: Element) -> dict[str, str]:
    known = KNOWN[part.tag]
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


def _limit(joint: Element, limit: Element | None) -> dict[str, str]:
    """Limits; effort and velocity are stated for the reader, which wants them, and not used."""
    if limit is None:
        raise RobotModelError(f"{joint.title}: limit is missing; a joint without limits is of type continuous")
    lower, upper = (vector(limit, key, 1, largest=float("1e300")) or (0.0,) for key in ("lower", "upper"))
    for key, (value,) in (("lower", lower), ("upper", upper)):
        if joint.attributes.get("type") == "revolute" and FARTHEST_TURN < abs(value) <= ENDLESS:
            raise RobotModelError(
                f"{limit.where}: limit: {key} = {value:g} rad is {abs(value) / math.tau:.2g} turns; a URDF is in "
                "radians, and a joint that turns without end is of type continuous"
            )
    if lower > upper:
        raise RobotModelError(f"{limit.where}: limit: lower = {lower[0]:g} is above upper = {upper[0]:g}")
    return {"lower": f"{lower[0]!r}", "upper": f"{upper[0]!r}", "effort": "0", "velocity": "0"}


def _check_tree(root: Element, links: dict[str, Element], joints: dict[str, Element]) -> None:
    """Every link hangs on one joint, all but one base."""
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
        above = link
        for _ in range(len(links)):
            if above not in parent_of:
                break
            above = parent_of[above]
        else:
            raise RobotModelError(f"{links[link].title} is its own ancestor through its joints")


def _line(element: Element) -> str:
    return element.where.split(": ")[-1]
