"""An MJCF file reduced to bodies and joints: files included, defaults resolved, every number checked with its line.

Pinocchio's reader of MJCF takes 0 for what is no number, knows one worldbody with one body, and leaves out gravity, the
orientation of a base body without joint, default classes under another name than `main`, and elements it does not know.
It takes metres of a slide for degrees. What it is given here has none of that: one root body, explicit joints, angles
in radians, and gravity beside the text.
"""

from dataclasses import dataclass, field
from pathlib import Path

from ident.model.files.chain import NAME_IT, WORLD, Reach, reach, to_flange, without_objects
from ident.model.files.includes import included
from ident.model.files.minimal import EARTH, MinimalModel, tag
from ident.model.files.mjcf_joints import joint_defaults, minimal_joint
from ident.model.files.mjcf_orientation import ORIENTATIONS, Angles, angles_of, orientation
from ident.model.files.numbers import FARTHEST, STRONGEST_GRAVITY, vector
from ident.model.files.xml_tree import Element
from ident.support.errors import RobotModelError
from ident.support.naming import nearest, shown

PLACES = ("name", "childclass", "pos", *ORIENTATIONS)
"""Attributes of a body that decide its kinematics, and its name."""
MANIFOLD = ("frame", "replicate", "composite", "flexcomp", "attach")
"""Elements that MuJoCo turns into bodies, and Pinocchio leaves out."""
BODY = ("body", "joint", "inertial", "geom", "site", "camera", "light", "plugin", *MANIFOLD, "freejoint")
LOOPS = ("connect", "weld", "joint", "tendon")
"""Equalities that take a degree of freedom away."""
INERTIA = tag("inertial", {"pos": "0 0 0", "mass": "1", "diaginertia": "1 1 1"})
"""Not used, and wanted by readers."""


@dataclass(frozen=True, slots=True)
class _Reading:
    """What is needed on the way down the bodies.

    Attributes:
        defaults: Attributes of joints by default class.
        angles: How angles are meant.
        autolimits: Whether a range alone limits a joint.
        names: Bodies and joints seen so far, by kind and name.
    """

    defaults: dict[str, dict[str, str]]
    angles: Angles
    autolimits: bool
    names: dict[tuple[str, str], Element] = field(default_factory=lambda: dict[tuple[str, str], Element]())


def minimal_mjcf(root: Element, path: Path, flange: str | None = None) -> MinimalModel:
    """Reduce an MJCF file and what it includes, to what leads to a flange where one is named.

    Raises:
        RobotModelError: Naming line and element, if a number, name or class is wrong, or something is not supported.
    """
    if root.tag != "mujoco":
        raise RobotModelError(f"{root.where}: {root.tag} is no <mujoco>; URDF files end in .urdf")
    root = included(root, path)
    compiler = {k: v for section in root.all("compiler") for k, v in section.attributes.items()}
    if compiler.get("coordinate", "local") != "local":
        raise RobotModelError(f"{root.title}: compiler coordinate = {shown(compiler['coordinate'])} is not supported")
    _refuse_loops(root, None if flange is None else reach(root, flange))
    root = without_objects(root) if flange is None else to_flange(root, flange)
    angles = angles_of(root, compiler)
    reading = _Reading(joint_defaults(root), angles, compiler.get("autolimits", "true") == "true")
    bodies = [_body(body, "main", reading) for world in root.all("worldbody") for body in _bodies(world)]
    around = "world root"
    while ("body", around) in reading.names:  # a file that was reduced before has one
        around = f"around {around}"
    world = tag("worldbody", {}, tag("body", {"name": around}, *bodies or ("",)))
    name = root.attributes.get("model", path.stem)
    return MinimalModel(
        "mjcf", tag("mujoco", {"model": name}, tag("compiler", {"angle": "radian"}), world), _gravity(root)
    )


def _gravity(root: Element) -> tuple[float, float, float]:
    gravity = EARTH
    for option in root.all("option"):
        if values := vector(option, "gravity", 3, largest=STRONGEST_GRAVITY):
            gravity = (values[0], values[1], values[2])
            if not any(gravity):
                raise RobotModelError(f"{option.title}: gravity is 0; without weight no gain can be identified")
        for flag in option.all("flag"):
            if flag.attributes.get("gravity", "enable") != "enable":
                raise RobotModelError(f"{flag.title}: gravity is disabled; without weight no gain can be identified")
    return gravity


def _refuse_loops(root: Element, moving: Reach | None) -> None:
    """Refuse what ties joints that move; `moving` says which do, None that all do."""
    for section in root.all("equality"):
        for loop in section.all(*LOOPS):
            if loop.attributes.get("active", "true") != "false" and not (moving and _is_held(loop, root, moving)):
                raise RobotModelError(
                    f"{loop.title}: an equality of kind {loop.tag} ties joints; only arms with a drive on every joint "
                    f"and no closed loop are read; {NAME_IT}"
                )


def _is_held(loop: Element, root: Element, moving: Reach) -> bool:
    """Whether an equality ties only what is held: joints that do not move, or bodies that move as one."""
    given = loop.attributes
    if loop.tag == "joint":
        return moving.joints.isdisjoint(given.get(key, "") for key in ("joint1", "joint2"))
    if loop.tag == "tendon":
        names = {given.get(key, "") for key in ("tendon1", "tendon2")} - {""}
        tendons = [
            t for section in root.all("tendon") for t in section.all("fixed") if t.attributes.get("name") in names
        ]
        used = {joint.attributes.get("joint", "") for tendon in tendons for joint in tendon.all("joint")}
        return len(tendons) == len(names) and moving.joints.isdisjoint(used)
    if "body1" not in given:
        return False
    ends = [moving.moved_by.get(given.get(key, WORLD)) for key in ("body1", "body2")]
    return ends[0] is not None and ends[0] == ends[1]


def _bodies(parent: Element) -> list[Element]:
    """The bodies inside an element, where nothing else makes bodies."""
    for child in parent.children:
        if child.tag in MANIFOLD and (child.tag not in ("frame", "replicate") or _moves(child)):
            raise RobotModelError(
                f"{child.title}: {child.tag} is not supported; let MuJoCo write the model flat (mj_saveLastXML)"
            )
        if child.tag not in BODY:
            raise RobotModelError(f"{child.title}: unknown element{nearest(child.tag, BODY)}")
    return parent.all("body")


def _moves(element: Element) -> bool:
    return any(child.tag in ("body", "joint", "freejoint") or _moves(child) for child in element.children)


def _body(body: Element, inherited: str, reading: _Reading) -> str:
    _name_once(body, reading)
    name = body.attributes.get("name", f"body {len(reading.names)}")  # before those inside are counted
    for attribute in body.attributes:
        if attribute not in PLACES and (close := nearest(attribute, PLACES)):
            raise RobotModelError(f"{body.title}: unknown attribute {shown(attribute)}{close}")
    vector(body, "pos", 3, largest=FARTHEST)
    turned = orientation(body, reading.angles)
    inherited = _known_class(body, "childclass", inherited, reading)
    joints = body.all("joint", "freejoint")
    if len(joints) > 1:
        raise RobotModelError(f"{joints[1].title}: a second joint in one body; give it a body of its own around it")
    place = {key: value for key, value in body.attributes.items() if key == "pos"} | turned
    inside = [_joint(joint, inherited, reading) for joint in joints] + [
        _body(inner, inherited, reading) for inner in _bodies(body)
    ]
    return tag("body", {"name": name, **place}, INERTIA, *inside)


def _joint(joint: Element, inherited: str, reading: _Reading) -> str:
    number = sum(kind == "joint" for kind, _ in reading.names) + 1
    _name_once(joint, reading)
    defaults = reading.defaults[_known_class(joint, "class", inherited, reading)]
    return minimal_joint(joint, defaults, unit=reading.angles.unit, autolimits=reading.autolimits, number=number)


def _name_once(element: Element, reading: _Reading) -> None:
    kind = "joint" if element.tag == "freejoint" else element.tag
    key = kind, element.attributes.get("name", f"unnamed {len(reading.names)}")
    if key in reading.names:
        first = reading.names[key].where.split(": ")[-1]
        raise RobotModelError(f"{element.title} is there twice; the first one is in {first}")
    reading.names[key] = element


def _known_class(element: Element, attribute: str, inherited: str, reading: _Reading) -> str:
    name = element.attributes.get(attribute, inherited)
    if name not in reading.defaults:
        raise RobotModelError(f"{element.title}: unknown default class {shown(name)}{nearest(name, reading.defaults)}")
    return name
