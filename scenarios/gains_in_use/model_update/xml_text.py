"""The start tags of an XML file with their places in it, so that attributes change and every other byte stays.

A library that parses and writes anew would lose comments before the root, the order and the white space of what it
does not touch; a difference between both files should be what was changed.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from xml.parsers import expat

from scenarios.support.errors import ScenarioError

START = re.compile(rb"<[^\s/>]+(?:\s+[^\s=]+\s*=\s*(?:\"[^\"]*\"|'[^']*'))*\s*/?>")
ATTRIBUTE = re.compile(rb"\s+([^\s=]+)\s*=\s*(\"[^\"]*\"|'[^']*')")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tag:
    """A start tag.

    Attributes:
        name: Of the element.
        attributes: By name.
        start: Place of `<` [bytes].
        end: Place behind `>` [bytes].
        parent: Number of the tag around it, None for the root.
    """

    name: str
    attributes: dict[str, str]
    start: int
    end: int
    parent: int | None


@dataclass(frozen=True, slots=True)
class Edit:
    """Bytes from `start` to `end` become `text`."""

    start: int
    end: int
    text: str


def start_tags(content: bytes, where: str) -> tuple[Tag, ...]:
    """The start tags in their order.

    Args:
        content: Of a file that has been read as a model before.
        where: The file, for messages.

    Raises:
        ScenarioError: If characters are not bytes that can be edited in place, as UTF-16.
    """
    parser, tags, inside = expat.ParserCreate(), list[Tag](), list[int]()

    def start(name: str, attributes: dict[str, str]) -> None:
        at = parser.CurrentByteIndex
        found = START.match(content, at)
        if found is None:
            raise ScenarioError(f"{where}: {name}: the text cannot be edited in place; save the file as UTF-8")
        parent = inside[-1] if inside else None
        inside.append(len(tags))
        tags.append(Tag(name=name, attributes=attributes, start=at, end=found.end(), parent=parent))

    def end(name: str) -> None:
        inside.pop()

    parser.StartElementHandler, parser.EndElementHandler = start, end
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise ScenarioError(f"{where}: not XML: {expat.ErrorString(error.code)} in line {error.lineno}") from error
    return tuple(tags)


def attribute_edit(content: bytes, tag: Tag, name: str, value: str) -> Edit:
    """The edit that gives an attribute a value, there or not yet; the value needs no escapes."""
    for found in ATTRIBUTE.finditer(content, tag.start, tag.end):
        if found[1] == name.encode():
            return Edit(found.start(2) + 1, found.end(2) - 1, value)
    at = tag.end - (2 if is_empty(content, tag) else 1)
    at -= len(content[tag.start : at]) - len(content[tag.start : at].rstrip())
    return Edit(at, at, f' {name}="{value}"')


def child_edit(content: bytes, parent: Tag, text: str) -> Edit:
    """The edit that puts an element into another one as its first, in a line of its own where the others are."""
    if is_empty(content, parent):
        return Edit(parent.end - 2, parent.end, f">{text}</{parent.name}>")
    space = re.compile(rb"\s*").match(content, parent.end)
    before = b"" if space is None or b"\n" not in space[0] else space[0]
    return Edit(parent.end, parent.end, before.decode() + text)


def edited(content: bytes, edits: Iterable[Edit]) -> bytes:
    """The text with edits that do not overlap made."""
    parts, at = list[bytes](), 0
    for edit in sorted(edits, key=lambda each: each.start):
        parts += [content[at : edit.start], edit.text.encode()]
        at = edit.end
    return b"".join([*parts, content[at:]])


def numbers(values: Iterable[float]) -> str:
    """Numbers as an attribute has several, every digit of each."""
    return " ".join(map(repr, values))


def comment_edit(content: bytes, parent: Tag, text: str) -> Edit:
    """The edit that puts a comment into an element as its first."""
    return child_edit(content, parent, f"<!-- {text} -->")


def is_empty(content: bytes, tag: Tag) -> bool:
    """Whether an element ends with its start tag."""
    return content[tag.end - 2 : tag.end] == b"/>"
