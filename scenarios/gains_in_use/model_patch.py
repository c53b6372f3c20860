"""A copy of a model file with identified values.

URDF: `limit effort` and `dynamics damping friction` of joints, `inertial` of links; it has no armature.

MJCF: `damping`, `frictionloss` and `armature` of joints, overriding their classes; effort limits are `actuatorfrcrange`
of the joint, `forcerange` of its actuators, and `ctrlrange` of a `motor`, whose control is a force; `inertial` of
bodies.

Comments and line breaks between elements stay; white space within tags does not.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as ET

from ident.model.mjcf import MAIN, default_classes
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
NO_ARMATURE = "URDF has no such attribute; found {:.4g}"
ACTUATORS = ("general", "motor", "position", "velocity", "intvelocity", "damper", "cylinder", "muscle", "dcmotor")
SCALING = ("settotalmass", "boundmass", "boundinertia")
"""Settings of the compiler that, if positive, override values of `inertial`."""


class Value(NamedTuple):
    """A number, joint side, in SI, with its relative standard deviation; a scale of efforts is dimensionless."""

    value: float
    rel_std: float


Known = Value | str
"""A number, or the reason why there is none."""
JointValues = Mapping[str, Known]
"""Positive values of a joint: `effort`, the ratio of identified to assumed gain without sign; `damping`, viscous
friction [N m s/rad or N s/m]; `friction`, Coulomb friction [N m or N]; `armature`, inertia of rotor and gear, joint
side [kg m^2 or kg]."""
Place = tuple[str, ET.Element | None, str, str | None]
"""Which value of a joint an attribute has, its element (None without one), its name, and the original text."""


@dataclass(frozen=True, slots=True)
class Change:
    """An attribute of a joint, changed or not."""

    joint: str  # name of the joint
    attribute: str  # name of the attribute in the file
    before: str | None  # original text, or that of the default class; None if there is none
    after: str | None = None  # new text; None if unchanged
    rel_std: float | None = None  # relative standard deviation of the new number; None if unchanged
    reason: str = ""  # why it is unchanged


class _Joint(NamedTuple):
    """A joint of a file: its element, its body, and where its values are."""

    element: ET.Element
    body: ET.Element
    places: list[Place]


class _Format(NamedTuple):
    """How a kind of file has joints, writes the inertia of a body, as attribute, old and new text, and an armature."""

    joints: Callable[[ET.Element], dict[str, _Joint]]
    inertial: Callable[[ET.Element, Link], Iterable[tuple[str, str | None, str]]]
    armature: bool


def patched_model(
    path: Path, joints: Mapping[str, JointValues], links: Sequence[Link] | None = None
) -> tuple[bytes, tuple[Change, ...]]:
    """Return the content of a copy of a valid model file, and its changed and unchanged attributes.

    `joints` have values by the name of the joint, `links` are in the frames of the file; None to keep those of the
    file. Raises `ScenarioError` if a link cannot be written, `RobotModelError` if the file cannot be read.
    """
    document = read_document(path, comments=True)
    root = next(each for each in document if each.tag in FORMATS)
    form, changes = FORMATS[root.tag], list[Change]()
    there = form.joints(root)
    for name, values in joints.items():
        if name in there:
            changes += _joint_changes(name, values, there[name], written=links is not None)
        else:
            changes.append(Change(name, "joint", None, reason=NOT_THERE))
    if links is not None:
        changes += _link_changes(root, links, there, form)
        comment = COMMENT.format("" if form.armature else ", which URDF does not support")
        _insert(root, ET.Comment(comment))  # pyright: ignore[reportArgumentType]  (a kind of element)
    text = "\n".join(ET.tostring(each, encoding="unicode").rstrip() for each in document) + "\n"
    if b" />" not in path.read_bytes():
        text = text.replace(" />", "/>")
    return text.encode(), tuple(changes)


def _joint_changes(name: str, values: JointValues, joint: _Joint, *, written: bool) -> Iterator[Change]:
    """Set the attributes of a joint; rotor inertia is `written` with the links."""
    for which, element, attribute, before in joint.places:
        known, numbers = values[which], [1.0]
        if which == "armature" and (written or (element is None and isinstance(known, str))):
            continue
        if which == "effort":  # a scale of the limits that are stated
            try:
                numbers = [float(word) for word in (before or "").split()]
            except ValueError:
                numbers = []
        if isinstance(known, Value) and not any(numbers):
            known = "a limit of 0 is no limit" if numbers else "the model states no limit"
        elif isinstance(known, Value) and element is None:
            known = NO_ARMATURE.format(known.value)
        if isinstance(known, str) or element is None:
            yield Change(name, attribute, before, reason=str(known))
            continue
        after = " ".join(f"{each * known.value:.6g}" for each in numbers)  # its deviation is at least a millionth
        element.set(attribute, after)
        yield Change(name, attribute, before, after, known.rel_std)
        if element.tag == "dynamics" and element not in joint.element:
            _insert(joint.element, element)


def _link_changes(
    root: ET.Element, links: Sequence[Link], there: Mapping[str, _Joint], form: _Format
) -> Iterator[Change]:
    for compiler in root.findall("compiler"):
        over = [name for name in SCALING if float(compiler.get(name, "0")) > 0.0]
        over += ["inertiafromgeom"] if compiler.get("inertiafromgeom") == "true" else []
        if over:
            stated = f"compiler {over[0]} = {compiler.get(over[0])!r}"
            raise ScenarioError(f"{stated} would override the masses that bodies state; remove it first")
    for link in links:
        if link.name not in there:
            raise ScenarioError(f"joint {link.name}: the file has no joint of this name, so its link cannot be written")
        joint, motor = there[link.name], repr(link.motor_inertia)
        for attribute, before, after in form.inertial(_part(joint.body, "inertial"), link):
            yield Change(link.name, attribute, before, after)
        if link.motor_found and form.armature:
            yield Change(link.name, "armature", joint.element.get("armature"), motor)
            joint.element.set("armature", motor)
        elif link.motor_found:
            yield Change(link.name, "armature", None, reason=NO_ARMATURE.format(link.motor_inertia))


def _insert(parent: ET.Element, child: ET.Element) -> ET.Element:
    """Insert a first child, on its own line if the others are, and return it."""
    child.tail = parent.text
    parent.insert(0, child)
    return child


def _part(parent: ET.Element, tag: str) -> ET.Element:
    """Return a child, inserted if there is none."""
    found = parent.find(tag)
    return _insert(parent, ET.Element(tag)) if found is None else found


def _numbers(values: Sequence[float]) -> str:
    return " ".join(map(repr, values))


def _urdf_joints(root: ET.Element) -> dict[str, _Joint]:
    bodies, found = {each.get("name", ""): each for each in root.findall("link")}, dict[str, _Joint]()
    for joint in root.findall("joint"):
        limit, dynamics = joint.find("limit"), joint.find("dynamics")
        dynamics = ET.Element("dynamics") if dynamics is None else dynamics  # inserted with its first attribute
        places: list[Place] = [("effort", limit, "effort", None if limit is None else limit.get("effort"))]
        places += [(name, dynamics, name, dynamics.get(name)) for name in ("damping", "friction")]
        places += [("armature", None, "armature", None)]
        child = next((each.get("link", "") for each in joint.iter("child")), "")
        found[joint.get("name", "")] = _Joint(joint, bodies.get(child, joint), places)
    return found


def _urdf_inertial(inertial: ET.Element, link: Link) -> Iterator[tuple[str, str | None, str]]:
    origin, mass, inertia = (_part(inertial, part) for part in ("origin", "mass", "inertia"))
    xyz, turned, moments = _numbers(link.com), origin.get("rpy", ""), _numbers([value for _, value in link.inertia])
    yield "mass", mass.get("value"), repr(link.mass)
    yield "inertial origin", origin.get("xyz", "0 0 0") + (f"; rpy {turned}" if turned else ""), xyz
    yield "inertia", " ".join(inertia.get(key, "0") for key in INERTIA_KEYS), moments
    mass.set("value", repr(link.mass))
    origin.attrib |= {"xyz": xyz} | ({"rpy": "0 0 0"} if turned else {})
    inertia.attrib |= dict(zip(INERTIA_KEYS, moments.split(), strict=True))


def _mjcf_joints(root: ET.Element) -> dict[str, _Joint]:
    """Joints with a name in this file."""
    classes, found = default_classes(root), dict[str, _Joint]()
    drives = [drive for section in root.findall("actuator") for drive in section.iter() if drive.tag in ACTUATORS]

    def stated(element: ET.Element, inherited: str, attribute: str) -> str | None:
        """Return an attribute of an element or of its class, which has one entry for all kinds of actuators."""
        same = ACTUATORS if element.tag in ACTUATORS else (element.tag,)
        of_class = [each for each in classes.get(element.get("class") or inherited, ()) if each.tag in same]
        return next((x.attrib[attribute] for x in (element, *reversed(of_class)) if attribute in x.attrib), None)

    def add(parent: ET.Element, inherited: str) -> None:
        for child in parent:
            if child.tag != "joint":
                add(child, child.get("childclass") or inherited)
                continue
            name = child.get("name", "")
            limits = [(child, inherited, "actuatorfrcrange")]
            for drive in drives:
                if name in (drive.get("joint"), drive.get("jointinparent")):
                    limits += [(drive, MAIN, key) for key in ("forcerange", *(["ctrlrange"] * (drive.tag == "motor")))]
            efforts = [("effort", each, key, stated(each, of, key)) for each, of, key in limits]
            places: list[Place] = [each for each in efforts if each[3] is not None]
            places = places or [("effort", None, "forcerange", None)]
            for which, key in (("damping", "damping"), ("friction", "frictionloss"), ("armature", "armature")):
                places.append((which, child, key, stated(child, inherited, key)))
            found[name] = _Joint(child, parent, places)

    for world in root.findall("worldbody"):
        add(world, MAIN)
    return found


def _mjcf_inertial(inertial: ET.Element, link: Link) -> Iterator[tuple[str, str | None, str]]:
    before, moments = dict(inertial.attrib), _numbers([value for _, value in link.inertia])
    others = {name: value for name, value in before.items() if name not in ("mass", "pos")}
    before["fullinertia"] = " ".join(x if name == "fullinertia" else f"{name} {x}" for name, x in others.items())
    inertial.attrib = {"mass": repr(link.mass), "pos": _numbers(link.com), "fullinertia": moments}
    yield from ((f"inertial {name}", before.get(name) or None, after) for name, after in inertial.attrib.items())


FORMATS = {
    "robot": _Format(_urdf_joints, _urdf_inertial, armature=False),
    "mujoco": _Format(_mjcf_joints, _mjcf_inertial, armature=True),
}
"""Formats by the name of the root element."""
