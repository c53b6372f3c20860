"""What is said of logs: one line of one kind, whatever was looked at and whichever command asked."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum

MATTERS, SPOILS = 0.5, 3.0
"""Error of a gain, in its claimed standard deviations, that is worth a word, and beyond which it is refused."""
SHARE = 0.01
"""Share of a joint's current that matters where there are no gains."""


class Severity(Enum):
    """How a diagnosis is to be taken."""

    GOOD = "good"
    WEAK = "weak"
    WRONG = "wrong"


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """What a fault does to a gain, or where there are no gains to a joint's current.

    Attributes:
        joint: The joint, from 0.
        percent: Error of the gain [%]; share of the joint's rms current where `deviations` is None.
        deviations: The same in standard deviations that are claimed of the gain, None where there is no gain.
    """

    joint: int
    percent: float
    deviations: float | None

    @property
    def matters(self) -> bool:
        """Whether it is worth a word."""
        return abs(self.percent) > 100.0 * SHARE if self.deviations is None else abs(self.deviations) > MATTERS

    @property
    def spoils(self) -> bool:
        """Whether no interval contains it."""
        return abs(self.percent) > 100.0 * SHARE if self.deviations is None else abs(self.deviations) > SPOILS


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosis:
    """One thing that was looked at in logs or in an estimate, and what was found.

    Severity follows from z, whether it is so, and from the effect, whether it matters.

    Attributes:
        name: What was looked at, as `clipping`, `zero` or `delay`.
        severity: Good, weak (a warning) or wrong.
        sentence: What was found, in words and numbers.
        cause: The same without what it does to the gains, None where that is nothing.
        advice: What to do, None where nothing is.
        joints: Joints that it is about, from 0; none where it is about all.
        logs: Names of the logs that it is about; none where it is about all.
        value: Size of what was found, None where it has none.
        std: Standard deviation of the size.
        unit: Of both.
        z: Standard errors by which it predicts the currents better than the logs as they are, None where the samples
            themselves show it.
        effects: What it does to each gain.
        rivals: What these logs cannot tell it from, in words.
        asked: Whether it answers what somebody asked, and is told though it is good.
    """

    name: str
    severity: Severity = Severity.GOOD
    sentence: str
    cause: str | None = None
    advice: str | None = None
    joints: tuple[int, ...] = ()
    logs: tuple[str, ...] = ()
    value: float | None = None
    std: float | None = None
    unit: str | None = None
    z: float | None = None
    effects: tuple[Effect, ...] = ()
    rivals: tuple[str, ...] = ()
    asked: bool = False

    @property
    def worst(self) -> Effect | None:
        """The largest effect, in claimed deviations where there are gains."""
        return max(self.effects, key=lambda each: abs(each.deviations or 0.0) or abs(each.percent), default=None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Exclusion:
    """A family of faults that logs exclude.

    Attributes:
        family: As of a diagnosis.
        sentence: What is excluded, as `zeros beyond 1.3 (q2), 2.1 (q3) degrees`.
        joints: Joints that it is about, from 0; none where it is about all.
        limit: Size beyond which it is excluded, None where any is.
        unit: Of the limit.
    """

    family: str
    sentence: str
    joints: tuple[int, ...] = ()
    limit: float | None = None
    unit: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosed:
    """Everything that is said of logs and of what was found from them.

    Attributes:
        diagnoses: One a thing that was looked at, the worst first.
        excluded: Faults that these logs exclude.
        indistinguishable: What of single joints and of scales these logs cannot show, a phrase each.
        indistinguishable_together: What of all joints together they cannot show, a phrase each.
    """

    diagnoses: tuple[Diagnosis, ...] = ()
    excluded: tuple[Exclusion, ...] = ()
    indistinguishable: tuple[str, ...] = ()
    indistinguishable_together: tuple[str, ...] = ()

    @property
    def severity(self) -> Severity:
        """The worst of all, good where there is no diagnosis."""
        return max((each.severity for each in self.diagnoses), key=tuple(Severity).index, default=Severity.GOOD)

    @property
    def findings(self) -> tuple[Diagnosis, ...]:
        """The diagnoses that are not good."""
        return tuple(each for each in self.diagnoses if each.severity is not Severity.GOOD)

    @property
    def reported(self) -> tuple[Diagnosis, ...]:
        """The findings, and what was asked for."""
        return tuple(each for each in self.diagnoses if each.severity is not Severity.GOOD or each.asked)


def worst_first(diagnoses: Iterable[Diagnosis]) -> tuple[Diagnosis, ...]:
    """Each once, the worst before the others, else in their order."""
    order = tuple(Severity)
    return tuple(sorted(dict.fromkeys(diagnoses), key=lambda each: -order.index(each.severity)))
