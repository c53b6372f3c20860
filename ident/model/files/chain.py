"""Reduction of a robot model to the chain from base to flange.

Many model files contain a gripper, a second arm or other objects. If the flange is named, joints outside the chain to
it are locked at their initial positions, and bodies behind them are ignored. Otherwise, only free-floating bodies are
ignored.
"""

from collections.abc import Callable
from dataclasses import replace

from ident.model.files.xml_tree import Element
from ident.support.errors import RobotModelError
from ident.support.naming import nearest, shown

NAME_IT = (
    "if it is not part of the arm, name the arm's last body as flange (in robot.toml, or --flange): joints outside the "
    "chain to it are locked"
)
"""Advice for a joint that a serial arm cannot have."""
JOINTS = ("joint", "freejoint")
MANIFOLD = ("frame", "replicate", "composite", "flexcomp", "attach")
"""Elements that MuJoCo expands to bodies and Pinocchio ignores."""
ENDS = {"joint": ("joint1", "joint2"), "tendon": ("tendon1", "tendon2")}
"""Objects that an equality of MJCF constrains, by kind; others constrain two bodies or two sites."""


def without_objects(root: Element) -> Element:
    """Return an MJCF tree without top-level bodies whose only joint is a free joint."""
    return _each_outermost(root, lambda child: None if child.tag == "body" and _is_object(child) else child)


def to_flange(root: Element, flange: str) -> Element:
    """Return an MJCF tree with only the bodies of the chain from the world to a flange.

    Raises:
        RobotModelError: If no body has that name.
    """
    worlds = root.all("worldbody")
    _refuse_unknown(root, flange, [e.attributes.get("name", "") for w in worlds for e in w.walk() if e.tag == "body"])
    return _each_outermost(root, lambda child: _leading(child, flange))


def refuse_ties(root: Element, flange: str | None) -> None:
    """Refuse equalities of an MJCF tree that constrain moving joints (those of the chain to a flange).

    Raises:
        RobotModelError: If there is one; the message names it.
    """
    joints, moved = (set[str](), dict[tuple[str, str], int]()) if flange is None else _moving(root, flange)
    for section in root.all("equality"):
        for tie in section.all("connect", "weld", *ENDS):
            held = flange is not None and _is_held(tie, root, joints, moved)
            if tie.attributes.get("active", "true") != "false" and not held:
                raise RobotModelError(
                    f"{tie.title}: an equality of kind {tie.tag} ties joints; only arms with a drive on every joint "
                    f"and no closed loop are read; {NAME_IT}"
                )


def urdf_to_flange(root: Element, flange: str) -> Element:
    """Return a URDF tree with only the links and joints of the chain from the base to a flange.

    Raises:
        RobotModelError: If no link has that name.
    """
    _refuse_unknown(root, flange, [link.attributes.get("name", "") for link in root.all("link")])
    above = {_end(joint, "child"): joint for joint in root.all("joint")}
    joints, links = list[Element](), [flange]
    while links[-1] in above and above[links[-1]] not in joints:
        joints.append(above[links[-1]])
        links.append(_end(joints[-1], "parent"))
    kept = [e for e in root.children if e in joints or (e.tag == "link" and e.attributes.get("name") in links)]
    return replace(root, children=kept)


def _refuse_unknown(root: Element, flange: str, known: list[str]) -> None:
    if flange not in known:
        raise RobotModelError(f"{root.title}: flange {shown(flange)}: no body has that name{nearest(flange, known)}")


def _each_outermost(root: Element, kept: Callable[[Element], Element | None]) -> Element:
    """Return the tree with reduced elements of the world."""

    def world(element: Element) -> Element:
        return replace(element, children=[found for child in element.children if (found := kept(child)) is not None])

    return replace(root, children=[world(e) if e.tag == "worldbody" else e for e in root.children])


def _leading(element: Element, flange: str) -> Element | None:
    """Return an element with only the chain to a flange; None for a body outside the chain."""
    if element.tag not in ("body", *MANIFOLD):
        return element
    at_end = element.tag == "body" and element.attributes.get("name") == flange
    inside = [None if at_end and _carries(child) else _leading(child, flange) for child in element.children]
    leads = at_end or any(found is not None and _carries(found) for found in inside)
    return replace(element, children=[found for found in inside if found is not None]) if leads else None


def _carries(element: Element) -> bool:
    return element.tag in ("body", *MANIFOLD)


def _moving(root: Element, flange: str) -> tuple[set[str], dict[tuple[str, str], int]]:
    """Return the moving parts with all joints outside the chain to a flange locked.

    Returns:
        Names of the joints, and the number of joints between the world and each body or site, by kind and name.
    """
    joints, moved = set[str](), {("body", "world"): 0}

    def walk(element: Element, count: int) -> None:
        for child in element.children:
            if child.tag == "body":
                own = child.all(*JOINTS) if _leading(child, flange) is not None else []
                joints.update(joint.attributes.get("name", "") for joint in own)
                moved["body", child.attributes.get("name", "")] = count + len(own)
                walk(child, count + len(own))
            elif child.tag == "site":
                moved["site", child.attributes.get("name", "")] = count
            else:
                walk(child, count)

    for world in root.all("worldbody"):
        walk(world, 0)
    return joints, moved


def _is_held(tie: Element, root: Element, joints: set[str], moved: dict[tuple[str, str], int]) -> bool:
    """Return whether an equality constrains only locked joints, or bodies without relative motion."""
    given = tie.attributes
    ends = [given[key] for key in ENDS.get(tie.tag, ()) if key in given]
    if tie.tag == "joint":
        return joints.isdisjoint(ends)
    if tie.tag == "tendon":
        fixed = [t for section in root.all("tendon") for t in section.all("fixed") if t.attributes.get("name") in ends]
        used = {joint.attributes.get("joint", "") for tendon in fixed for joint in tendon.all("joint")}
        return len(fixed) == len(set(ends)) and joints.isdisjoint(used)
    kind = "body" if "body1" in given else "site"
    first, second = (moved.get((kind, given.get(f"{kind}{number}", "world"))) for number in (1, 2))
    return first is not None and first == second


def _is_object(body: Element) -> bool:
    """Return whether a body has a free joint and no other moving part."""
    free = [j for j in body.all(*JOINTS) if j.tag == "freejoint" or j.attributes.get("type") == "free"]
    return bool(free) and sum(e.tag in JOINTS for e in body.walk()) == len(free)


def _end(joint: Element, end: str) -> str:
    return next((part.attributes.get("link", "") for part in joint.all(end)), "")
