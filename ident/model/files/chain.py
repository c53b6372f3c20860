"""The part of a robot model that is the arm: what leads from the base to the flange, where there is more.

A gripper, a second arm or a table with a cup on it stands in many model files. With the flange named, joints that do
not lead to it are taken as held where they are drawn, and the bodies behind them are no part of the kinematics: what
they state is not looked at. Without, bodies that float freely beside the arm are no part of it.
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
"""What to do about a joint that a serial arm has not."""
JOINTS = ("joint", "freejoint")
MANIFOLD = ("frame", "replicate", "composite", "flexcomp", "attach")
"""Elements that MuJoCo turns into bodies, and Pinocchio leaves out."""
ENDS = {"joint": ("joint1", "joint2"), "tendon": ("tendon1", "tendon2")}
"""What an equality of MJCF ties, by its kind; others tie two bodies, or two sites."""


def without_objects(root: Element) -> Element:
    """An MJCF tree without the outermost bodies that float freely and have no joint but that."""
    return _each_outermost(root, lambda child: None if child.tag == "body" and _is_object(child) else child)


def to_flange(root: Element, flange: str) -> Element:
    """An MJCF tree with those bodies alone that lead from the world to a flange.

    Raises:
        RobotModelError: If no body has that name.
    """
    worlds = root.all("worldbody")
    _refuse_unknown(root, flange, [e.attributes.get("name", "") for w in worlds for e in w.walk() if e.tag == "body"])
    return _each_outermost(root, lambda child: _leading(child, flange))


def refuse_ties(root: Element, flange: str | None) -> None:
    """Refuse equalities of an MJCF tree that tie joints that move, of which only those to a flange do.

    Raises:
        RobotModelError: Naming the equality.
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
    kept = [e for e in root.children if e in joints or (e.tag == "link" and e.attributes.get("name") in links)]
    return replace(root, children=kept)


def _refuse_unknown(root: Element, flange: str, known: list[str]) -> None:
    if flange not in known:
        raise RobotModelError(f"{root.title}: flange {shown(flange)}: no body has that name{nearest(flange, known)}")


def _each_outermost(root: Element, kept: Callable[[Element], Element | None]) -> Element:
    """The tree with each element of the world replaced by what is kept of it."""

    def world(element: Element) -> Element:
        return replace(element, children=[found for child in element.children if (found := kept(child)) is not None])

    return replace(root, children=[world(e) if e.tag == "worldbody" else e for e in root.children])


def _leading(element: Element, flange: str) -> Element | None:
    """An element with what leads to a flange alone of what it carries; None of a body that does not lead there."""
    if element.tag not in ("body", *MANIFOLD):
        return element
    at_end = element.tag == "body" and element.attributes.get("name") == flange
    inside = [None if at_end and _carries(child) else _leading(child, flange) for child in element.children]
    leads = at_end or any(found is not None and _carries(found) for found in inside)
    return replace(element, children=[found for found in inside if found is not None]) if leads else None


def _carries(element: Element) -> bool:
    return element.tag in ("body", *MANIFOLD)


def _moving(root: Element, flange: str) -> tuple[set[str], dict[tuple[str, str], int]]:
    """What moves with all but the joints to a flange held.

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
    """Whether an equality ties only what is held: joints that do not move, or bodies that move as one."""
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
    """Whether a body has a free joint of its own and nothing else that moves."""
    free = [j for j in body.all(*JOINTS) if j.tag == "freejoint" or j.attributes.get("type") == "free"]
    return bool(free) and sum(e.tag in JOINTS for e in body.walk()) == len(free)


def _end(joint: Element, end: str) -> str:
    return next((part.attributes.get("link", "") for part in joint.all(end)), "")
