"""The part of a robot model that is the arm: what leads from the base to the flange, where there is more.

A gripper, a second arm or a table with a cup on it stands in many model files. With the flange named, joints that do
not lead to it are taken as held where they are drawn, and the bodies behind them are no part of the kinematics.
Without, bodies that float freely beside the arm are no part of it.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

from ident.model.files.xml_tree import Element
from ident.support.errors import RobotModelError
from ident.support.naming import nearest, shown

NAME_IT = (
    "if it is no part of the arm, name the arm's last body as flange (in robot.toml, or --flange): joints that do not "
    "lead there are held"
)
"""What to do about a joint that a serial arm has not."""
JOINTS = ("joint", "freejoint")
WORLD = "world"


@dataclass(frozen=True, slots=True)
class Reach:
    """What moves in an MJCF tree whose joints are held but for those that lead to a flange.

    Attributes:
        moved_by: Number of moving joints between the world and each body, by its name.
        joints: Names of those joints.
    """

    moved_by: dict[str, int]
    joints: frozenset[str]


def without_objects(root: Element) -> Element:
    """An MJCF tree without the outermost bodies that float freely and have no joint but that."""
    return _each_outermost(root, lambda body: None if _is_object(body) else body)


def to_flange(root: Element, flange: str) -> Element:
    """An MJCF tree with those bodies alone that lead from the world to a flange.

    Raises:
        RobotModelError: If no body has that name.
    """
    _refuse_unknown(root, flange, [name for world in root.all("worldbody") for name in _names(world)])
    return _each_outermost(root, lambda body: _leading(body, flange))


def reach(root: Element, flange: str) -> Reach:
    """What moves in an MJCF tree with all but the joints to a flange held."""
    found, joints = {WORLD: 0}, set[str]()

    def walk(element: Element, moved: int) -> None:
        for body in element.all("body"):
            leads = _leading(body, flange) is not None
            own = body.all(*JOINTS) if leads else []
            joints.update(joint.attributes.get("name", "") for joint in own)
            found[body.attributes.get("name", "")] = moved + len(own)
            walk(body, moved + len(own))

    for world in root.all("worldbody"):
        walk(world, 0)
    return Reach(found, frozenset(joints))


def urdf_to_flange(root: Element, flange: str) -> Element:
    """A URDF tree with those links and joints alone that lead from the base to a flange.

    Raises:
        RobotModelError: If no link has that name.
    """
    _refuse_unknown(root, flange, [link.attributes.get("name", "") for link in root.all("link")])
    above = {_end(joint, "child"): joint for joint in root.all("joint")}
    joints, links = list[Element](), [flange]
    while links[-1] in above and above[links[-1]] not in joints:
        joints.append(above[links[-1]])
        links.append(_end(joints[-1], "parent"))

    def kept(child: Element) -> bool:
        if child.tag == "joint":
            return child in joints
        return child.tag != "link" or child.attributes.get("name") in links

    return replace(root, children=[child for child in root.children if kept(child)])


def _refuse_unknown(root: Element, flange: str, known: list[str]) -> None:
    if flange not in known:
        raise RobotModelError(f"{root.title}: flange {shown(flange)}: no body has that name{nearest(flange, known)}")


def _names(element: Element) -> list[str]:
    inside = element.all("body")
    return [body.attributes.get("name", "") for body in inside] + [name for body in inside for name in _names(body)]


def _each_outermost(root: Element, kept: Callable[[Element], Element | None]) -> Element:
    """The tree with each outermost body replaced by what is kept of it."""

    def world(element: Element) -> Element:
        found = [kept(child) if child.tag == "body" else child for child in element.children]
        return replace(element, children=[child for child in found if child is not None])

    return replace(root, children=[world(e) if e.tag == "worldbody" else e for e in root.children])


def _leading(body: Element, flange: str) -> Element | None:
    """A body with that alone of what it carries which leads to a flange; None if it does not lead there."""
    rest = [child for child in body.children if child.tag != "body"]
    if body.attributes.get("name") == flange:
        return replace(body, children=rest)
    for inner in body.all("body"):
        found = _leading(inner, flange)
        if found is not None:
            return replace(body, children=[*rest, found])
    return None


def _is_object(body: Element) -> bool:
    """Whether a body has a free joint of its own and nothing else that moves."""
    free = [j for j in body.all(*JOINTS) if j.tag == "freejoint" or j.attributes.get("type") == "free"]
    return bool(free) and _joints_below(body) == len(free)


def _joints_below(body: Element) -> int:
    return len(body.all(*JOINTS)) + sum(_joints_below(inner) for inner in body.all("body"))


def _end(joint: Element, end: str) -> str:
    return next((part.attributes.get("link", "") for part in joint.all(end)), "")
