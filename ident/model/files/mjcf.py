"""Reduction of an MJCF file to bodies and joints: includes and defaults resolved, all numbers checked, with lines.

Pinocchio's reader of MJCF reads invalid numbers as 0, supports one worldbody with one body, and ignores gravity, the
orientation of a base body without joint, and unknown elements. It converts metres of slide joints as degrees and takes
ends of a range relative to `ref`. It differs from MuJoCo for axes that are not unit vectors and for Euler angles about
fixed axes. The reduced file avoids all of this: one root body, explicit joints, angles in radians, orientations as
quaternions, and separate gravity and ranges.
"""

import math
import re
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ident.model.files.chain import MANIFOLD, refuse_ties, to_flange, without_objects
from ident.model.files.xml_tree import (
    DEEPEST,
    EARTH,
    FARTHEST,
    LARGEST_FILE,
    SHORTEST,
    Element,
    MinimalModel,
    direction,
    read_xml,
    tag,
    vector,
)
from ident.support.arrays import Array
from ident.support.errors import RobotModelError
from ident.support.naming import nearest, shown

STRONGEST_GRAVITY = 100.0
"""Largest component of gravity [m/s^2]."""
ORIENTATIONS = {"quat": 4, "axisangle": 4, "euler": 3, "xyaxes": 6, "zaxis": 3}
"""Attributes of a body's orientation, with the number of their values."""
PLACES = ("name", "childclass", "pos", *ORIENTATIONS)
"""Attributes of a body that decide its kinematics, and its name."""
JOINT = ("type", "axis", "pos", "range", "ref", "limited")
"""Attributes of a joint that decide its kinematics."""
BODY = ("body", "joint", "inertial", "geom", "site", "camera", "light", "plugin", *MANIFOLD, "freejoint")
INERTIA = tag("inertial", {"pos": "0 0 0", "mass": "1", "diaginertia": "1 1 1"})
"""Not used, but required by readers."""


@dataclass(frozen=True, slots=True)
class _Reading:
    """Context and results of the traversal of bodies.

    Attributes:
        classes: Elements that state attributes of joints by default class, outer ones first.
        degree: Whether angles are in degrees.
        sequence: Axes of Euler angles, lower case for axes that turn with the body, upper case for fixed ones.
        autolimits: Whether a range without `limited` limits a joint.
        names: Bodies and joints seen so far, by kind and name.
        ranges: Ends of the joints that have any [rad or m].
    """

    classes: dict[str, list[Element]]
    degree: bool
    sequence: str
    autolimits: bool
    names: dict[tuple[str, str], Element] = field(default_factory=lambda: dict[tuple[str, str], Element]())
    ranges: dict[str, tuple[float, float]] = field(default_factory=lambda: dict[str, tuple[float, float]]())


def minimal_mjcf(root: Element, path: Path, flange: str | None = None) -> MinimalModel:
    """Reduce an MJCF file with its includes, to the chain to a flange if named.

    Raises:
        RobotModelError: If a number, name or class is wrong or not supported; the message names line and element.
    """
    if root.tag != "mujoco":
        raise RobotModelError(f"{root.where}: the root element is {root.tag}, expected mujoco; URDF files end in .urdf")
    root = _expanded(root, path.parent, {path.resolve(): path.stat().st_size}, DEEPEST)
    reading = _reading(root)
    refuse_ties(root, flange)
    root = without_objects(root) if flange is None else to_flange(root, flange)
    bodies = [_body(body, "main", reading) for world in root.all("worldbody") for body in _bodies(world)]
    around = "world root"
    while ("body", around) in reading.names:  # an already reduced file has one
        around = f"around {around}"
    gravity = _gravity(root)
    text = tag(
        "mujoco",
        {"model": root.attributes.get("model", path.stem)},
        tag("compiler", {"angle": "radian"}),
        tag("option", {"gravity": " ".join(map(repr, gravity))}),
        tag("worldbody", {}, tag("body", {"name": around}, *bodies or ("",))),
    )
    return MinimalModel("mjcf", text, gravity, reading.ranges)


def _expanded(element: Element, folder: Path, sizes: dict[Path, int], room: int) -> Element:
    """Return the tree with every `<include file="..."/>` replaced by the children of the file's root element.

    Args:
        element: Root element of the main file.
        folder: Folder of the main file, the base of names.
        sizes: Files read so far [bytes].
        room: Number of further nesting levels.
    """
    children = list[Element]()
    for child in element.children:
        if room <= 1:
            raise RobotModelError(
                f"{child.where}: elements, including those of included files, are nested deeper than {DEEPEST}"
            )
        found = child if child.tag != "include" else _included(child, folder, sizes)
        found = _expanded(found, folder, sizes, room - 1)
        children += [found] if child.tag != "include" else found.children
    return replace(element, children=children)


def _included(include: Element, folder: Path, sizes: dict[Path, int]) -> Element:
    name = include.attributes.get("file", "")
    if not name:
        raise RobotModelError(f"{include.where}: include lacks the attribute file")
    path = folder / name
    if path.resolve() in sizes:
        raise RobotModelError(f"{include.where}: include file = {shown(name)} is included a second time")
    try:
        content = read_xml(path)
    except RobotModelError as error:
        raise RobotModelError(f"{include.where}: include: {error}") from error
    sizes[path.resolve()] = path.stat().st_size
    if sum(sizes.values()) > LARGEST_FILE:
        raise RobotModelError(f"{include.where}: more than {LARGEST_FILE / 1e6:g} MB are included")
    return content


def _reading(root: Element) -> _Reading:
    """Return the content of compiler and default sections."""
    compiler = {k: v for section in root.all("compiler") for k, v in section.attributes.items()}
    unit, sequence = compiler.get("angle", "degree"), compiler.get("eulerseq", "xyz")
    if compiler.get("coordinate", "local") != "local":
        raise RobotModelError(f"{root.title}: compiler coordinate = {shown(compiler['coordinate'])} is not supported")
    if unit not in ("degree", "radian"):
        known = nearest(unit, ("degree", "radian"))
        raise RobotModelError(f"{root.title}: compiler angle = {shown(unit)}{known}; known: degree, radian")
    if not re.fullmatch("[xyz]{3}|[XYZ]{3}", sequence):
        expected = "expected three of x, y, z, all lower or all upper case"
        raise RobotModelError(f"{root.title}: compiler eulerseq = {shown(sequence)}; {expected}")
    classes: dict[str, list[Element]] = {"main": []}
    for section in root.all("default"):
        if section.attributes.get("class", "main") != "main":
            raise RobotModelError(f"{section.title}: the outermost default class must be named main")
        _add_defaults(section, "main", classes)
    return _Reading(classes, unit == "degree", sequence, compiler.get("autolimits", "true") == "true")


def _add_defaults(section: Element, name: str, classes: dict[str, list[Element]]) -> None:
    """Add the class of a section and its nested classes, with inherited attributes."""
    classes[name] += section.all("joint")
    for inner in section.all("default"):
        own = inner.attributes.get("class")
        if own is None:
            raise RobotModelError(f"{inner.where}: a default class inside another needs a name, class = ...")
        classes[own] = [*classes[name], *classes.get(own, [])]
        _add_defaults(inner, own, classes)


def _gravity(root: Element) -> tuple[float, ...]:
    gravity = EARTH
    for option in root.all("option"):
        gravity = vector(option, "gravity", 3, largest=STRONGEST_GRAVITY) or gravity
        if not any(gravity):
            raise RobotModelError(f"{option.title}: gravity is 0; without weight no gain can be identified")
        for flag in option.all("flag"):
            if flag.attributes.get("gravity", "enable") != "enable":
                raise RobotModelError(f"{flag.title}: gravity is disabled; without weight no gain can be identified")
    return gravity


def _bodies(parent: Element) -> list[Element]:
    """Return the bodies in an element; refuse elements that expand to bodies."""
    for child in parent.children:
        moves = any(each.tag in ("body", "joint", "freejoint") for each in child.walk())
        if child.tag in MANIFOLD and (moves or child.tag not in ("frame", "replicate")):
            raise RobotModelError(
                f"{child.title}: {child.tag} is not supported; save the model with MuJoCo (mj_saveLastXML), which "
                "expands it, and use that file"
            )
        if child.tag not in BODY:
            raise RobotModelError(f"{child.title}: unknown element{nearest(child.tag, BODY)}")
    return parent.all("body")


def _body(body: Element, inherited: str, reading: _Reading) -> str:
    _name_once(body, "body", reading)
    name = body.attributes.get("name", f"body {len(reading.names)}")  # before nested ones are counted
    _check_spelling(body, PLACES, PLACES)
    vector(body, "pos", 3, largest=FARTHEST)
    turned = _orientation(body, reading)
    inherited = _known_class(body, "childclass", inherited, reading)
    joints = body.all("joint", "freejoint")
    if len(joints) > 1:
        raise RobotModelError(
            f"{joints[1].title}: a second joint in one body; put it in a separate body around this one"
        )
    place = {key: value for key, value in body.attributes.items() if key == "pos"} | turned
    inside = [_joint(joint, inherited, reading) for joint in joints]
    inside += [_body(inner, inherited, reading) for inner in _bodies(body)]
    return tag("body", {"name": name, **place}, INERTIA, *inside)


def _orientation(body: Element, reading: _Reading) -> dict[str, str]:
    """Return the orientation of a body for Pinocchio; none without rotation."""
    stated = [key for key in ORIENTATIONS if key in body.attributes]
    if len(stated) > 1:
        raise RobotModelError(f"{body.title}: {' and '.join(stated)} both state its orientation; give one")
    if not stated:
        return {}
    key = stated[0]
    values = np.array(vector(body, key, ORIENTATIONS[key]))
    angles = np.deg2rad(values) if reading.degree else values
    turned = (1.0, np.zeros(3))
    if key == "euler":
        for name, angle in zip(reading.sequence, angles.tolist(), strict=True):
            step = _about(np.eye(3)["xyz".index(name.lower())], angle)
            turned = _then(turned, step) if name.islower() else _then(step, turned)  # upper case: fixed axes
    elif key == "axisangle":
        length = float(np.linalg.norm(values[:3]))
        if length < SHORTEST:
            raise RobotModelError(f"{body.title}: axisangle has no direction")
        turned = _about(values[:3] / length, float(angles[3]))
    else:
        if key == "xyaxes" and np.linalg.norm(np.cross(values[:3], values[3:])) < SHORTEST:
            raise RobotModelError(f"{body.title}: the axes of xyaxes are parallel or zero")
        direction(body, key, ORIENTATIONS[key])
        return {key: body.attributes[key]}
    return {"quat": " ".join(repr(float(x)) for x in (turned[0], *turned[1]))}


Quaternion = tuple[float, Array]
"""A quaternion, scalar and vector part; importing `scipy.spatial` would take 0.1 s."""


def _about(axis: Array, angle: float) -> Quaternion:
    """Return a rotation about a unit axis."""
    return math.cos(0.5 * angle), math.sin(0.5 * angle) * axis


def _then(first: Quaternion, second: Quaternion) -> Quaternion:
    """Return a rotation followed by another one about the rotated axes."""
    (w, u), (x, v) = first, second
    return w * x - float(u @ v), w * v + x * u + np.cross(u, v)


def _joint(joint: Element, inherited: str, reading: _Reading) -> str:
    """Return a joint with all used attributes explicit; a slide joint is in metres."""
    name = joint.attributes.get("name", f"joint{sum(kind == 'joint' for kind, _ in reading.names) + 1}")
    _name_once(joint, "joint", reading)
    stated: dict[str, str] = {}
    for element in (*reading.classes[_known_class(joint, "class", inherited, reading)], joint):
        _check_spelling(element, JOINT, (*JOINT, "name", "class"))
        direction(element, "axis")
        vector(element, "pos", 3, largest=FARTHEST)
        stated |= {key: value for key, value in element.attributes.items() if key in JOINT}
        for key, count in (("range", 2), ("ref", 1)):
            vector(element, key, count)
    kind = "free" if joint.tag == "freejoint" else stated.get("type", "hinge")
    if kind in ("free", "ball"):
        raise RobotModelError(
            f"{joint.title}: a {kind} joint is not supported; only fixed-base arms of hinge and slide joints are"
        )
    if kind not in ("hinge", "slide"):
        known = nearest(kind, ("hinge", "slide"))
        raise RobotModelError(f"{joint.title}: type {shown(kind)} is unknown{known}; known: hinge, slide")
    scale = math.radians(1.0) if reading.degree and kind == "hinge" else 1.0
    limited = stated.pop("limited", "auto")
    if "range" in stated:
        lower, upper = (scale * float(end) for end in stated["range"].split())
        stated["range"] = f"{lower!r} {upper!r}"
        if limited == "false" or (limited == "auto" and not reading.autolimits):
            del stated["range"]
        elif lower > upper:
            raise RobotModelError(f"{joint.title}: its range is reversed: from {lower:.6g} to {upper:.6g}")
        else:
            reading.ranges[name] = lower, upper
    if "ref" in stated:
        stated["ref"] = repr(scale * float(stated["ref"]))
    return tag("joint", {"name": name, **stated, "type": kind})


def _check_spelling(element: Element, meant: tuple[str, ...], known: tuple[str, ...]) -> None:
    """Refuse misspelt kinematic attributes; other attributes of MuJoCo are ignored."""
    for attribute in element.attributes:
        if attribute not in known and (close := nearest(attribute, meant)):
            raise RobotModelError(f"{element.title}: unknown attribute {shown(attribute)}{close}")


def _name_once(element: Element, kind: str, reading: _Reading) -> None:
    key = kind, element.attributes.get("name", f"unnamed {len(reading.names)}")
    if key in reading.names:
        raise RobotModelError(f"{element.title} appears twice; the first one is in {reading.names[key].line}")
    reading.names[key] = element


def _known_class(element: Element, attribute: str, inherited: str, reading: _Reading) -> str:
    name = element.attributes.get(attribute, inherited)
    if name not in reading.classes:
        raise RobotModelError(f"{element.title}: unknown default class {shown(name)}{nearest(name, reading.classes)}")
    return name
