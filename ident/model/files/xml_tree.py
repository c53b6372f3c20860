"""XML of robot models: elements with lines, numbers of attributes, and the reduced model.

Files are bounded in size and depth and have no entities: they go to C++ readers that recurse into them.
"""

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from ident.support.errors import RobotModelError
from ident.support.file_access import read_bytes
from ident.support.naming import one_line, shown

LARGEST_FILE = 32_000_000
"""Largest size of a model file [bytes]."""
DEEPEST = 200
"""Largest nesting depth of elements."""
MOST_ELEMENTS = 200_000
FARTHEST = 50.0
"""Largest plausible distance between neighbouring frames [m]."""
LARGEST = 1e6
"""Largest number of any other kind; angles in degrees and components of directions stay far below."""
SHORTEST = 1e-6
"""Length below which a vector has no direction."""
EARTH = (0.0, 0.0, -9.81)
"""Gravity of a model that states none [m/s^2]."""
ESCAPED = str.maketrans({each: f"&#{ord(each)};" for each in '&<>"\n\r\t'})
"""Escapes of attribute values; `xml.sax.saxutils` would import a web client."""
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_DECLARED = re.compile(rb"\s*<\?xml[^>]*\sencoding")


@dataclass(frozen=True, slots=True, eq=False)
class Element:
    """An XML element.

    Attributes:
        tag: Its name.
        attributes: Attributes by name.
        where: File and line, for messages.
        children: Child elements.
        start: Position of its `<` in the file [bytes].
    """

    tag: str
    attributes: dict[str, str]
    where: str
    children: list["Element"] = field(default_factory=lambda: list[Element]())
    start: int = 0

    @property
    def title(self) -> str:
        """Name for messages."""
        name = self.attributes.get("name")
        return f"{self.where}: {self.tag}" + (f" {one_line(name)!r}" if name is not None else "")

    @property
    def line(self) -> str:
        """`line 7`."""
        return self.where.split(": ")[-1]

    def all(self, *tags: str) -> list["Element"]:
        """Return the children with some tags."""
        return [child for child in self.children if child.tag in tags]

    def walk(self) -> Iterator["Element"]:
        """Yield the element and all descendants, in file order."""
        yield self
        for child in self.children:
            yield from child.walk()


@dataclass(frozen=True, slots=True)
class MinimalModel:
    """A robot model reduced to its kinematics: links and joints, with checked numbers.

    Attributes:
        kind: The format of `text`, "mjcf" or "urdf".
        text: A complete document of that format.
        gravity: Gravity in the world frame [m/s^2].
        ranges: Ends of joints by their names [rad or m], where Pinocchio would read others.
    """

    kind: str
    text: str
    gravity: tuple[float, ...] = EARTH
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=lambda: dict[str, tuple[float, float]]())


def tag(name: str, attributes: dict[str, str], *inside: str) -> str:
    """Return an XML element as text."""
    start = " ".join((name, *(f'{key}="{value.translate(ESCAPED)}"' for key, value in attributes.items())))
    return f"<{start}>{''.join(inside)}</{name}>" if inside else f"<{start}/>"


def read_xml(path: Path) -> Element:
    """Read an XML file in the encoding that it declares, in UTF-8, or in Latin-1 where it is not UTF-8.

    Names of an arm must be in UTF-8, as MuJoCo requires.

    Returns:
        The root element.

    Raises:
        RobotModelError: If the file cannot be read, is not XML, declares entities, or is too large or deep.
    """
    content = read_bytes(path, most_bytes=LARGEST_FILE, error=RobotModelError)
    old = _is_in_an_old_encoding(content)
    parser = expat.ParserCreate("ISO-8859-1" if old and not _DECLARED.match(content) else None)
    top, open_elements, count = list[Element](), list[Element](), 0
    file = f"robot model {one_line(path)}"

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        where = f"{file}: line {parser.CurrentLineNumber}"
        if len(open_elements) >= DEEPEST:
            raise RobotModelError(f"{where}: elements are nested deeper than {DEEPEST}")
        if count > MOST_ELEMENTS:
            raise RobotModelError(f"{where}: more than {MOST_ELEMENTS} elements")
        element = Element(tag, attributes, where, start=parser.CurrentByteIndex)
        strange = next((value for value in attributes.values() if not value.isascii()), None) if old else None
        if strange is not None:
            raise RobotModelError(f"{where}: {tag}: {shown(strange)} is not in UTF-8; save the file as UTF-8")
        (open_elements[-1].children if open_elements else top).append(element)
        open_elements.append(element)

    def refuse(*_: object) -> None:
        line = parser.CurrentLineNumber
        raise RobotModelError(f"{file}: line {line}: document type declarations are not supported; remove this one")

    parser.StartElementHandler, parser.StartDoctypeDeclHandler = start, refuse
    parser.EndElementHandler = lambda _: open_elements.pop()
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        reason = expat.errors.messages[error.code]
        raise RobotModelError(f"{file}: line {error.lineno}, column {error.offset + 1}: not XML: {reason}") from error
    except RobotModelError:
        raise
    except (ValueError, LookupError) as error:
        raise RobotModelError(f"{file}: not XML: {one_line(error)}") from error
    return top[0]


def _is_in_an_old_encoding(content: bytes) -> bool:
    """Return whether bytes are neither UTF-8 nor marked as UTF-16."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return False
    try:
        content.decode()
    except UnicodeDecodeError:
        return True
    return False


def vector(element: Element, attribute: str, count: int, *, largest: float = LARGEST) -> tuple[float, ...] | None:
    """Return the numbers of an attribute, checked for count, finiteness and plausible size.

    Returns:
        The numbers, None without the attribute.

    Raises:
        RobotModelError: If a number is wrong; the message names line, element, attribute and word.
    """
    text = element.attributes.get(attribute)
    if text is None:
        return None
    words, what = text.split(), f"{element.title}: {attribute} = {shown(text)}"
    for word in words:
        if not _NUMBER.fullmatch(word):
            separated = "; numbers are separated by spaces" if "," in word or ";" in word else ""
            raise RobotModelError(f"{what}: {shown(word)} is not a number{separated}")
    if len(words) != count:
        raise RobotModelError(f"{what}: {len(words)} numbers, expected {count}")
    values = tuple(float(word) for word in words)
    if not all(abs(value) <= largest for value in values):
        raise RobotModelError(f"{what}: beyond {largest:g}; check the number and its unit")
    return values


def direction(element: Element, attribute: str, count: int = 3) -> None:
    """Check a vector of which only the direction is used.

    Raises:
        RobotModelError: As `vector`, or if it is zero.
    """
    values = vector(element, attribute, count)
    if values is not None and math.hypot(*values) < SHORTEST:
        raise RobotModelError(f"{element.title}: {attribute} = {shown(element.attributes[attribute])} has no direction")
