"""XML of robot models as an `ElementTree` whose elements know their lines.

Files are bounded in size and depth and have no entities: they go to C++ readers that recurse into them.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree as ET
from xml.parsers import expat

from ident.support.errors import RobotModelError
from ident.support.files import read_bytes
from ident.support.naming import nearest, one_line, shown

LARGEST_FILE = 8_000_000
"""Largest size of a model file [bytes]."""
DEEPEST = 200
"""Largest nesting depth of elements."""
LARGEST = 1e6
"""Largest number; angles in degrees stay far below."""
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")


class _Located(ET.Element):
    """An element with its file and line."""

    where = ""


def read_xml(path: Path) -> ET.Element:
    """Return the root element of an XML file, as `read_document`."""
    return read_document(path)[0]


def read_document(path: Path, *, comments: bool = False) -> ET.Element:
    """Read an XML file: an element around its root, and its comments; refuses what is none, too large or deep."""
    content = read_bytes(path, most_bytes=LARGEST_FILE, error=RobotModelError)
    parser = expat.ParserCreate()
    builder = ET.TreeBuilder(element_factory=_Located, insert_comments=comments)
    file, depth = f"robot model {one_line(path)}", 0

    def refuse(why: str) -> None:
        raise RobotModelError(f"{file}: line {parser.CurrentLineNumber}: {why}")

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > DEEPEST:
            refuse(f"elements are nested deeper than {DEEPEST}")
        element = builder.start(tag, attributes)
        assert isinstance(element, _Located)
        element.where = f"{file}: line {parser.CurrentLineNumber}"

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def doctype(*_: object) -> None:
        refuse("document type declarations are not supported; remove this one")

    builder.start("document", {})
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler, parser.CommentHandler = builder.data, builder.comment
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        reason = expat.errors.messages[error.code]
        raise RobotModelError(
            f"{file}: line {error.lineno}, column {error.offset + 1}: not XML in UTF-8: {reason}"
        ) from error
    except RobotModelError:
        raise
    except (ValueError, LookupError) as error:
        raise RobotModelError(f"{file}: not XML: {one_line(error)}") from error
    builder.end("document")
    return builder.close()


def where(element: ET.Element) -> str:
    """Return file and line, for messages."""
    return element.where if isinstance(element, _Located) else ""


def title(element: ET.Element) -> str:
    """Return file, line, tag and name, for messages."""
    name = element.get("name")
    return f"{where(element)}: {element.tag}" + (f" {one_line(name)!r}" if name is not None else "")


def check_attributes(element: ET.Element, known: Mapping[str, int]) -> None:
    """Refuse attributes that are nearly missing ones, and wrong numbers, whose count is in `known`, 0 for a word."""
    missing = known.keys() - element.attrib.keys()
    for attribute in element.attrib:
        if attribute not in known and (close := nearest(attribute, sorted(missing))):
            raise RobotModelError(f"{title(element)}: unknown attribute {shown(attribute)}{close}")
    for attribute, count in known.items():
        if count:
            vector(element, attribute, count)


def vector(element: ET.Element, attribute: str, count: int) -> tuple[float, ...] | None:
    """Return the checked numbers of an attribute, None without it; `RobotModelError` names line, element and word."""
    text = element.get(attribute)
    if text is None:
        return None
    words, what = text.split(), f"{title(element)}: {attribute} = {shown(text)}"
    for word in words:
        if not _NUMBER.fullmatch(word):
            separated = "; numbers are separated by spaces" if "," in word or ";" in word else ""
            raise RobotModelError(f"{what}: {shown(word)} is not a number{separated}")
    if len(words) != count:
        raise RobotModelError(f"{what}: {len(words)} numbers, expected {count}")
    values = tuple(float(word) for word in words)
    if not all(abs(value) <= LARGEST for value in values):
        raise RobotModelError(f"{what}: beyond {LARGEST:g}; check the number and its unit")
    return values
