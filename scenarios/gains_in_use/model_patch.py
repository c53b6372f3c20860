"""A copy of a model file with identified values, and what changed.

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
from scenarios.gains_in_use.model_values import JointValues, Known, Unknown, Value
from scenarios.results.links import Link
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


@dataclass(frozen=True, slots=True, kw_only=True)
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
    """Return the content of a copy of a model file, and its changed and unchanged attributes.

    Args:
        path: MJCF or URDF file, already validated.
        joints: Identified values of the joints.
        links: Identified links, in the frames of the file; None to keep those of the file.

    Raises:
        ScenarioError: If a link cannot be written.
        RobotModelError: If the file cannot be read.
    """
    document = read_document(path, comments=True)
    root = next(each for each in document if each.tag in FORMATS)
    of_joints, of_links, armature = FORMATS[root.tag]
    if links is None:
        changes = of_joints(root, joints)
    else:  # rotor inertia is written with the links
        changes = of_joints(root, [replace(each, armature=None) for each in joints]) + of_links(root, links)
        _insert(root, ET.Comment(COMMENT.format(armature)))  # pyright: ignore[reportArgumentType]  (a kind of element)
    text = "\n".join(ET.tostring(each, encoding="unicode").rstrip() for each in document) + "\n"
    if b" />" not in path.read_bytes():
        text = text.replace(" />", "/>")
    return text.encode(), tuple(changes)


def _insert(parent: ET.Element, child: ET.Element) -> None:
    """Insert a first child, on its own line if the others are."""
    child.tail = parent.text
    parent.insert(0, child)


def _part(parent: ET.Element, tag: str) -> ET.Element:
    """Return a child, inserted if there is none."""
    if (found := parent.find(tag)) is None:
        _insert(parent, found := ET.Element(tag))
    return found


def _named(elements: Sequence[ET.Element]) -> dict[str, ET.Element]:
    return {each.get("name", ""): each for each in elements}


def _set(element: ET.Element | None, joint: str, name: str, before: str | None, known: Known) -> Change:
    """Set an attribute of a joint to a number, if it is known."""
    if isinstance(known, Unknown):
        return Change(joint=joint, attribute=name, before=before, reason=known.reason)
    after = f"{known.value:.6g}"  # its standard deviation is at least a millionth
    if element is not None:
        element.set(name, after)
    return Change(joint=joint, attribute=name, before=before, after=after, rel_std=known.rel_std)


def _scale(element: ET.Element | None, joint: str, name: str, before: str | None, factor: Known) -> Change:
    """Scale an effort limit, if there is one and the factor is known."""
    try:
        limits = [float(word) for word in (before or "").split()]
    except ValueError:
        limits = []
    if isinstance(factor, Value) and not any(limits):
        factor = Unknown("a limit of 0 is no limit" if limits else "the model states no limit")
    if isinstance(factor, Unknown) or element is None:
        reason = factor.reason if isinstance(factor, Unknown) else ""
        return Change(joint=joint, attribute=name, before=before, reason=reason)
    after = " ".join(f"{limit * factor.value:.6g}" for limit in limits)
    element.set(name, after)
    return Change(joint=joint, attribute=name, before=before, after=after, rel_std=factor.rel_std)


def _urdf_joints(root: ET.Element, joints: Sequence[JointValues]) -> list[Change]:
    elements, found = _named(root.findall("joint")), list[Change]()
    for joint in joints:
        element = elements[joint.name]
        limit, old = element.find("limit"), element.find("dynamics")
        dynamics = ET.Element("dynamics") if old is None else old
        effort = None if limit is None else limit.get("effort")
        found.append(_scale(limit, joint.name, "effort", effort, joint.effort))
        found += [
            _set(dynamics, joint.name, name, dynamics.get(name), known)
            for name, known in (("damping", joint.damping), ("friction", joint.friction))
        ]
        if old is None and dynamics.attrib:
            _insert(element, dynamics)
        if isinstance(joint.armature, Value):
            found.append(_no_armature(joint.name, joint.armature.value))
    return found


def _no_armature(joint: str, found: float) -> Change:
    reason = f"URDF has no such attribute; found {found:.4g}"
    return Change(joint=joint, attribute="armature", before=None, reason=reason)


def _urdf_links(root: ET.Element, links: Sequence[Link]) -> list[Change]:
    joints, bodies, found = _named(root.findall("joint")), _named(root.findall("link")), list[Change]()
    for link in links:
        name = next(child.get("link", "") for child in joints[link.name].iter("child"))
        inertial = _part(bodies[name], "inertial")
        origin, mass, inertia = (_part(inertial, part) for part in ("origin", "mass", "inertia"))
        xyz, turned, moments = _numbers(link.com), origin.get("rpy", ""), _numbers(link.inertia.six)
        old = origin.get("xyz", "0 0 0") + (f"; rpy {turned}" if turned else "")
        stated = " ".join(inertia.get(key, "0") for key in INERTIA_KEYS)
        found += [
            Change(joint=link.name, attribute="mass", before=mass.get("value"), after=repr(link.mass)),
            Change(joint=link.name, attribute="inertial origin", before=old, after=xyz),
            Change(joint=link.name, attribute="inertia", before=stated, after=moments),
        ]
        mass.set("value", repr(link.mass))
        origin.attrib |= {"xyz": xyz} | ({"rpy": "0 0 0"} if turned else {})
        inertia.attrib |= dict(zip(INERTIA_KEYS, moments.split(), strict=True))
        if link.motor_found:
            found.append(_no_armature(link.name, link.motor_inertia))
    return found


def _numbers(values: Sequence[float]) -> str:
    return " ".join(map(repr, values))


def _mjcf_joints(root: ET.Element, joints: Sequence[JointValues]) -> list[Change]:
    """As of a URDF; a joint without a name in the file is unchanged."""
    defaults, found = _defaults(root), list[Change]()
    elements = {joint.get("name", ""): (joint, inherited) for _, joint, inherited in _joints_of(root)}
    drives = [drive for section in root.findall("actuator") for drive in section.iter() if drive.tag in ACTUATORS]
    for joint in joints:
        if joint.name not in elements:
            found.append(Change(joint=joint.name, attribute="joint", before=None, reason=NOT_THERE))
            continue
        element, inherited = elements[joint.name]
        limits = [(element, inherited, "actuatorfrcrange")]
        for drive in drives:
            if joint.name in (drive.get("joint"), drive.get("jointinparent")):
                limits += [(drive, MAIN, key) for key in ("forcerange", *(["ctrlrange"] * (drive.tag == "motor")))]
        stated = [(each, key, _resolved(each, of, key, defaults)) for each, of, key in limits]
        efforts = [_scale(each, joint.name, key, old, joint.effort) for each, key, old in stated if old is not None]
        found += efforts or [_scale(None, joint.name, "forcerange", None, joint.effort)]
        found += [
            _set(element, joint.name, name, _resolved(element, inherited, name, defaults), known)
            for name, known in (
                ("damping", joint.damping),
                ("frictionloss", joint.friction),
                ("armature", joint.armature),
            )
            if known is not None
        ]
    return found


def _joints_of(root: ET.Element) -> Iterator[tuple[ET.Element, ET.Element, str]]:
    """Return joints of the worldbody with their bodies and classes."""

    def walk(parent: ET.Element, inherited: str) -> Iterator[tuple[ET.Element, ET.Element, str]]:
        for child in parent:
            if child.tag == "joint":
                yield parent, child, inherited
            else:
                yield from walk(child, child.get("childclass") or inherited)

    for world in root.findall("worldbody"):
        yield from walk(world, MAIN)


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


def _mjcf_links(root: ET.Element, links: Sequence[Link]) -> list[Change]:
    for compiler in root.findall("compiler"):
        over = [name for name in SCALING if float(compiler.get(name, "0")) > 0.0]
        over += ["inertiafromgeom"] if compiler.get("inertiafromgeom") == "true" else []
        if over:
            raise ScenarioError(
                f"compiler {over[0]} = {compiler.get(over[0])!r} would override the masses that bodies state; remove "
                "it first"
            )
    bodies = {joint.get("name", ""): (body, joint) for body, joint, _ in _joints_of(root)}
    found = list[Change]()
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
        found += [
            Change(joint=link.name, attribute=f"inertial {name}", before=before.get(name) or None, after=after)
            for name, after in stated.items()
        ]
        if link.motor_found:
            after, old = repr(link.motor_inertia), joint.get("armature")
            joint.set("armature", after)
            found.append(Change(joint=link.name, attribute="armature", before=old, after=after))
    return found


FORMATS = {
    "robot": (_urdf_joints, _urdf_links, ", which URDF does not support"),
    "mujoco": (_mjcf_joints, _mjcf_links, ""),
}
"""Functions that change joints and links, and where motors are in the comment, by the name of the root element."""
