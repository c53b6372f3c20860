"""Edits of a model file: attributes are changed, and all other bytes stay the same.

Parsing and rewriting with a library would change comments, order and white space; a diff of both files should show only
the changed values.
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
    """Replacement of the bytes from `start` to `end` by `text`."""

    start: int
    end: int
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """An attribute of a joint, changed or not.

    Attributes:
        joint: Name of the joint.
        attribute: Name of the attribute in the file.
        before: Original text, or that of the default class; None if there is none.
        after: New text; None if unchanged.
        rel_std: Relative standard deviation of the new number; None if unchanged.
        reason: Why it is unchanged.
    """

    joint: str
    attribute: str
    before: str | None
    after: str | None = None
    rel_std: float | None = None
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Patched:
    """A change and its edits."""

    change: Change
    edits: tuple[Edit, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class ModelText:
    """A model file as text and as elements, whose `start` is their position.

    Attributes:
        path: The file.
        content: Its bytes.
        root: Its outermost element.
    """

    path: Path
    content: bytes
    root: Element

    def attribute(self, element: Element, name: str, value: str) -> Edit:
        """Return the edit that sets an attribute, existing or new; the value must need no escapes."""
        end = self.end(element)
        for found in ATTRIBUTE.finditer(self.content, element.start, end):
            if found[1] == name.encode():
                return Edit(found.start(2) + 1, found.end(2) - 1, value)
        at = element.start + len(self.content[element.start : end].rstrip(b">").rstrip(b"/").rstrip())
        return Edit(at, at, f' {name}="{value}"')

    def child(self, parent: Element, text: str) -> Edit:
        """Return the edit that inserts an element as the first child, on its own line if the others are."""
        end = self.end(parent)
        if self.is_empty(parent):
            return Edit(end - 2, end, f">{text}</{parent.tag}>")
        space = SPACE.match(self.content, end)
        before = b"" if space is None or b"\n" not in space[0] else space[0]
        return Edit(end, end, before.decode() + text)

    def is_empty(self, element: Element) -> bool:
        """Return whether an element is empty, without an end tag."""
        end = self.end(element)
        return self.content[end - 2 : end] == b"/>"

    def end(self, element: Element) -> int:
        """Return the position after the start tag of an element.

        Raises:
            ScenarioError: If the encoding does not allow edits of bytes, as UTF-16.
        """
        found = START.match(self.content, element.start)
        if found is None:
            where = f"{one_line(self.path)}: {element.tag}"
            raise ScenarioError(f"{where}: the text cannot be edited in place; save the file as UTF-8")
        return found.end()

    def edited(self, edits: Iterable[Edit]) -> bytes:
        """Return the text with non-overlapping edits applied."""
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
    """Return numbers as an attribute value, with all digits."""
    return " ".join(map(repr, values))


def known_attribute(
    file: ModelText, element: Element | None, joint: str, name: str, before: str | None, known: Known
) -> Patched:
    """Return the change of an attribute to a number if it is known; without an edit if the element does not exist."""
    if isinstance(known, Unknown):
        return Patched(Change(joint=joint, attribute=name, before=before, reason=known.reason))
    after = f"{known.value:.6g}"  # its standard deviation is at least a millionth
    change = Change(joint=joint, attribute=name, before=before, after=after, rel_std=known.rel_std)
    return Patched(change, () if element is None else (file.attribute(element, name, after),))


def scaled_effort(
    file: ModelText, element: Element | None, joint: str, attribute: str, before: str | None, factor: Known
) -> Patched:
    """Return the change of an effort limit by a factor, if there is a limit and the factor is known."""
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
