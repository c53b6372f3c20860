"""Numbers in attributes of a robot model: the right count of them, finite and of a size that can be meant."""

import math
import re

from ident.model.files.xml_tree import Element
from ident.support.errors import RobotModelError
from ident.support.naming import shown

FARTHEST = 50.0
"""Distance between neighbouring frames beyond which a model is given in other units [m]."""
LARGEST = 1e6
"""Largest number of any other kind; angles in degrees and components of directions stay far below."""
STRONGEST_GRAVITY = 100.0
"""Largest component of gravity [m/s^2]."""
SHORTEST = 1e-6
"""Length below which a vector has no direction."""
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")


def vector(element: Element, attribute: str, count: int, *, largest: float = LARGEST) -> tuple[float, ...] | None:
    """The numbers of an attribute.

    Args:
        element: Where it stands.
        attribute: Its name.
        count: How many numbers it has.
        largest: Their largest size.

    Returns:
        As many numbers, None if the attribute is not there.

    Raises:
        RobotModelError: Naming line, element, attribute and the word that is wrong.
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
    """Check a vector of which only the direction counts.

    Raises:
        RobotModelError: As `vector`, or if it is zero.
    """
    values = vector(element, attribute, count)
    if values is not None and math.hypot(*values) < SHORTEST:
        raise RobotModelError(f"{element.title}: {attribute} = {shown(element.attributes[attribute])} has no direction")
