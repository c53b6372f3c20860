"""`judge`: compare an estimate with the true values. The only module that uses both."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ident.estimation.estimate import GainEstimate, JointResult, RefusedGain
from ident.estimation.joint_by_joint.pooled_system import pooled_system
from ident.estimation.problem import ObservedMotion
from ident.payload_identification.gains_outcome import GainsOutcome, predicted_torque, rel_errors
from ident.payload_identification.payload_body import UNITS
from ident.support.arrays import Array
from scenarios.experiments.files.schema import ToleranceTable
from sim.plant import PayloadBody


@dataclass(frozen=True, slots=True, kw_only=True)
class GainVerdict:
    """One joint's identified gain compared with the true one.

    Attributes:
        joint: Joint number, from 1.
        true: Injected gain [N m / drive unit].
        estimate: Identified gain, None if refused.
        std: Its total standard deviation, None if refused.
        rel_error: (estimate - true) / true, None if refused.
        z: (estimate - true) / std, None if refused.
        tolerance: Largest relative error that passes.
        identifiable: Whether identification gave a gain.
        passed: Whether the gain is within tolerance, or refused if it should not be identifiable.
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
    """The answer of a method for one joint.

    Attributes:
        value: The gain [N m / drive unit], None if refused.
        std: Its total standard deviation, None if refused or not estimated.
        reason: Why it is refused, None if unknown.
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
    """Compare identified gains with injected ones.

    Args:
        estimate: Result of the identification.
        true_gain: Injected gains [N m / drive unit], shape (n,).
        tolerance: Criteria for passing.
        expectation: Name of the file that states which gains should be identifiable, for the reason.
    """
    return judge_claims([_claim(joint) for joint in estimate.joints], true_gain, tolerance, expectation=expectation)


def judge_claims(claims: Sequence[Claim], true_gain: Array, tolerance: ToleranceTable, *, expectation: str) -> Verdict:
    """Judge the answers of any method, one per joint."""
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
    """Judge one joint; `refusal_in` names the file that requires a refusal, None if a gain is required."""
    error = None if claim.value is None else claim.value - true
    within = error is not None and bool(np.abs(error / true) <= tolerance)
    reason = claim.reason
    if error is not None and refusal_in is not None:
        reason = f"identified, but tolerance.identifiable in {refusal_in} expects a refusal"
    elif error is not None:
        reason = None if within else f"off by {100 * error / true:+.3g} %, tolerance {100 * tolerance:.3g} %"
    return GainVerdict(
        joint=number,
        true=true,
        estimate=claim.value,
        std=None if error is None else claim.std,
        rel_error=None if error is None else error / true,
        z=None if error is None or not claim.std else error / claim.std,
        tolerance=tolerance,
        identifiable=error is not None,
        passed=refusal_in is not None if error is None else within and refusal_in is None,
        reason=reason,
    )


MOMENTS, INERTIAS = "first moments of the arm", "inertias of the arm"


@dataclass(frozen=True, slots=True, kw_only=True)
class RelError:
    """Errors of the arm's parameters, with each set of gains.

    Attributes:
        quantity: `MOMENTS` or `INERTIAS`.
        a_priori: Norm of the error over norm of the true parameters, with the a-priori gains.
        a_priori_std: Expected root mean square of this error, from the standard deviations of the parameters.
        found: As `a_priori`, with the identified gains; None if there are none.
        found_std: As `a_priori_std`, with the identified gains.
    """

    quantity: str
    a_priori: float
    a_priori_std: float
    found: float | None
    found_std: float | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CostVerdict:
    """Results with a-priori and with identified gains, compared with the true values.

    Attributes:
        a_priori: Results with the a-priori gains.
        found: Results with the identified gains, None if there are none.
        true: True mass, centre and inertia of the payload by name, in units of `payload_body.UNITS`.
        arm: Errors of the arm's parameters.
        torque_a_priori: Norm of the error of the torque predicted on another motion over norm of the true drive torque,
            by joint from 0, with the a-priori gains.
        torque_found: As `torque_a_priori`, with the identified gains; joints without one are omitted.
        tolerance: Largest relative error of the mass that passes, with the identified gains.
    """

    a_priori: GainsOutcome
    found: GainsOutcome | None
    true: Mapping[str, float]
    arm: tuple[RelError, ...]
    torque_a_priori: Mapping[int, float]
    torque_found: Mapping[int, float]
    tolerance: float

    @property
    def passed(self) -> bool:
        """Whether the mass is within tolerance with the identified gains."""
        mass = None if self.found is None else self.found.weighed.together.mass
        return mass is not None and abs(mass.value / self.true["mass"] - 1.0) <= self.tolerance


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CostTruth:
    """True values for judging the use of gains.

    Attributes:
        weight: The payload.
        base: Base parameters of the arm, without friction, shape (b,).
        gain: Gains of the drives [N m / drive unit], shape (n,).
    """

    weight: PayloadBody
    base: Array
    gain: Array


def judge_cost(
    a_priori: GainsOutcome, found: GainsOutcome | None, truth: CostTruth, other: ObservedMotion, *, tolerance: float
) -> CostVerdict:
    """Compare results of the use of gains with the true values.

    Torques are predicted on `other`, a motion with another payload, with its assumed parameters.
    """
    of = [outcome for outcome in (a_priori, found) if outcome is not None]
    names = other.observation.structure.base.names
    errors = [[_arm_error(outcome, truth.base, names, moments) for outcome in of] for moments in (True, False)]
    torques = [_torque_errors(outcome, truth.gain, other) for outcome in of]
    return CostVerdict(
        a_priori=a_priori,
        found=found,
        true=dict(zip(UNITS, (truth.weight.mass, *truth.weight.com, *truth.weight.inertia), strict=True)),
        arm=tuple(
            RelError(
                quantity=quantity,
                a_priori=each[0][0],
                a_priori_std=each[0][1],
                found=None if found is None else each[1][0],
                found_std=None if found is None else each[1][1],
            )
            for quantity, each in zip((MOMENTS, INERTIAS), errors, strict=True)
        ),
        torque_a_priori=torques[0],
        torque_found={} if found is None else torques[1],
        tolerance=tolerance,
    )


def _arm_error(outcome: GainsOutcome, base: Array, names: Sequence[str], moments: bool) -> tuple[float, float]:
    """Return the relative error (norm) of first moments or of other inertial parameters, and the expected one."""
    shown = [each for each in outcome.arm.inertial if each.name.startswith("M") == moments]
    true = base[[names.index(each.name) for each in shown]]
    error, std = np.array([each.value for each in shown]) - true, np.array([each.std for each in shown])
    return float(np.linalg.norm(error) / np.linalg.norm(true)), float(np.linalg.norm(std) / np.linalg.norm(true))


def _torque_errors(outcome: GainsOutcome, gain: Array, other: ObservedMotion) -> dict[int, float]:
    """Return the error of the torque predicted on a motion, by joints that have a gain."""
    assert other.payload is not None, "of a loaded motion"
    system = pooled_system([other])
    predicted = predicted_torque(system, outcome.base(other.observation.structure), other.payload)
    true = gain[system.joint] * system.V
    errors = rel_errors(predicted - true, true, system.joint)
    return {j: errors[j] for j in outcome.gains.joints.tolist()}
