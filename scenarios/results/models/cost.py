"""What believing a-priori gains costs: what comes out with them, with those found, and what is true or weighed."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from pydantic import Field

from ident.estimation.estimate import IdentifiedGain, JointResult
from ident.payload.payload import Payload
from ident.payload_identification.gains_outcome import GainsOutcome
from ident.payload_identification.payload_body import UNITS
from scenarios.support.result_model import ResultModel

if TYPE_CHECKING:  # a process that only identifies has nothing to judge
    from scenarios.experiments.judge import CostVerdict


class CostQuantity(ResultModel):
    """Mass, a coordinate of the centre, or an inertia about it, of the weight; null where the data do not show it.

    Attributes:
        quantity: Its name: mass; x, y and z of the centre of mass; ixx to iyz.
        unit: Of its numbers.
        true: Of what was mounted, null where that is not known, in `unit`.
        stated: As weighed and drawn, null where it is not stated, in `unit`.
        a_priori: With the a-priori gains, in `unit`.
        a_priori_std: One standard deviation of that, in `unit`; errors of the a-priori gains are not in it.
        found: With the gains found, in `unit`; null where these come from the same recordings.
        found_std: One standard deviation of that, in `unit`, that of the gains included.
    """

    quantity: str
    unit: str
    true: float | None
    stated: float | None
    a_priori: float | None
    a_priori_std: float | None
    found: float | None
    found_std: float | None


class CostJoint(ResultModel):
    """A joint alone: its gains, the mass that it gives, the torque that is predicted for it.

    Attributes:
        joint: Its number, from 1.
        a_priori_gain: [N m / drive unit], null where none is believed.
        gain: Found [N m / drive unit], null if refused.
        rel_difference: Relative difference, a-priori gain over the one found, less one; null without both.
        a_priori_mass: Of the weight, from this joint with its a-priori gain, null where it does not show [kg].
        a_priori_mass_std: One standard deviation of that [kg].
        found_mass: The same with the gain found [kg].
        found_mass_std: One standard deviation of that [kg].
        a_priori_torque_error: Relative error of the torque that arm and payload take on another motion, predicted with
            the a-priori gains; null where the torque is not known.
        found_torque_error: The same with the gains found, relative as well.
    """

    joint: int = Field(ge=1)
    a_priori_gain: float | None
    gain: float | None
    rel_difference: float | None
    a_priori_mass: float | None
    a_priori_mass_std: float | None
    found_mass: float | None
    found_mass_std: float | None
    a_priori_torque_error: float | None
    found_torque_error: float | None


class CostArm(ResultModel):
    """Identifiable parameters of the arm, all of one kind.

    Attributes:
        quantity: Which: first moments, which hold the masses, or inertias.
        a_priori: Relative error with the a-priori gains: norm of the error over that of the truth.
        a_priori_std: Its root mean square to expect from the deviations of the parameters, relative as well.
        found: Relative error with the gains found.
        found_std: As `a_priori_std`, relative as well.
    """

    quantity: str
    a_priori: float
    a_priori_std: float
    found: float | None
    found_std: float | None


class ResultCost(ResultModel):
    """What comes out with a-priori gains and with those found.

    Attributes:
        payload: The weight, all joints together.
        joints: One a joint, in their order.
        arm: Errors of the arm's parameters; empty where the truth is not known.
        tolerance: Relative error of the mass that passes with the gains found, null where none is stated.
        passed: Whether it does.
    """

    payload: list[CostQuantity]
    joints: list[CostJoint]
    arm: list[CostArm]
    tolerance: float | None
    passed: bool | None

    @classmethod
    def of_verdict(cls, verdict: "CostVerdict", joints: Sequence[JointResult]) -> "ResultCost":
        """What a run found beside the truth; `joints` are its gains."""
        one, two = verdict.torque_a_priori, verdict.torque_found
        rows = _joints(verdict.a_priori, verdict.found, joints)
        return cls(
            payload=[
                each.model_copy(update={"true": verdict.true[each.quantity]})
                for each in _payload(verdict.a_priori, verdict.found)
            ],
            joints=[
                each.model_copy(update={"a_priori_torque_error": one.get(j), "found_torque_error": two.get(j)})
                for j, each in enumerate(rows)
            ],
            arm=[
                CostArm(
                    quantity=each.quantity,
                    a_priori=each.a_priori,
                    a_priori_std=each.a_priori_std,
                    found=each.found,
                    found_std=each.found_std,
                )
                for each in verdict.arm
            ],
            tolerance=verdict.tolerance,
            passed=verdict.passed,
        )

    @classmethod
    def of_outcome(cls, a_priori: GainsOutcome, joints: Sequence[JointResult]) -> "ResultCost":
        """What a-priori gains make of the weight that the gains of `joints` were found with."""
        rows = _joints(a_priori, None, joints)
        return cls(payload=_payload(a_priori, None), joints=rows, arm=[], tolerance=None, passed=None)


def _payload(a_priori: GainsOutcome, found: GainsOutcome | None) -> list[CostQuantity]:
    stated = _stated(a_priori.weighed.payload)
    rows = list[CostQuantity]()
    for name, unit in UNITS.items():
        one, two = (None if each is None else each.weighed.body.of(name) for each in (a_priori, found))
        rows.append(
            CostQuantity(
                quantity=name,
                unit=unit,
                true=None,
                stated=stated.get(name),
                a_priori=one and one.value,
                a_priori_std=one and one.std,
                found=two and two.value,
                found_std=two and two.std,
            )
        )
    return rows


def _stated(payload: Payload) -> dict[str, float]:
    """What is known of a weight, by name."""
    shape = {"all": (payload.com or ()) + (payload.inertia or ()), "com": payload.com or ()}.get(payload.known, ())
    return dict(zip(UNITS, (payload.mass, *shape), strict=False))


def _joints(a_priori: GainsOutcome, found: GainsOutcome | None, joints: Sequence[JointResult]) -> list[CostJoint]:
    believed = dict(zip(a_priori.gains.joints.tolist(), a_priori.gains.value.tolist(), strict=True))
    rows = list[CostJoint]()
    for j, each in enumerate(joints):
        one, two = (None if outcome is None else outcome.weighed.joints[j].mass for outcome in (a_priori, found))
        own, gain = believed.get(j), each.value if isinstance(each, IdentifiedGain) else None
        rows.append(
            CostJoint(
                joint=j + 1,
                a_priori_gain=own,
                gain=gain,
                rel_difference=None if own is None or gain is None else own / gain - 1.0,
                a_priori_mass=one and one.value,
                a_priori_mass_std=one and one.std,
                found_mass=two and two.value,
                found_mass_std=two and two.std,
                a_priori_torque_error=None,
                found_torque_error=None,
            )
        )
    return rows
