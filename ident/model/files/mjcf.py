"""An MJCF file reduced to the bodies and joints of its arm, with includes, default classes and the flange resolved.

Pinocchio's reader of MJCF knows no includes, gravity, unnamed bodies or fixed Euler axes, ignores the orientation of a
base body without joint, reads invalid numbers as memory, and takes ends of a range relative to `ref`. The reduced file
has one root body, explicit joints, radians and quaternions; gravity and ranges are returned beside it. What MuJoCo
refuses and Pinocchio misreads is found by the comparison of both (`scenarios.experiments.robot_models`).

Many files contain a gripper, a second arm or objects. If the flange is named, joints outside the chain to it are locked
at their initial positions, and bodies behind them are ignored. Otherwise, only free-floating bodies are ignored.
"""

import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias
from xml.etree import ElementTree as ET

import numpy as np

from ident.model.files.xml_tree import DEEPEST, LARGEST_FILE, check_attributes, read_xml, title, vector, where
from ident.support.arrays import Array
from ident.support.errors import RobotModelError
from ident.support.naming import nearest, shown

NAME_IT = (
    "if it is not part of the arm, name the arm's last body as flange (in robot.toml, or --flange): joints outside the "
    "chain to it are locked"
)
"""Advice for a joint that a serial arm cannot have."""
EARTH = (0.0, 0.0, -9.81)
"""Gravity of a model that states none [m/s^2]."""
ORIENTATIONS = {"quat": 4, "axisangle": 4, "euler": 3, "xyaxes": 6, "zaxis": 3}
BODY = {"name": 0, "childclass": 0, "pos": 3, **ORIENTATIONS}
JOINT = {"name": 0, "class": 0, "type": 0, "limited": 0, "axis": 3, "pos": 3, "range": 2, "ref": 1}
"""Attributes that decide the kinematics, with how many numbers each has."""
JOINTS = ("joint", "freejoint")
MANIFOLD = ("frame", "replicate", "composite", "flexcomp", "attach")
"""Elements that MuJoCo expands to bodies and Pinocchio ignores."""
ENDS = {"joint": ("joint1", "joint2"), "tendon": ("tendon1", "tendon2")}
"""Objects that an equality constrains, by kind; others constrain two bodies or two sites."""
INERTIA = {"pos": "0 0 0", "mass": "1", "diaginertia": "1 1 1"}
"""Not used, but required by readers."""
Quaternion: TypeAlias = tuple[float, Array]
"""A quaternion, scalar and vector part; importing `scipy.spatial` would take 0.1 s."""


@dataclass(frozen=True, slots=True)
class MinimalModel:
    """A robot model reduced to its kinematics: links and joints, with checked numbers.

    Attributes:
        kind: The format of `text`, "mjcf" or "urdf".
        text: A complete document of that format.
        gravity: Gravity in the world frame [m/s^2].
        ranges: Ends of joints by their names [rad or m], where Pinocchio would read others.
    """

    kind: str
    text: str
    gravity: tuple[float, ...] = EARTH
    ranges: dict[str, tuple[float, float]] = field(default_factory=lambda: dict[str, tuple[float, float]]())


@dataclass(frozen=True, slots=True)
class _Reading:
    """Context and results of the traversal of bodies.

    Attributes:
        classes: Elements that state attributes of joints by default class, outer ones first.
        degree: Whether angles are in degrees.
        sequence: Axes of Euler angles, lower case for axes that turn with the body, upper case for fixed ones.
        autolimits: Whether a range without `limited` limits a joint.
        seen: Bodies and joints by kind and name.
        ranges: Ends of the joints that have any [rad or m].
    """

    classes: dict[str, list[ET.Element]]
    degree: bool
    sequence: str
    autolimits: bool
    seen: dict[tuple[str, str], ET.Element] = field(default_factory=lambda: dict[tuple[str, str], ET.Element]())
    ranges: dict[str, tuple[float, float]] = field(default_factory=lambda: dict[str, tuple[float, float]]())


def minimal_mjcf(root: ET.Element, path: Path, flange: str | None = None) -> MinimalModel:
    """Reduce an MJCF file with its includes, to the chain to a flange if named; changes `root`.

    Raises:
        RobotModelError: If a number, name or class is wrong or not supported; the message names line and element.
    """
    if root.tag != "mujoco":
        raise RobotModelError(
            f"{where(root)}: the root element is {root.tag}, expected mujoco; URDF files end in .urdf"
        )
    _expand(root, path.parent, {path.resolve(): path.stat().st_size}, DEEPEST)
    reading = _reading(root)
    _cut(root, flange)
    bodies = [_body(body, "main", reading) for world in root.findall("worldbody") for body in _bodies(world)]
    around = "world root"
    while ("body", around) in reading.seen:  # an already reduced file has one
        around = f"around {around}"
    gravity = EARTH
    for option in root.findall("option"):
        gravity = vector(option, "gravity", 3) or gravity
        if any(flag.get("gravity", "enable") != "enable" for flag in option.findall("flag")):
            gravity = (0.0, 0.0, 0.0)
    arm = ET.Element("mujoco", {"model": root.get("model", path.stem)})
    ET.SubElement(arm, "compiler", {"angle": "radian"})
    ET.SubElement(arm, "option", {"gravity": " ".join(map(repr, gravity))})
    ET.SubElement(ET.SubElement(arm, "worldbody"), "body", {"name": around}).extend(bodies)
    return MinimalModel("mjcf", ET.tostring(arm, encoding="unicode"), gravity, reading.ranges)


def _expand(parent: ET.Element, folder: Path, sizes: dict[Path, int], room: int) -> None:
    """Replace every `<include file="..."/>` by the children of the file's root element.

    Args:
        parent: An element, changed in place.
        folder: Folder of the main file, the base of names.
        sizes: Files read so far [bytes].
        room: Number of further nesting levels.
    """
    children = list(parent)
    parent[:] = []
    for child in children:
        if room <= 1:
            raise RobotModelError(
                f"{where(child)}: elements, including those of included files, are nested deeper than {DEEPEST}"
            )
        found = _included(child, folder, sizes) if child.tag == "include" else child
        _expand(found, folder, sizes, room - 1)
        parent.extend([found] if found is child else found)


def _included(include: ET.Element, folder: Path, sizes: dict[Path, int]) -> ET.Element:
    name = include.get("file", "")
    if not name:
        raise RobotModelError(f"{where(include)}: include lacks the attribute file")
    path = folder / name
    if path.resolve() in sizes:
        raise RobotModelError(f"{where(include)}: include file = {shown(name)} is included a second time")
    try:
        content = read_xml(path)
    except RobotModelError as error:
        raise RobotModelError(f"{where(include)}: include: {error}") from error
    sizes[path.resolve()] = path.stat().st_size
    if sum(sizes.values()) > LARGEST_FILE:
        raise RobotModelError(f"{where(include)}: more than {LARGEST_FILE / 1e6:g} MB are included")
    return content


def _reading(root: ET.Element) -> _Reading:
    """Return the content of compiler and default sections."""
    compiler = {k: v for section in root.findall("compiler") for k, v in section.attrib.items()}
    for key, default, pattern, expected in (
        ("angle", "degree", "degree|radian", "degree or radian"),
        ("coordinate", "local", "local", "local"),
        ("eulerseq", "xyz", "[xyz]{3}|[XYZ]{3}", "three of x, y, z, all lower or all upper case"),
    ):
        if not re.fullmatch(pattern, compiler.setdefault(key, default)):
            raise RobotModelError(f"{title(root)}: compiler {key} = {shown(compiler[key])}; expected {expected}")
    classes: dict[str, list[ET.Element]] = {"main": []}

    def add(section: ET.Element, name: str) -> None:
        classes[name] += section.findall("joint")
        for inner in section.findall("default"):
            own = inner.get("class", "")
            classes[own] = list(classes[name])
            add(inner, own)

    for section in root.findall("default"):
        add(section, "main")
    autolimits = compiler.get("autolimits", "true") == "true"
    return _Reading(classes, compiler["angle"] == "degree", compiler["eulerseq"], autolimits)


def _cut(root: ET.Element, flange: str | None) -> None:
    """Remove bodies outside the chain to a flange, or free-floating objects; refuse constraints of moving joints."""
    worlds = root.findall("worldbody")
    parent = {child: each for each in root.iter() for child in each}
    places = [each for world in worlds for each in world.iter() if each.tag in ("body", "site")]
    if flange is not None:
        known = [each.get("name", "") for each in places if each.tag == "body"]
        refuse_unknown_flange(root, flange, known)
    for world in worlds:
        for child in list(world):
            outside = _is_object(child) if flange is None else not _leads(child, flange)
            if outside and child.tag in ("body", *MANIFOLD):
                world.remove(child)
    joints = [each for world in worlds for each in world.iter() if each.tag in JOINTS]
    moved = {("body", "world"): 0}  # number of moving joints between the world and each body or site
    for place in places:
        above = [place]
        while above[-1] in parent:
            above.append(parent[above[-1]])
        moved[place.tag, place.get("name", "")] = sum(parent[joint] in above for joint in joints)
    names = {each.get("name", "") for each in joints}
    for section in root.findall("equality"):
        for tie in section:
            held = flange is not None and _is_held(tie, root, names, moved)
            if tie.tag in ("connect", "weld", *ENDS) and tie.get("active", "true") != "false" and not held:
                raise RobotModelError(
                    f"{title(tie)}: an equality of kind {tie.tag} ties joints; only arms with a drive on every joint "
                    f"and no closed loop are read; {NAME_IT}"
                )


def refuse_unknown_flange(root: ET.Element, flange: str, known: list[str]) -> None:
    """Refuse a flange that is not among the known names."""
    if flange not in known:
        raise RobotModelError(f"{title(root)}: flange {shown(flange)}: no body has that name{nearest(flange, known)}")


def _is_object(body: ET.Element) -> bool:
    """Return whether a body has a free joint and no other moving part."""
    free = [j for j in body if j.tag == "freejoint" or (j.tag == "joint" and j.get("type") == "free")]
    return bool(free) and sum(e.tag in JOINTS for e in body.iter()) == len(free)


def _leads(element: ET.Element, flange: str) -> bool:
    """Return whether an element is, or contains, the flange; remove bodies in it that do not."""
    leads = element.tag == "body" and element.get("name") == flange
    for child in [each for each in element if each.tag in ("body", *MANIFOLD)]:
        if _leads(child, flange):
            leads = True
        else:
            element.remove(child)
    return leads


def _is_held(tie: ET.Element, root: ET.Element, joints: set[str], moved: dict[tuple[str, str], int]) -> bool:
    """Return whether an equality constrains only locked joints, or bodies without relative motion."""
    ends = [tie.attrib[key] for key in ENDS.get(tie.tag, ()) if key in tie.attrib]
    if tie.tag == "joint":
        return joints.isdisjoint(ends)
    if tie.tag == "tendon":
        fixed = [tendon for tendon in root.findall("tendon/fixed") if tendon.get("name") in ends]
        used = {joint.get("joint", "") for tendon in fixed for joint in tendon.findall("joint")}
        return len(fixed) == len(set(ends)) and joints.isdisjoint(used)
    kind = "body" if "body1" in tie.attrib else "site"
    first, second = (moved.get((kind, tie.get(f"{kind}{number}", "world"))) for number in (1, 2))
    return first is not None and first == second


def _bodies(parent: ET.Element) -> list[ET.Element]:
    """Return the bodies in an element; refuse elements that expand to bodies."""
    for child in parent:
        moves = any(each.tag in ("body", *JOINTS) for each in child.iter())
        if child.tag in MANIFOLD and (moves or child.tag not in ("frame", "replicate")):
            raise RobotModelError(
                f"{title(child)}: {child.tag} is not supported; save the model with MuJoCo (mj_saveLastXML), which "
                "expands it, and use that file"
            )
    return parent.findall("body")


def _body(body: ET.Element, inherited: str, reading: _Reading) -> ET.Element:
    """Return a body with its place, an orientation that Pinocchio reads, its joint and its bodies."""
    stated = {"name": _named(body, "body", f"body {len(reading.seen) + 1}", reading)}
    check_attributes(body, BODY)
    if "pos" in body.attrib:
        stated["pos"] = body.attrib["pos"]
    found = ET.Element("body", stated | _orientation(body, reading))
    ET.SubElement(found, "inertial", INERTIA)
    inherited = body.get("childclass", inherited)
    joints = [each for each in body if each.tag in JOINTS]
    if len(joints) > 1:
        raise RobotModelError(
            f"{title(joints[1])}: a second joint in one body; put it in a separate body around this one"
        )
    found.extend([_joint(joint, inherited, reading) for joint in joints])
    found.extend([_body(inner, inherited, reading) for inner in _bodies(body)])
    return found


def _named(element: ET.Element, kind: str, default: str, reading: _Reading) -> str:
    name = element.get("name", default)
    if (kind, name) in reading.seen:
        line = where(reading.seen[kind, name]).split(": ")[-1]
        raise RobotModelError(f"{title(element)} appears twice; the first one is in {line}")
    reading.seen[kind, name] = element
    return name


def _orientation(body: ET.Element, reading: _Reading) -> dict[str, str]:
    stated = [key for key in ORIENTATIONS if key in body.attrib]
    if not stated or stated[0] not in ("euler", "axisangle"):
        return {key: body.attrib[key] for key in stated}
    values = np.array([float(word) for word in body.attrib[stated[0]].split()])
    angles = np.deg2rad(values) if reading.degree else values
    turned: Quaternion = (1.0, np.zeros(3))
    if stated[0] == "euler":
        for name, angle in zip(reading.sequence, angles.tolist(), strict=True):
            step = _about(np.eye(3)["xyz".index(name.lower())], angle)
            turned = _then(turned, step) if name.islower() else _then(step, turned)  # upper case: fixed axes
    elif not (length := float(np.linalg.norm(values[:3]))):
        raise RobotModelError(f"{title(body)}: axisangle has no direction")
    else:
        turned = _about(values[:3] / length, float(angles[3]))
    return {"quat": " ".join(repr(float(x)) for x in (turned[0], *turned[1]))}


def _about(axis: Array, angle: float) -> Quaternion:
    """Return a rotation about a unit axis."""
    return math.cos(0.5 * angle), math.sin(0.5 * angle) * axis


def _then(first: Quaternion, second: Quaternion) -> Quaternion:
    """Return a rotation followed by another one about the rotated axes."""
    (w, u), (x, v) = first, second
    return w * x - float(u @ v), w * v + x * u + np.cross(u, v)


def _joint(joint: ET.Element, inherited: str, reading: _Reading) -> ET.Element:
    """Return a joint with all used attributes explicit, in radians or metres."""
    number = sum(kind == "joint" for kind, _ in reading.seen) + 1
    name, of_class = _named(joint, "joint", f"joint{number}", reading), joint.get("class", inherited)
    if of_class not in reading.classes:
        known = nearest(of_class, reading.classes)
        raise RobotModelError(f"{title(joint)}: unknown default class {shown(of_class)}{known}")
    stated: dict[str, str] = {"type": "hinge"}
    for element in (*reading.classes[of_class], joint):
        check_attributes(element, JOINT)
        stated |= {key: value for key, value in element.attrib.items() if key in JOINT}
    stated["name"] = name
    kind = "free" if joint.tag == "freejoint" else stated["type"]
    if kind not in ("hinge", "slide"):
        raise RobotModelError(f"{title(joint)}: type {shown(kind)} is not supported, only hinge and slide joints are")
    scale = math.radians(1.0) if reading.degree and kind == "hinge" else 1.0
    limited = stated.pop("limited", "auto")
    stated.pop("class", None)
    if "ref" in stated:
        stated["ref"] = repr(scale * float(stated["ref"]))
    if "range" in stated and (limited == "true" or (limited == "auto" and reading.autolimits)):
        lower, upper = (scale * float(end) for end in stated["range"].split())
        stated["range"], reading.ranges[name] = f"{lower!r} {upper!r}", (lower, upper)
    else:
        stated.pop("range", None)
    return ET.Element("joint", stated)
