"""Links of an MJCF file: `inertial` of a body, and `armature` of its joint."""

from collections.abc import Sequence

from scenarios.gains_in_use.model_update.link_values import COMMENT, LinkValues
from scenarios.gains_in_use.model_update.places import Change, Patched
from scenarios.gains_in_use.model_update.xml_text import (
    Edit,
    Tag,
    attribute_edit,
    child_edit,
    comment_edit,
    is_empty,
    numbers,
)
from scenarios.support.errors import ScenarioError

SCALING = ("settotalmass", "boundmass", "boundinertia")
"""Settings of the compiler that change what an `inertial` states, where they are positive."""


def mjcf_link_changes(content: bytes, tags: Sequence[Tag], links: Sequence[LinkValues]) -> list[Patched]:
    """What becomes of the links of an MJCF file.

    Args:
        content: The file.
        tags: Its start tags.
        links: What is known.

    Raises:
        ScenarioError: If a joint is not in the file itself, or its compiler would change what is stated.
    """
    _check_compiler(tags)
    joints = {tag.attributes.get("name", ""): tag for tag in tags if tag.name == "joint" and _in_body(tags, tag)}
    found = list[Patched]()
    for each in links:
        joint = joints.get(each.joint)
        if joint is None or joint.parent is None:
            raise ScenarioError(
                f"joint {each.joint}: the file has no joint of this name, so its link cannot be written"
            )
        found += _link(content, tags, joint, joint.parent, each)
    said = COMMENT.format(elsewhere="")
    found[0] = Patched(found[0].change, (*found[0].edits, comment_edit(content, tags[0], said)))
    return found


def _check_compiler(tags: Sequence[Tag]) -> None:
    for tag in tags:
        given = tag.attributes if tag.name == "compiler" else {}
        found = [name for name in SCALING if float(given.get(name, "0")) > 0.0]
        found += ["inertiafromgeom"] if given.get("inertiafromgeom") == "true" else []
        if found:
            raise ScenarioError(
                f"compiler {found[0]} = {given[found[0]]!r} would override the masses that bodies state; "
                "remove it first"
            )


def _in_body(tags: Sequence[Tag], tag: Tag) -> bool:
    return tag.parent is not None and tags[tag.parent].name == "body"


def _link(content: bytes, tags: Sequence[Tag], joint: Tag, at: int, link: LinkValues) -> list[Patched]:
    tag = next((tag for tag in tags if tag.parent == at and tag.name == "inertial"), None)
    stated = {"mass": repr(link.mass), "pos": numbers(link.com), "fullinertia": numbers(link.inertia)}
    text = "<inertial" + "".join(f' {name}="{value}"' for name, value in stated.items())
    if tag is None:
        edit = child_edit(content, tags[at], f"{text}/>")
    else:
        edit = Edit(tag.start, tag.end, text + ("/>" if is_empty(content, tag) else ">"))
    before = {} if tag is None else dict(tag.attributes)
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
        found.append(Patched(change, (attribute_edit(content, joint, "armature", after),)))
    return found
