"""Changes of joints, actuators and links of an MJCF file, with attributes of default classes.

Damping, friction loss and armature are written into the joint itself, overriding its class. Effort limits are
`actuatorfrcrange` of the joint, `forcerange` of its actuators, and `ctrlrange` of a `motor`, whose control is a force.
A link has `inertial` of its body and `armature` of its joint.
"""

from collections.abc import Iterator, Mapping, Sequence

from ident.model.files.xml_tree import Element
from scenarios.gains_in_use.model_update.edits import (
    Change,
    Edit,
    ModelText,
    Patched,
    known_attribute,
    numbers,
    scaled_effort,
)
from scenarios.gains_in_use.model_update.link_values import COMMENT, LinkValues
from scenarios.gains_in_use.model_update.values import JointValues
from scenarios.support.errors import ScenarioError

NOT_THERE = "the file has no joint of this name; it may be in an included file"
MAIN = "main"
ACTUATORS = ("general", "motor", "position", "velocity", "intvelocity", "damper", "cylinder", "muscle", "dcmotor")
SCALING = ("settotalmass", "boundmass", "boundinertia")
"""Settings of the compiler that, if positive, override values of `inertial`."""
Defaults = Mapping[tuple[str, str], Mapping[str, str]]
"""Attributes by default class and element, including those of enclosing classes."""


def mjcf_changes(file: ModelText, joints: Sequence[JointValues]) -> list[Patched]:
    """Return the changes of an MJCF file; as `urdf_changes`, but a joint without a name in the file is unchanged."""
    defaults = _defaults(file.root)
    bodies = {joint.attributes.get("name", ""): (joint, inherited) for _, joint, inherited in _joints(file)}
    drives = [drive for section in file.root.all("actuator") for drive in section.walk() if drive.tag in ACTUATORS]
    found = list[Patched]()
    for joint in joints:
        if joint.name not in bodies:
            found.append(Patched(Change(joint=joint.name, attribute="joint", before=None, reason=NOT_THERE)))
            continue
        element, inherited = bodies[joint.name]
        found += _efforts(file, element, inherited, drives, defaults, joint)
        found += [
            known_attribute(file, element, joint.name, name, _resolved(element, inherited, name, defaults), known)
            for name, known in (
                ("damping", joint.damping),
                ("frictionloss", joint.friction),
                ("armature", joint.armature),
            )
            if known is not None
        ]
    return found


def _joints(file: ModelText) -> Iterator[tuple[Element, Element, str]]:
    """Return joints of the worldbody with their bodies and classes."""

    def walk(parent: Element, inherited: str) -> Iterator[tuple[Element, Element, str]]:
        for child in parent.children:
            if child.tag == "joint":
                yield parent, child, inherited
            else:
                yield from walk(child, child.attributes.get("childclass") or inherited)

    for world in file.root.all("worldbody"):
        yield from walk(world, MAIN)


def _resolved(element: Element, inherited: str, attribute: str, defaults: Defaults) -> str | None:
    """Return an attribute of an element or of its class."""
    own = element.attributes.get("class") or inherited
    return element.attributes.get(attribute, defaults.get((own, _kind(element)), {}).get(attribute))


def _efforts(
    file: ModelText, joint: Element, inherited: str, drives: Sequence[Element], defaults: Defaults, values: JointValues
) -> list[Patched]:
    """Return all effort limits of a joint in the file, or a single remark if there are none."""
    name = values.name
    stated = [(joint, inherited, "actuatorfrcrange")]
    for drive in drives:
        if name in (drive.attributes.get("joint"), drive.attributes.get("jointinparent")):
            stated += [(drive, MAIN, key) for key in ("forcerange", *(["ctrlrange"] if drive.tag == "motor" else []))]
    found = [
        scaled_effort(file, element, name, attribute, before, values.effort)
        for element, inside, attribute in stated
        if (before := _resolved(element, inside, attribute, defaults)) is not None
    ]
    return found or [scaled_effort(file, None, name, "forcerange", None, values.effort)]


def _kind(element: Element) -> str:
    """Kind of an element; default classes have one entry for all kinds of actuators."""
    return "actuator" if element.tag in ACTUATORS else element.tag


def _defaults(root: Element) -> Defaults:
    """Return attributes of default classes, including those of enclosing classes."""
    found: dict[tuple[str, str], dict[str, str]] = {}

    def add(section: Element, around: str | None) -> None:
        name = section.attributes.get("class", MAIN)
        for (outer, kind), attributes in list(found.items()):
            if outer == around:
                found[name, kind] = {**attributes, **found.get((name, kind), {})}
        for child in section.children:
            if child.tag != "default":
                found.setdefault((name, _kind(child)), {}).update(child.attributes)
        for inner in section.all("default"):
            add(inner, name)

    for section in root.all("default"):
        add(section, None)
    return found


def mjcf_link_changes(file: ModelText, links: Sequence[LinkValues]) -> list[Patched]:
    """Return the changes of the links of an MJCF file.

    Raises:
        ScenarioError: If a joint is not in the file itself, or its compiler options override inertias.
    """
    for compiler in file.root.all("compiler"):
        given = compiler.attributes
        over = [name for name in SCALING if float(given.get(name, "0")) > 0.0]
        over += ["inertiafromgeom"] if given.get("inertiafromgeom") == "true" else []
        if over:
            raise ScenarioError(
                f"compiler {over[0]} = {given[over[0]]!r} would override the masses that bodies state; remove it first"
            )
    bodies = {joint.attributes.get("name", ""): (body, joint) for body, joint, _ in _joints(file)}
    found = list[Patched]()
    for each in links:
        if each.joint not in bodies:
            raise ScenarioError(
                f"joint {each.joint}: the file has no joint of this name, so its link cannot be written"
            )
        found += _link(file, *bodies[each.joint], each)
    comment = file.child(file.root, f"<!-- {COMMENT.format(elsewhere='')} -->")
    found[0] = Patched(found[0].change, (*found[0].edits, comment))
    return found


def _link(file: ModelText, body: Element, joint: Element, link: LinkValues) -> list[Patched]:
    old = next(iter(body.all("inertial")), None)
    stated = {"mass": repr(link.mass), "pos": numbers(link.com), "fullinertia": numbers(link.inertia)}
    text = "<inertial" + "".join(f' {name}="{value}"' for name, value in stated.items())
    if old is None:
        edit = file.child(body, f"{text}/>")
    else:
        edit = Edit(old.start, file.end(old), text + ("/>" if file.is_empty(old) else ">"))
    before = {} if old is None else dict(old.attributes)
    before["fullinertia"] = " ".join(
        f"{name} {value}" if name != "fullinertia" else value
        for name, value in before.items()
        if name not in ("mass", "pos")
    )
    found = [
        Patched(
            Change(joint=link.joint, attribute=f"inertial {name}", before=before.get(name) or None, after=value),
            (edit,) if name == "mass" else (),
        )
        for name, value in stated.items()
    ]
    if link.motor is not None:
        after = repr(link.motor)
        change = Change(joint=link.joint, attribute="armature", before=joint.attributes.get("armature"), after=after)
        found.append(Patched(change, (file.attribute(joint, "armature", after),)))
    return found
