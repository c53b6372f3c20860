"""When repeated trials contradict the pass rate that a scenario asks for, at a stated false-alarm rate.

Per joint, the number of misses among N trials is compared with the binomial distribution at the wanted rate. A joint
misses the rule when that many misses, or more, would have a chance of less than `false_alarm` / n; so a method
that has every rate is blamed on some joint in less than `false_alarm` of all studies (Bonferroni).
"""

from collections.abc import Sequence
from dataclasses import dataclass

from scipy import stats

from scenarios.experiments.studies.joint_rows import JointRows

FALSE_ALARM = 0.01
"""Chance that a scenario whose joints all have the wanted pass rate is blamed, at most, where no other is asked for."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JointRule:
    """The rule applied to one joint.

    Attributes:
        joint: Joint number, from 1.
        trials: Trials.
        passed: Of which passed.
        wanted: Pass rate asked for.
        allowed: Misses that do not contradict it.
    """

    joint: int
    trials: int
    passed: int
    wanted: float
    allowed: int

    @property
    def held(self) -> bool:
        """Whether the misses are no more than allowed."""
        return self.trials - self.passed <= self.allowed


def pass_rule(joints: Sequence[JointRows], *, wanted: float, false_alarm: float) -> tuple[JointRule, ...]:
    """Apply the rule to every joint.

    Args:
        joints: How often each passed.
        wanted: Pass rate asked for, between 0 and 1.
        false_alarm: Chance that some joint misses although every joint has the wanted rate, at most.
    """
    share = false_alarm / len(joints)
    return tuple(
        JointRule(
            joint=each.joint,
            trials=each.trials,
            passed=each.passed,
            wanted=wanted,
            allowed=allowed_misses(each.trials, wanted, share),
        )
        for each in joints
    )


def allowed_misses(trials: int, wanted: float, false_alarm: float) -> int:
    """Largest number of misses that a pass rate of `wanted` exceeds in `false_alarm` of studies at most."""
    return int(stats.binom.isf(false_alarm, trials, 1.0 - wanted))


def detectable_rate(trials: int, allowed: int, power: float) -> float:
    """Pass rate below which a joint misses the rule with a chance of `power` at least."""
    return float(1.0 - stats.beta.ppf(power, allowed + 1, trials - allowed)) if trials > allowed else 0.0
