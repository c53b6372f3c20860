"""`judge`: hold an estimate against the truth. The only place that sees both."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.estimation.estimate import GainEstimate, JointResult, RefusedGain
from ident.support.arrays import Array
from scenarios.experiments.files.schema import ToleranceTable


@dataclass(frozen=True, slots=True, kw_only=True)
class GainVerdict:
    """One joint's gain against the truth.

    Attributes:
        joint: Joint number, from 1.
        true: Injected gain [N m / drive unit].
        estimate: Identified gain, None if refused.
        std: Its standard deviation, all shares together, None if refused.
        rel_error: (estimate - true) / true, None if refused.
        z: (estimate - true) / std, None if refused.
        tolerance: Largest relative error that passes.
        identifiable: Whether identification gave a gain.
        passed: Within tolerance where the data should give a gain, refused where they should not.
        reason: Why it was refused, or why it did not pass; None otherwise.
    """

    joint: int
    true: float
    estimate: float | None
    std: float | None
    rel_error: float | None
    z: float | None
    tolerance: float
    identifiable: bool
    passed: bool
    reason: str | None


@dataclass(frozen=True, slots=True)
class Claim:
    """What is claimed of one joint.

    Attributes:
        value: The gain [N m / drive unit], None if refused.
        std: Its standard deviation, all shares together, None if refused or not stated.
        reason: Why it is refused, if that is said.
    """

    value: float | None
    std: float | None
    reason: str | None


@dataclass(frozen=True, slots=True)
class Verdict:
    """Every joint's verdict; `passed` if all passed."""

    gains: tuple[GainVerdict, ...]

    @property
    def passed(self) -> bool:
        """Whether every joint passed."""
        return all(gain.passed for gain in self.gains)


def judge(estimate: GainEstimate, true_gain: Array, tolerance: ToleranceTable, *, expectation: str) -> Verdict:
    """Hold identified gains against injected ones.

    Args:
        estimate: From identification.
        true_gain: Injected gains [N m / drive unit], shape (n,).
        tolerance: What counts as passed.
        expectation: Name of the file that says which joints' gains the data should give, for the reason.
    """
    return judge_claims([_claim(joint) for joint in estimate.joints], true_gain, tolerance, expectation=expectation)


def judge_claims(claims: Sequence[Claim], true_gain: Array, tolerance: ToleranceTable, *, expectation: str) -> Verdict:
    """As `judge`, for what any method claims.

    Args:
        claims: One a joint.
        true_gain: Injected gains [N m / drive unit], shape (n,).
        tolerance: What counts as passed.
        expectation: Name of the file that says which joints' gains the data should give, for the reason.
    """
    rows = zip(claims, true_gain, tolerance.gain, tolerance.identifiable, strict=True)
    return Verdict(
        tuple(
            _judge_joint(j + 1, claim, float(true), allowed, None if expected else expectation)
            for j, (claim, true, allowed, expected) in enumerate(rows)
        )
    )


def _claim(joint: JointResult) -> Claim:
    if isinstance(joint, RefusedGain):
        return Claim(None, None, joint.reason)
    return Claim(joint.value, joint.std, None)


def _judge_joint(number: int, claim: Claim, true: float, tolerance: float, refusal_in: str | None) -> GainVerdict:
    """One joint; `refusal_in` names the file that wants it refused, None where a gain is wanted."""
    if claim.value is None:
        return GainVerdict(
            joint=number,
            true=true,
            estimate=None,
            std=None,
            rel_error=None,
            z=None,
            tolerance=tolerance,
            identifiable=False,
            passed=refusal_in is not None,
            reason=claim.reason,
        )
    error = claim.value - true
    within = bool(np.abs(error / true) <= tolerance)
    reason = None
    if refusal_in is not None:
        reason = f"identified, but not identifiable from these data according to tolerance.identifiable in {refusal_in}"
    elif not within:
        reason = f"off by {100 * error / true:+.3g} %, tolerance {100 * tolerance:.3g} %"
    return GainVerdict(
        joint=number,
        true=true,
        estimate=claim.value,
        std=claim.std,
        rel_error=error / true,
        z=error / claim.std if claim.std else None,
        tolerance=tolerance,
        identifiable=True,
        passed=within and refusal_in is None,
        reason=reason,
    )
