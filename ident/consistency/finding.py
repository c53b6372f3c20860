"""What a consistency test says."""

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """The outcome of a consistency test.

    Attributes:
        check: Name of the test.
        joint: The joint that fails most, or would first, from 0.
        statistic: Its value there.
        threshold: Value above which it is no accident, or too much.
        measure: What both are, in words.
        sentence: What it means and what to do; None where the test passes or what it finds
            does not matter to the gains.
        change: Of the gain of that joint in percent, None where that is not what is compared.
    """

    check: str
    joint: int
    statistic: float
    threshold: float
    measure: str
    sentence: str | None
    change: float | None = None

    @property
    def failed(self) -> bool:
        """Whether the data contradict what the estimate takes for granted, or cannot show it."""
        return self.sentence is not None


def joints_in_words(joints: Sequence[int]) -> str:
    """`joint 2` or `joints 2, 3 and 5`, of joints from 0."""
    numbers = [str(joint + 1) for joint in joints]
    if len(numbers) == 1:
        return f"joint {numbers[0]}"
    return f"joints {', '.join(numbers[:-1])} and {numbers[-1]}"
