"""What a patch changes of a model file and what it leaves alone: attributes change, and every other byte stays.

A library that parses and writes anew would lose comments before the root, the order and the white space of what it
does not touch; a difference between both files should be what was changed.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from ident.model.files.xml_tree import LARGEST_FILE, Element, read_xml
from ident.support.errors import RobotModelError
from ident.support.file_access import read_bytes
from ident.support.naming import one_line
from scenarios.gains_in_use.model_update.values import Known, Unknown
from scenarios.support.errors import ScenarioError

START = re.compile(rb"<[^\s/>]+(?:\s+[^\s=]+\s*=\s*(?:\"[^\"]*\"|'[^']*'))*\s*/?>")
ATTRIBUTE = re.compile(rb"\s+([^\s=]+)\s*=\s*(\"[^\"]*\"|'[^']*')")
SPACE = re.compile(rb"\s*")


@dataclass(frozen=True, slots=True)
class Edit:
    """Bytes from `start` to `end` become `text`."""

    start: int
    end: int
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """An attribute of a joint, changed or not.

    Attributes:
        joint: Its name.
        attribute: As the file calls it.
        before: Its text, or that of its default class; None if there is none.
        after: Its text now; None if it is left alone.
        rel_std: Relative deviation of the new number; None if it is left alone.
        reason: Why it is left alone.
    """

    joint: str
    attribute: str
    before: str | None
    after: str | None = None
    rel_std: float | None = None
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Patched:
    """A change and the edits that make it."""

    change: Change
    edits: tuple[Edit, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class ModelText:
    """A model file as text and as elements, whose `start` says where they are in it.

    Attributes:
        path: The file.
        content: Its bytes.
        root: Its outermost element.
    """

    path: Path
    content: bytes
    root: Element

    def attribute(self, element: Element, name: str, value: str) -> Edit:
        """The edit that gives an attribute a value, there or not yet; the value needs no escapes."""
        end = self.end(element)
        for found in ATTRIBUTE.finditer(self.content, element.start, end):
            if found[1] == name.encode():
                return Edit(found.start(2) + 1, found.end(2) - 1, value)
        at = element.start + len(self.content[element.start : end].rstrip(b">").rstrip(b"/").rstrip())
        return Edit(at, at, f' {name}="{value}"')

    def child(self, parent: Element, text: str) -> Edit:
        """The edit that puts an element into another one as its first, in a line of its own where the others are."""
        end = self.end(parent)
        if self.is_empty(parent):
            return Edit(end - 2, end, f">{text}</{parent.tag}>")
        space = SPACE.match(self.content, end)
        before = b"" if space is None or b"\n" not in space[0] else space[0]
        return Edit(end, end, before.decode() + text)

    def is_empty(self, element: Element) -> bool:
        """Whether an element ends with its start tag."""
        end = self.end(element)
        return self.content[end - 2 : end] == b"/>"

    def end(self, element: Element) -> int:
        """Place behind the start tag of an element.

        Raises:
            ScenarioError: If characters are not bytes that can be edited in place, as UTF-16.
        """
        found = START.match(self.content, element.start)
        if found is None:
            where = f"{one_line(self.path)}: {element.tag}"
            raise ScenarioError(f"{where}: the text cannot be edited in place; save the file as UTF-8")
        return found.end()

    def edited(self, edits: Iterable[Edit]) -> bytes:
        """The text with edits that do not overlap made."""
        parts, at = list[bytes](), 0
        for edit in sorted(edits, key=lambda each: each.start):
            parts += [self.content[at : edit.start], edit.text.encode()]
            at = edit.end
        return b"".join([*parts, self.content[at:]])


def model_text(path: Path) -> ModelText:
    """Read a model file.

    Raises:
        RobotModelError: If it cannot be read.
    """
    return ModelText(path, read_bytes(path, most_bytes=LARGEST_FILE, error=RobotModelError), read_xml(path))


def numbers(values: Iterable[float]) -> str:
    """Numbers as an attribute has several, every digit of each."""
    return " ".join(map(repr, values))


def known_attribute(
    file: ModelText, element: Element | None, joint: str, name: str, before: str | None, known: Known
) -> Patched:
    """An attribute that becomes a number where it is known; without an edit where the element is not there yet."""
    if isinstance(known, Unknown):
        return Patched(Change(joint=joint, attribute=name, before=before, reason=known.reason))
    after = f"{known.value:.6g}"  # its deviation is no smaller than a millionth
    change = Change(joint=joint, attribute=name, before=before, after=after, rel_std=known.rel_std)
    return Patched(change, () if element is None else (file.attribute(element, name, after),))


def scaled_effort(
    file: ModelText, element: Element | None, joint: str, attribute: str, before: str | None, factor: Known
) -> Patched:
    """An effort limit times a factor: changed where there is a limit and the factor is known."""
    reason = factor.reason if isinstance(factor, Unknown) else ""
    try:
        limits = [float(word) for word in (before or "").split()]
    except ValueError:
        limits = []
    if not reason and not any(limits):
        reason = "a limit of 0 is no limit" if limits else "the model states no limit"
    if reason or isinstance(factor, Unknown) or element is None:
        return Patched(Change(joint=joint, attribute=attribute, before=before, reason=reason))
    after = " ".join(f"{limit * factor.value:.6g}" for limit in limits)
    change = Change(joint=joint, attribute=attribute, before=before, after=after, rel_std=factor.rel_std)
    return Patched(change, (file.attribute(element, attribute, after),))
