"""An XML file as a tree of elements that know their line; bounded in size and depth, without entities.

Robot models go to C++ readers that recurse into them, so what is too deep for those is found here.
"""

from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from ident.support.errors import RobotModelError
from ident.support.file_access import read_bytes
from ident.support.naming import one_line

LARGEST = 32_000_000
"""Bytes of a model file."""
DEEPEST = 200
"""Elements within elements; the readers behind recurse."""
MOST_ELEMENTS = 200_000


@dataclass(frozen=True, slots=True, eq=False)
class Element:
    """An XML element.

    Attributes:
        tag: Its name.
        attributes: By name.
        where: File and line, for messages.
        children: Elements inside.
    """

    tag: str
    attributes: dict[str, str]
    where: str
    children: list["Element"] = field(default_factory=lambda: list[Element]())

    @property
    def title(self) -> str:
        """How messages name it."""
        name = self.attributes.get("name")
        return f"{self.where}: {self.tag}" + (f" {one_line(name)!r}" if name is not None else "")

    def all(self, *tags: str) -> list["Element"]:
        """Its children of some tags."""
        return [child for child in self.children if child.tag in tags]


def read_xml(path: Path) -> Element:
    """Read an XML file.

    Returns:
        The outermost element.

    Raises:
        RobotModelError: If the file cannot be read, is no XML, declares entities, or is too large or deep.
    """
    content = read_bytes(path, most_bytes=LARGEST, error=RobotModelError)
    parser, top, open_elements, count = expat.ParserCreate(), list[Element](), list[Element](), 0

    def where() -> str:
        return f"robot model {one_line(path)}: line {parser.CurrentLineNumber}"

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if len(open_elements) >= DEEPEST:
            raise RobotModelError(f"{where()}: elements are nested deeper than {DEEPEST}")
        if count > MOST_ELEMENTS:
            raise RobotModelError(f"{where()}: more than {MOST_ELEMENTS} elements")
        element = Element(tag, attributes, where())
        (open_elements[-1].children if open_elements else top).append(element)
        open_elements.append(element)

    def end(_: str) -> None:
        open_elements.pop()

    def refuse(*_: object) -> None:
        raise RobotModelError(f"{where()}: document type declarations are not supported; remove this one")

    parser.StartElementHandler, parser.EndElementHandler, parser.StartDoctypeDeclHandler = start, end, refuse
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        reason = expat.errors.messages[error.code]
        raise RobotModelError(
            f"robot model {one_line(path)}: line {error.lineno}, column {error.offset + 1}: not XML: {reason}"
        ) from error
    except (ValueError, LookupError) as error:
        if isinstance(error, RobotModelError):
            raise
        raise RobotModelError(f"robot model {one_line(path)}: not XML: {one_line(error)}") from error
    return top[0]
