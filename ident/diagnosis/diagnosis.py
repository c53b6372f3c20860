"""One kind of result for all checks of logs, whatever the command."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum

MATTERS, SPOILS = 0.5, 3.0
"""Error of a gain, in its estimated standard deviations, beyond which it is reported, and beyond which the gain is
refused."""
SHARE = 0.01
"""Share of a joint's current that is reported if there are no gains."""


class Severity(Enum):
    """Severity of a diagnosis."""

    GOOD = "good"
    WEAK = "weak"
    WRONG = "wrong"


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """Effect of a fault on a gain or, without gains, on a joint's current.

    Attributes:
        joint: The joint, from 0.
        percent: Error of the gain [%]; share of the joint's rms current where `deviations` is None.
        deviations: The same in estimated standard deviations of the gain, None without a gain.
    """

    joint: int
    percent: float
    deviations: float | None

    @property
    def matters(self) -> bool:
        """Whether it is large enough to be reported."""
        return self._exceeds(MATTERS)

    @property
    def spoils(self) -> bool:
        """Whether it is so large that the gain is refused."""
        return self._exceeds(SPOILS)

    def _exceeds(self, deviations: float) -> bool:
        return abs(self.percent) > 100.0 * SHARE if self.deviations is None else abs(self.deviations) > deviations


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosis:
    """Result of one check of logs or an estimate.

    Severity follows from z, the significance, and from the effect on the gains.

    Attributes:
        name: Name of the check, such as `clipping`, `zero` or `delay`.
        severity: Good, weak (a warning) or wrong.
        sentence: The finding, with its numbers.
        cause: The same without its effect on the gains, None without one.
        advice: The remedy, None if none is needed.
        joints: Joints concerned, from 0; empty for all.
        logs: Names of the logs concerned; empty for all.
        value: Size of the fault, in `unit`; None without one.
        std: Standard deviation of the size, in `unit`.
        unit: Unit of both.
        z: Improvement of the predictions of the currents over the logs as they are, in standard errors; None for a
            check of samples.
        effects: Effect on each gain.
        rivals: Alternatives that these logs cannot distinguish from it, in words.
        asked: Whether an option requested it, so that it is reported even if it is good.
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
        """The largest effect, in estimated standard deviations if there are gains."""
        return max(self.effects, key=lambda each: abs(each.deviations or 0.0) or abs(each.percent), default=None)


def finding(
    log: str | None,
    name: str,
    sentence: str,
    advice: str | None = None,
    *,
    severity: Severity | None = None,
    joints: Sequence[int] = (),
    value: float | None = None,
    unit: str | None = None,
) -> Diagnosis:
    """Return a diagnosis of one log, None for all; without a severity it is weak if it has advice, otherwise good."""
    return Diagnosis(
        name=name, severity=severity or (Severity.WEAK if advice else Severity.GOOD), sentence=sentence, advice=advice,
        joints=tuple(joints), logs=() if log is None else (log,), value=None if value is None else float(value),
        unit=unit,
    )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Exclusion:
    """A family of faults that logs exclude.

    Attributes:
        family: As `name` of a diagnosis.
        sentence: The excluded faults, such as `zeros beyond 1.3 (q2), 2.1 (q3) degrees`.
        joints: Joints concerned, from 0; empty for all.
        limit: Size beyond which it is excluded, in `unit`; None if any size is.
        unit: Unit of the limit.
    """

    family: str
    sentence: str
    joints: tuple[int, ...] = ()
    limit: float | None = None
    unit: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosed:
    """All results for logs and their estimate.

    Attributes:
        diagnoses: One per check, the worst first.
        excluded: Faults that these logs exclude.
        undetectable: Faults that these logs cannot reveal, those of all joints together last, one phrase each.
        largest_undetected: The fault that they do not exclude with the largest effect on a gain, None without one.
    """

    diagnoses: tuple[Diagnosis, ...] = ()
    excluded: tuple[Exclusion, ...] = ()
    undetectable: tuple[str, ...] = ()
    largest_undetected: str | None = None

    @property
    def severity(self) -> Severity:
        """The worst severity, good without a diagnosis."""
        return max((each.severity for each in self.diagnoses), key=tuple(Severity).index, default=Severity.GOOD)

    @property
    def findings(self) -> tuple[Diagnosis, ...]:
        """The diagnoses that are not good."""
        return tuple(each for each in self.diagnoses if each.severity is not Severity.GOOD)

    @property
    def reported(self) -> tuple[Diagnosis, ...]:
        """The findings, and requested diagnoses."""
        return tuple(each for each in self.diagnoses if each.severity is not Severity.GOOD or each.asked)


def worst_first(diagnoses: Iterable[Diagnosis]) -> tuple[Diagnosis, ...]:
    """Return each diagnosis once, the worst first, otherwise in their order."""
    order = tuple(Severity)
    return tuple(sorted(dict.fromkeys(diagnoses), key=lambda each: -order.index(each.severity)))


def two_digits(value: float, *, sign: str = "") -> str:
    """A number with two digits, or all digits before the decimal point."""
    return f"{value:{sign}.0f}" if abs(value) >= 10.0 else f"{value:{sign}.2g}"


def larger(ratio: float) -> str:
    """A ratio from 1 on, in words that begin a comparison; long logs reveal ratios near 1."""
    if ratio < 2.0:
        return f"{two_digits(100.0 * (ratio - 1.0))} % larger than"
    return f"{two_digits(ratio)} times as large as"
