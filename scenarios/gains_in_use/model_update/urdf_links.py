"""Links of a URDF: `inertial` with `origin`, `mass` and `inertia`, axes of the link."""

from collections.abc import Sequence

from ident.payload.payload import INERTIA_KEYS
from scenarios.gains_in_use.model_update.link_values import COMMENT, LinkValues
from scenarios.gains_in_use.model_update.places import Change, Patched, left
from scenarios.gains_in_use.model_update.urdf import NO_ARMATURE
from scenarios.gains_in_use.model_update.xml_text import Edit, Tag, attribute_edit, child_edit, comment_edit, numbers
from scenarios.support.errors import ScenarioError

PARTS = ("mass", "inertia")


def urdf_link_changes(content: bytes, tags: Sequence[Tag], links: Sequence[LinkValues]) -> list[Patched]:
    """What becomes of the links of a URDF.

    Args:
        content: The file.
        tags: Its start tags.
        links: What is known.

    Raises:
        ScenarioError: If a link states no mass and inertia.
    """
    outermost = [k for k, tag in enumerate(tags) if tag.parent is not None and tags[tag.parent].parent is None]
    joints = {tags[k].attributes.get("name", ""): k for k in outermost if tags[k].name == "joint"}
    named = {tags[k].attributes.get("name", ""): k for k in outermost if tags[k].name == "link"}
    found = list[Patched]()
    for each in links:
        child = next(tag for tag in tags if tag.parent == joints[each.joint] and tag.name == "child")
        found += _link(content, tags, named[child.attributes["link"]], each)
    said = COMMENT.format(elsewhere=", of which URDF has none")
    found[0] = Patched(found[0].change, (*found[0].edits, comment_edit(content, tags[0], said)))
    return found


def _link(content: bytes, tags: Sequence[Tag], at: int, link: LinkValues) -> list[Patched]:
    inertial = next((k for k, tag in enumerate(tags) if tag.parent == at and tag.name == "inertial"), None)
    parts = {tag.name: tag for tag in tags if inertial is not None and tag.parent == inertial}
    if inertial is None or any(part not in parts for part in PARTS):
        raise ScenarioError(f"link {tags[at].attributes.get('name')}: states no mass and inertia")
    xyz = numbers(link.com)
    origin = parts.get("origin")
    before = "0 0 0" if origin is None else origin.attributes.get("xyz", "0 0 0")
    turned = "" if origin is None else origin.attributes.get("rpy", "")
    place = (
        (child_edit(content, tags[inertial], f'<origin xyz="{xyz}"/>'),)
        if origin is None
        else (
            attribute_edit(content, origin, "xyz", xyz),
            *([attribute_edit(content, origin, "rpy", "0 0 0")] if turned else []),
        )
    )
    six = dict(zip(INERTIA_KEYS, map(repr, link.inertia), strict=True))
    moments = tuple(attribute_edit(content, parts["inertia"], name, text) for name, text in six.items())
    stated = " ".join(parts["inertia"].attributes.get(name, "0") for name in INERTIA_KEYS)
    mass = attribute_edit(content, parts["mass"], "value", repr(link.mass))
    found = [
        _changed(link, "mass", parts["mass"].attributes.get("value"), repr(link.mass), (mass,)),
        _changed(link, "inertial origin", f"{before}; rpy {turned}" if turned else before, xyz, place),
        _changed(link, "inertia", stated, numbers(link.inertia), moments),
    ]
    if link.motor is not None:
        found.append(left(link.joint, "armature", None, f"{NO_ARMATURE}; found {link.motor:.4g}"))
    return found


def _changed(link: LinkValues, attribute: str, before: str | None, after: str, edits: tuple[Edit, ...]) -> Patched:
    return Patched(Change(joint=link.joint, attribute=attribute, before=before, after=after), edits)
