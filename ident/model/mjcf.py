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
from xml.etree import ElementTree as ET

import numpy as np

from ident.model.xml_tree import DEEPEST, LARGEST_FILE, check_attributes, read_xml, title, vector, where
from ident.support.errors import RobotModelError, placed
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
COMPILER = {
    "angle": ("degree", "degree|radian", "degree or radian"),
    "coordinate": ("local", "local", "local"),
    "eulerseq": ("xyz", "[xyz]{3}|[XYZ]{3}", "three of x, y, z, all lower or all upper case"),
    "autolimits": ("true", ".*", "true or false"),
}
"""Options with their default, what is accepted, and how a message says so."""
MAIN = "main"
"""Outermost default class."""
JOINTS = ("joint", "freejoint")
MANIFOLD = ("frame", "replicate", "composite", "flexcomp", "attach")
"""Elements that MuJoCo expands to bodies and Pinocchio ignores."""
IN_BODY = ("body", "inertial", "geom", "site", "camera", "light", "plugin", *JOINTS, *MANIFOLD)
"""Elements of a body; a misspelt one would leave out a part of the arm."""
INERTIA = {"pos": "0 0 0", "mass": "1", "diaginertia": "1 1 1"}
"""Not used, but required by readers."""


@dataclass(frozen=True, slots=True)
class MinimalModel:
    """A robot model reduced to its kinematics: links and joints, with checked numbers.

    `ranges` are ends of joints by name [rad or m], where Pinocchio would read others; `shared` are joints that one
    motor moves, with ratios, by its place in the file.
    """

    kind: str  # the format of `text`, "mjcf" or "urdf"
    text: str  # a complete document of that format
    gravity: tuple[float, ...] = EARTH  # gravity in the world frame [m/s^2]
    ranges: dict[str, tuple[float, float]] = field(default_factory=dict[str, tuple[float, float]])
    shared: dict[str, dict[str, float]] = field(default_factory=dict[str, dict[str, float]])
    own: frozenset[str] = frozenset()  # joints with a motor that moves no other joint


def minimal_mjcf(root: ET.Element, path: Path, flange: str | None = None) -> MinimalModel:
    """Reduce an MJCF file, to the chain to a flange if named; changes `root`. `RobotModelError` names the line."""
    _expand(root, path.parent, {path.resolve(): path.stat().st_size}, DEEPEST)
    compiler = {key: value for section in root.findall("compiler") for key, value in section.attrib.items()}
    for key, (default, pattern, expected) in COMPILER.items():
        if not re.fullmatch(pattern, compiler.setdefault(key, default)):
            raise RobotModelError(f"{title(root)}: compiler {key} = {shown(compiler[key])}; expected {expected}")
    _cut(root, flange)
    reading = _Reading(compiler, default_classes(root))
    bodies = [reading.body(body, MAIN) for world in root.findall("worldbody") for body in _bodies(world)]
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
    return MinimalModel("mjcf", ET.tostring(arm, encoding="unicode"), gravity, reading.ranges, *_motors(root, arm))


def _motors(root: ET.Element, arm: ET.Element) -> tuple[dict[str, dict[str, float]], frozenset[str]]:
    """Return the arm's joints that one motor moves together by a fixed tendon, with ratios, and those with their own.

    Actuators on one tendon, such as a position and a velocity servo, are one motor.
    """
    joints = {each.get("name", "") for each in arm.iter("joint")}
    tendons = {each.get("name"): each for each in root.findall("tendon/fixed")}
    shared, alone, seen = dict[str, dict[str, float]](), set[str](), set[str]()
    for motor in (each for section in root.findall("actuator") for each in section):
        ratios, name = {motor.get("joint", motor.get("jointinparent", "")): 1.0}, motor.get("tendon", "")
        if name in tendons:
            ends = tendons[name].findall("joint")
            ratios = {each.get("joint", ""): (vector(each, "coef", 1) or (1.0,))[0] for each in ends}
        ratios = {joint: ratio for joint, ratio in ratios.items() if ratio and joint in joints}
        if len(ratios) == 1:
            alone |= ratios.keys()
        elif ratios and name not in seen:
            shared[f"{title(motor)} on tendon {name!r}"] = ratios
            seen.add(name)
    return shared, frozenset(alone)


def _expand(parent: ET.Element, folder: Path, sizes: dict[Path, int], room: int) -> None:
    """Replace every `<include file="..."/>` by the children of the file's root; `sizes` are of files so far [bytes]."""
    children = list(parent)
    parent[:] = []
    for child in children:
        if room <= 1:
            raise RobotModelError(
                f"{where(child)}: elements, including those of included files, are nested deeper than {DEEPEST}"
            )
        found = child
        if child.tag == "include":
            name = child.get("file", "")
            if not name:
                raise RobotModelError(f"{where(child)}: include lacks the attribute file")
            path = folder / name
            if path.resolve() in sizes:
                raise RobotModelError(f"{where(child)}: include file = {shown(name)} is included a second time")
            with placed(f"{where(child)}: include"):
                found = read_xml(path)
            sizes[path.resolve()] = path.stat().st_size
            if sum(sizes.values()) > LARGEST_FILE:
                raise RobotModelError(f"{where(child)}: more than {LARGEST_FILE / 1e6:g} MB are included")
        _expand(found, folder, sizes, room - 1)
        parent.extend([child] if found is child else found)


def default_classes(root: ET.Element) -> dict[str, list[ET.Element]]:
    """Return the elements that state attributes of each default class, those of enclosing classes first."""
    classes: dict[str, list[ET.Element]] = {MAIN: []}

    def add(section: ET.Element, name: str) -> None:
        classes[name] += [each for each in section if each.tag != "default"]
        for inner in section.findall("default"):
            own = inner.get("class", "")
            classes[own] = list(classes[name])
            add(inner, own)

    for section in root.findall("default"):
        add(section, MAIN)
    return classes


def _cut(root: ET.Element, flange: str | None) -> None:
    """Remove bodies outside the chain to a flange, or free-floating objects; refuse constraints of moving joints."""
    worlds = root.findall("worldbody")
    parent = {child: each for each in root.iter() for child in each}
    places = [each for world in worlds for each in world.iter() if each.tag in ("body", "site")]

    def above(element: ET.Element) -> list[ET.Element]:
        chain = [element]
        while chain[-1] in parent:
            chain.append(parent[chain[-1]])
        return chain

    if flange is None:
        outside = [each for world in worlds for each in world if _is_object(each)]
    else:
        bodies = [each for each in places if each.tag == "body"]
        refuse_unknown_flange(root, flange, [each.get("name", "") for each in bodies])
        leading = {each for body in bodies if body.get("name") == flange for each in above(body)}
        every = [each for world in worlds for each in world.iter() if each.tag in ("body", *MANIFOLD)]
        outside = [each for each in every if each not in leading]
    for each in outside:
        parent[each].remove(each)
    joints = [each for world in worlds for each in world.iter() if each.tag in JOINTS]
    moving = {each.get("name", "") for each in joints}
    below = {("body", "world"): 0}  # number of moving joints between the world and each body or site
    for place in places:
        chain = above(place)
        below[place.tag, place.get("name", "")] = sum(parent[joint] in chain for joint in joints)
    tendons = {
        each.get("name", ""): {joint.get("joint", "") for joint in each.findall("joint")}
        for each in root.findall("tendon/fixed")
    }

    def locked(tie: ET.Element) -> bool:
        """Whether an equality constrains only locked joints, or bodies without relative motion."""
        ends = [tie.attrib[key] for key in (f"{tie.tag}1", f"{tie.tag}2") if key in tie.attrib]
        if tie.tag == "joint":
            return moving.isdisjoint(ends)
        if tie.tag == "tendon":
            return all(end in tendons and moving.isdisjoint(tendons[end]) for end in ends)
        kind = "body" if "body1" in tie.attrib else "site"
        first, second = (below.get((kind, tie.get(f"{kind}{number}", "world"))) for number in (1, 2))
        return first is not None and first == second

    for tie in [each for section in root.findall("equality") for each in section]:
        active = tie.tag in ("connect", "weld", "joint", "tendon") and tie.get("active", "true") != "false"
        if active and (flange is None or not locked(tie)):
            raise RobotModelError(
                f"{title(tie)}: an equality of kind {tie.tag} ties joints; only arms with a drive on every joint "
                f"and no closed loop are read; {NAME_IT}"
            )


def _is_object(body: ET.Element) -> bool:
    """Return whether a body has a free joint and no other moving part."""
    free = [each for each in body if each.tag == "freejoint" or (each.tag == "joint" and each.get("type") == "free")]
    return body.tag in ("body", *MANIFOLD) and bool(free) and sum(e.tag in JOINTS for e in body.iter()) == len(free)


def refuse_unknown_flange(root: ET.Element, flange: str, known: list[str]) -> None:
    """Refuse a flange that is not among the known names."""
    if flange not in known:
        raise RobotModelError(f"{title(root)}: flange {shown(flange)}: no body has that name{nearest(flange, known)}")


def _bodies(parent: ET.Element) -> list[ET.Element]:
    """Return the bodies in an element; refuse elements that expand to bodies."""
    for child in parent:
        if child.tag not in IN_BODY:
            raise RobotModelError(f"{title(child)}: unknown element{nearest(child.tag, IN_BODY)}")
        moves = any(each.tag in ("body", *JOINTS) for each in child.iter())
        if child.tag in MANIFOLD and (moves or child.tag not in ("frame", "replicate")):
            raise RobotModelError(
                f"{title(child)}: {child.tag} is not supported; save the model with MuJoCo (mj_saveLastXML), which "
                "expands it, and use that file"
            )
    return parent.findall("body")


class _Reading:
    """Bodies and joints with all used attributes explicit, in radians and metres."""

    def __init__(self, compiler: dict[str, str], classes: dict[str, list[ET.Element]]) -> None:
        self.compiler, self.classes = compiler, classes
        self.seen: dict[tuple[str, str], ET.Element] = {}
        self.ranges: dict[str, tuple[float, float]] = {}

    def name(self, element: ET.Element, kind: str, default: str) -> str:
        """Return the unique name of a body or joint."""
        name = element.get("name", default)
        if (kind, name) in self.seen:
            line = where(self.seen[kind, name]).split(": ")[-1]
            raise RobotModelError(f"{title(element)} appears twice; the first one is in {line}")
        self.seen[kind, name] = element
        return name

    def body(self, body: ET.Element, inherited: str) -> ET.Element:
        """Return a body with its place, an orientation that Pinocchio reads, its joint and its bodies."""
        stated = {"name": self.name(body, "body", f"body {len(self.seen) + 1}")}
        check_attributes(body, BODY)
        if "pos" in body.attrib:
            stated["pos"] = body.attrib["pos"]
        found = ET.Element("body", stated | self.orientation(body))
        ET.SubElement(found, "inertial", INERTIA)
        inherited = body.get("childclass", inherited)
        joints = [each for each in body if each.tag in JOINTS]
        if len(joints) > 1:
            raise RobotModelError(
                f"{title(joints[1])}: a second joint in one body; put it in a separate body around this one"
            )
        found.extend([self.joint(joint, inherited) for joint in joints])
        found.extend([self.body(inner, inherited) for inner in _bodies(body)])
        return found

    def orientation(self, body: ET.Element) -> dict[str, str]:
        """Return the orientation of a body, a quaternion for axes and angles; `scipy.spatial` would take 0.1 s."""
        stated = [key for key in ORIENTATIONS if key in body.attrib]
        if not stated or stated[0] not in ("euler", "axisangle"):
            return {key: body.attrib[key] for key in stated}
        values = np.array([float(word) for word in body.attrib[stated[0]].split()])
        angles = np.deg2rad(values) if self.compiler["angle"] == "degree" else values
        if stated[0] == "euler":
            sequence = self.compiler["eulerseq"]  # lower case: axes that turn with the body, upper case: fixed ones
            steps = [(np.eye(3)["xyz".index(k.lower())], x) for k, x in zip(sequence, angles.tolist(), strict=True)]
            steps = steps if sequence.islower() else steps[::-1]
        elif length := float(np.linalg.norm(values[:3])):
            steps = [(values[:3] / length, float(angles[3]))]
        else:
            raise RobotModelError(f"{title(body)}: axisangle has no direction")
        w, u = 1.0, np.zeros(3)
        for axis, angle in steps:
            x, v = math.cos(0.5 * angle), math.sin(0.5 * angle) * axis
            w, u = w * x - float(u @ v), w * v + x * u + np.cross(u, v)
        return {"quat": " ".join(repr(float(x)) for x in (w, *u))}

    def joint(self, joint: ET.Element, inherited: str) -> ET.Element:
        """Return a joint with the attributes of its default classes."""
        number = sum(kind == "joint" for kind, _ in self.seen) + 1
        name, of_class = self.name(joint, "joint", f"joint{number}"), joint.get("class", inherited)
        if of_class not in self.classes:
            known = nearest(of_class, self.classes)
            raise RobotModelError(f"{title(joint)}: unknown default class {shown(of_class)}{known}")
        stated: dict[str, str] = {"type": "hinge"}
        for element in (*(each for each in self.classes[of_class] if each.tag == "joint"), joint):
            check_attributes(element, JOINT)
            stated |= {key: value for key, value in element.attrib.items() if key in JOINT}
        kind = "free" if joint.tag == "freejoint" else stated["type"]
        if kind not in ("hinge", "slide"):
            raise RobotModelError(
                f"{title(joint)}: type {shown(kind)} is not supported, only hinge and slide joints are"
            )
        scale = math.radians(1.0) if self.compiler["angle"] == "degree" and kind == "hinge" else 1.0
        found = {key: stated[key] for key in ("type", "axis", "pos") if key in stated} | {"name": name}
        if "ref" in stated:
            found["ref"] = repr(scale * float(stated["ref"]))
        limited = stated.get("limited", "auto")
        limited = self.compiler["autolimits"] if limited == "auto" else limited
        if "range" in stated and limited == "true":
            lower, upper = (scale * float(end) for end in stated["range"].split())
            found["range"], self.ranges[name] = f"{lower!r} {upper!r}", (lower, upper)
        return ET.Element("joint", found)
