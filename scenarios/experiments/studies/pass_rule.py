"""Test of repeated trials against the required pass rate, at a given false-alarm rate.

For each joint, the number of misses among N trials is compared with the binomial distribution at the required rate. A
joint fails if that many misses, or more, have a probability below `false_alarm` / n. A method with the required rate on
every joint therefore fails in less than `false_alarm` of all studies (Bonferroni).
"""

from collections.abc import Sequence
from dataclasses import dataclass

from scipy import stats

from scenarios.experiments.studies.joint_rows import JointRows

FALSE_ALARM = 0.01
"""Default of the largest probability that a scenario whose joints have the required pass rate fails."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JointRule:
    """The rule applied to one joint.

    Attributes:
        joint: Joint number, from 1.
        trials: Trials.
        passed: Number of trials that passed.
        wanted: Required pass rate.
        allowed: Largest number of misses that is compatible with it.
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
        joints: Trials and passes of each joint.
        wanted: Required pass rate, between 0 and 1.
        false_alarm: Largest probability that some joint fails although every joint has the required rate.
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
    """Return the number of misses that a pass rate of `wanted` exceeds in at most `false_alarm` of studies."""
    return int(stats.binom.isf(false_alarm, trials, 1.0 - wanted))


def detectable_rate(trials: int, allowed: int, power: float) -> float:
    """Return the pass rate below which a joint fails with a probability of at least `power`."""
    return float(1.0 - stats.beta.ppf(power, allowed + 1, trials - allowed)) if trials > allowed else 0.0
