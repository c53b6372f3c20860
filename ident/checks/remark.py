"""What a check of a log says: a line with a verdict."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum


class Grade(Enum):
    """How something is to be taken."""

    GOOD = "good"
    WEAK = "weak"
    WRONG = "wrong"


@dataclass(frozen=True, slots=True, kw_only=True)
class Remark:
    """One line of a check.

    Attributes:
        topic: What was looked at.
        log: Name of the recording, None where it is about all of them.
        joint: The joint, from 0, None where it is about all of them.
        seen: What was seen, in words and numbers.
        grade: How that is to be taken.
        advice: What to do, None where nothing is.
    """

    topic: str
    log: str | None = None
    joint: int | None = None
    seen: str
    grade: Grade = Grade.GOOD
    advice: str | None = None


def worst(remarks: Sequence[Remark]) -> Grade:
    """The worst grade, good where there is no remark."""
    order = tuple(Grade)
    return max((each.grade for each in remarks), key=order.index, default=Grade.GOOD)
