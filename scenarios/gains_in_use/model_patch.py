"""A copy of a model file with identified values.

URDF: `limit effort` and `dynamics damping friction` of joints, `inertial` of links; it has no armature.

MJCF: `damping`, `frictionloss` and `armature` of joints, overriding their classes; effort limits are `actuatorfrcrange`
of the joint, `forcerange` of its actuators, and `ctrlrange` of a `motor`, whose control is a force; `inertial` of
bodies.

Comments and line breaks between elements stay; white space within tags does not.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree import ElementTree as ET

from ident.model.xml_tree import read_document
from ident.payload.payload import INERTIA_KEYS
from scenarios.results.bare import Link
from scenarios.support.errors import ScenarioError

COMMENT = (
    " Masses, centres and inertias of the links are from bare motions and drive gains. Data determine only the base "
    "parameters, combinations of these; of all links with the same base parameters those nearest to the original model "
    "are given. Parameters of single links are not identifiable; joint torques are. The inertia of motors is in "
    "armature{}. "
)
"""Comment on links in a patched file."""
NOT_THERE = "the file has no joint of this name; it may be in an included file"
MAIN = "main"
ACTUATORS = ("general", "motor", "position", "velocity", "intvelocity", "damper", "cylinder", "muscle", "dcmotor")
SCALING = ("settotalmass", "boundmass", "boundinertia")
"""Settings of the compiler that, if positive, override values of `inertial`."""
Defaults = Mapping[tuple[str, str], Mapping[str, str]]
"""Attributes by default class and element, including those of enclosing classes."""


@dataclass(frozen=True, slots=True)
class Value:
    """A number, joint side, in SI; a scale of efforts is dimensionless.

    Attributes:
        value: The number.
        rel_std: Its relative standard deviation, including that of the gain.
    """

    value: float
    rel_std: float


Known = Value | str
"""A number, or the reason why there is none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JointValues:
    """Positive values of a joint.

    Attributes:
        name: Name in the model.
        effort: Ratio of identified to data-sheet gain, without sign.
        damping: Viscous friction [N m s/rad or N s/m].
        friction: Coulomb friction [N m or N].
        armature: Inertia of rotor and gear, joint side [kg m^2 or kg]; None if it is written with the links.
    """

    name: str
    effort: Known
    damping: Known
    friction: Known
    armature: Known | None


@dataclass(frozen=True, slots=True)
class Change:
    """An attribute of a joint, changed or not.

    Attributes:
        joint: Name of the joint.
        attribute: Name of the attribute in the file.
        before: Original text, or that of the default class; None if there is none.
        after: New text; None if unchanged.
        rel_std: Relative standard deviation of the new number; None if unchanged.
        reason: Why it is unchanged.
    """

    joint: str
    attribute: str
    before: str | None
    after: str | None = None
    rel_std: float | None = None
    reason: str = ""


def patched_model(
    path: Path, joints: Sequence[JointValues], links: Sequence[Link] | None = None
) -> tuple[bytes, tuple[Change, ...]]:
    """Return the content of a copy of a valid model file, and its changed and unchanged attributes.

    `links` are in the frames of the file; None to keep those of the file.

    Raises:
        ScenarioError: If a link cannot be written.
        RobotModelError: If the file cannot be read.
    """
    document = read_document(path, comments=True)
    root = next(each for each in document if each.tag in FORMATS)
    of_joints, of_links, armature = FORMATS[root.tag]
    if links is None:
        changes = [*of_joints(root, joints)]
    else:  # rotor inertia is written with the links
        changes = [*of_joints(root, [replace(each, armature=None) for each in joints]), *of_links(root, links)]
        _insert(root, ET.Comment(COMMENT.format(armature)))  # pyright: ignore[reportArgumentType]  (a kind of element)
    text = "\n".join(ET.tostring(each, encoding="unicode").rstrip() for each in document) + "\n"
    if b" />" not in path.read_bytes():
        text = text.replace(" />", "/>")
    return text.encode(), tuple(changes)


def _insert(parent: ET.Element, child: ET.Element) -> ET.Element:
    """Insert a first child, on its own line if the others are, and return it."""
    child.tail = parent.text
    parent.insert(0, child)
    return child


def _part(parent: ET.Element, tag: str) -> ET.Element:
    """Return a child, inserted if there is none."""
    found = parent.find(tag)
    return _insert(parent, ET.Element(tag)) if found is None else found


def _named(elements: Sequence[ET.Element]) -> dict[str, ET.Element]:
    return {each.get("name", ""): each for each in elements}


def _numbers(values: Sequence[float]) -> str:
    return " ".join(map(repr, values))


def _set(
    element: ET.Element | None, joint: str, name: str, before: str | None, known: Known, *, scale: bool = False
) -> Change:
    """Set an attribute of a joint to a number, or multiply its numbers by it, if it is known and they are limits."""
    numbers = [1.0]
    if scale:
        try:
            numbers = [float(word) for word in (before or "").split()]
        except ValueError:
            numbers = []
        if isinstance(known, Value) and not any(numbers):
            known = "a limit of 0 is no limit" if numbers else "the model states no limit"
    if isinstance(known, str) or element is None:
        return Change(joint, name, before, reason=str(known))
    after = " ".join(f"{each * known.value:.6g}" for each in numbers)  # its standard deviation is at least a millionth
    element.set(name, after)
    return Change(joint, name, before, after, known.rel_std)


def _no_armature(joint: str, found: float) -> Change:
    return Change(joint, "armature", None, reason=f"URDF has no such attribute; found {found:.4g}")


def _urdf_joints(root: ET.Element, joints: Sequence[JointValues]) -> Iterator[Change]:
    elements = _named(root.findall("joint"))
    for joint in joints:
        element = elements[joint.name]
        limit, old = element.find("limit"), element.find("dynamics")
        dynamics = ET.Element("dynamics") if old is None else old
        effort = None if limit is None else limit.get("effort")
        yield _set(limit, joint.name, "effort", effort, joint.effort, scale=True)
        for name, known in (("damping", joint.damping), ("friction", joint.friction)):
            yield _set(dynamics, joint.name, name, dynamics.get(name), known)
        if old is None and dynamics.attrib:
            _insert(element, dynamics)
        if isinstance(joint.armature, Value):
            yield _no_armature(joint.name, joint.armature.value)


def _urdf_links(root: ET.Element, links: Sequence[Link]) -> Iterator[Change]:
    joints, bodies = _named(root.findall("joint")), _named(root.findall("link"))
    for link in links:
        name = next(child.get("link", "") for child in joints[link.name].iter("child"))
        inertial = _part(bodies[name], "inertial")
        origin, mass, inertia = (_part(inertial, part) for part in ("origin", "mass", "inertia"))
        xyz, turned, moments = _numbers(link.com), origin.get("rpy", ""), _numbers(link.inertia.six)
        old = origin.get("xyz", "0 0 0") + (f"; rpy {turned}" if turned else "")
        stated = " ".join(inertia.get(key, "0") for key in INERTIA_KEYS)
        yield Change(link.name, "mass", mass.get("value"), repr(link.mass))
        yield Change(link.name, "inertial origin", old, xyz)
        yield Change(link.name, "inertia", stated, moments)
        mass.set("value", repr(link.mass))
        origin.attrib |= {"xyz": xyz} | ({"rpy": "0 0 0"} if turned else {})
        inertia.attrib |= dict(zip(INERTIA_KEYS, moments.split(), strict=True))
        if link.motor_found:
            yield _no_armature(link.name, link.motor_inertia)


def _mjcf_joints(root: ET.Element, joints: Sequence[JointValues]) -> Iterator[Change]:
    """As of a URDF; a joint without a name in the file is unchanged."""
    defaults = _defaults(root)
    elements = {joint.get("name", ""): (joint, inherited) for _, joint, inherited in _joints_of(root)}
    drives = [drive for section in root.findall("actuator") for drive in section.iter() if drive.tag in ACTUATORS]
    for joint in joints:
        if joint.name not in elements:
            yield Change(joint.name, "joint", None, reason=NOT_THERE)
            continue
        element, inherited = elements[joint.name]
        limits = [(element, inherited, "actuatorfrcrange")]
        for drive in drives:
            if joint.name in (drive.get("joint"), drive.get("jointinparent")):
                limits += [(drive, MAIN, key) for key in ("forcerange", *(["ctrlrange"] * (drive.tag == "motor")))]
        stated = [(each, key, _resolved(each, of, key, defaults)) for each, of, key in limits]
        stated = [each for each in stated if each[2] is not None] or [(None, "forcerange", None)]
        for drive, key, before in stated:
            yield _set(drive, joint.name, key, before, joint.effort, scale=True)
        values = {"damping": joint.damping, "frictionloss": joint.friction, "armature": joint.armature}
        for name, known in values.items():
            if known is not None:
                yield _set(element, joint.name, name, _resolved(element, inherited, name, defaults), known)


def _joints_of(parent: ET.Element, inherited: str | None = None) -> Iterator[tuple[ET.Element, ET.Element, str]]:
    """Return joints of the worldbody, or of one of its bodies, with their bodies and classes."""
    for child in parent.findall("worldbody") if inherited is None else parent:
        if child.tag == "joint":
            yield parent, child, inherited or MAIN
        else:
            yield from _joints_of(child, child.get("childclass") or inherited or MAIN)


def _kind(element: ET.Element) -> str:
    """Kind of an element; default classes have one entry for all kinds of actuators."""
    return "actuator" if element.tag in ACTUATORS else str(element.tag)


def _resolved(element: ET.Element, inherited: str, attribute: str, defaults: Defaults) -> str | None:
    """Return an attribute of an element or of its class."""
    of_class = defaults.get((element.get("class") or inherited, _kind(element)), {})
    return element.get(attribute, of_class.get(attribute))


def _defaults(root: ET.Element) -> Defaults:
    found: dict[tuple[str, str], dict[str, str]] = {}

    def add(section: ET.Element, around: str | None) -> None:
        name = section.get("class", MAIN)
        for (outer, kind), attributes in list(found.items()):
            if outer == around:
                found[name, kind] = dict(attributes)
        for child in section:
            if child.tag != "default":
                found.setdefault((name, _kind(child)), {}).update(child.attrib)
        for inner in section.findall("default"):
            add(inner, name)

    for section in root.findall("default"):
        add(section, None)
    return found


def _mjcf_links(root: ET.Element, links: Sequence[Link]) -> Iterator[Change]:
    for compiler in root.findall("compiler"):
        over = [name for name in SCALING if float(compiler.get(name, "0")) > 0.0]
        over += ["inertiafromgeom"] if compiler.get("inertiafromgeom") == "true" else []
        if over:
            raise ScenarioError(
                f"compiler {over[0]} = {compiler.get(over[0])!r} would override the masses that bodies state; remove "
                "it first"
            )
    bodies = {joint.get("name", ""): (body, joint) for body, joint, _ in _joints_of(root)}
    for link in links:
        if link.name not in bodies:
            raise ScenarioError(f"joint {link.name}: the file has no joint of this name, so its link cannot be written")
        body, joint = bodies[link.name]
        inertial = _part(body, "inertial")
        stated = {"mass": repr(link.mass), "pos": _numbers(link.com), "fullinertia": _numbers(link.inertia.six)}
        before = dict(inertial.attrib)
        before["fullinertia"] = " ".join(
            value if name == "fullinertia" else f"{name} {value}"
            for name, value in before.items()
            if name not in ("mass", "pos")
        )
        inertial.attrib.clear()
        inertial.attrib.update(stated)
        for name, after in stated.items():
            yield Change(link.name, f"inertial {name}", before.get(name) or None, after)
        if link.motor_found:
            yield Change(link.name, "armature", joint.get("armature"), repr(link.motor_inertia))
            joint.set("armature", repr(link.motor_inertia))


FORMATS = {
    "robot": (_urdf_joints, _urdf_links, ", which URDF does not support"),
    "mujoco": (_mjcf_joints, _mjcf_links, ""),
}
"""Functions that change joints and links, and where motors are in the comment, by the name of the root element."""
