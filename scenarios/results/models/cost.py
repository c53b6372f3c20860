"""Effect of a-priori gains: results with these, with the identified gains, and true or weighed values."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from pydantic import Field

from ident.estimation.estimate import IdentifiedGain, JointResult
from ident.payload.payload import Payload
from ident.payload_identification.gains_outcome import GainsOutcome
from ident.payload_identification.payload_body import UNITS
from scenarios.support.result_model import ResultModel

if TYPE_CHECKING:  # not needed by a process that only identifies
    from scenarios.experiments.judge import CostVerdict


class CostQuantity(ResultModel):
    """Mass, a coordinate of the centre, or an inertia of the payload; null if not identifiable."""

    quantity: str = Field(description="Name of the quantity: mass; x, y and z of the centre of mass; ixx to iyz")
    unit: str = Field(description="Unit of the values")
    true: float | None = Field(description="True value of the mounted payload, null if unknown, in `unit`")
    stated: float | None = Field(description="Specified value, null if not specified, in `unit`")
    a_priori: float | None = Field(description="Estimate with the a-priori gains, in `unit`")
    a_priori_std: float | None = Field(
        description="Standard deviation of that estimate, in `unit`, without errors of the a-priori gains"
    )
    found: float | None = Field(
        description="Estimate with the identified gains, in `unit`; null where these come from the same recordings"
    )
    found_std: float | None = Field(
        description="Standard deviation of that estimate, in `unit`, including that of the gains"
    )


class CostJoint(ResultModel):
    """A single joint: its gains, its estimate of the mass, its predicted torque."""

    joint: int = Field(ge=1, description="Number of the joint, from 1")
    a_priori_gain: float | None = Field(description="A-priori gain [N m / drive unit], null where none is specified")
    gain: float | None = Field(description="Identified gain [N m / drive unit], null if refused")
    rel_difference: float | None = Field(
        description="Relative difference: ratio of a-priori to identified gain, minus one; null unless both exist"
    )
    a_priori_mass: float | None = Field(
        description="Mass of the payload from this joint alone, with its a-priori gain; null if not identifiable [kg]"
    )
    a_priori_mass_std: float | None = Field(description="Standard deviation of that mass [kg]")
    found_mass: float | None = Field(
        description="Mass of the payload from this joint alone, with the identified gain [kg]"
    )
    found_mass_std: float | None = Field(description="Standard deviation of that mass [kg]")
    a_priori_torque_error: float | None = Field(
        description=(
            "Relative error of the torque of arm and payload on another motion, predicted with the a-priori gains; "
            "null if the torque is unknown"
        )
    )
    found_torque_error: float | None = Field(
        description="Relative error of that torque, predicted with the identified gains"
    )


class CostArm(ResultModel):
    """Identifiable parameters of the arm, all of one kind."""

    quantity: str = Field(description="Kind of the parameters: first moments, including the masses, or inertias")
    a_priori: float = Field(
        description="Relative error with the a-priori gains: norm of the error over norm of the true parameters"
    )
    a_priori_std: float = Field(
        description="Expected root mean square of this error, from the standard deviations of the parameters"
    )
    found: float | None = Field(description="Relative error with the identified gains")
    found_std: float | None = Field(
        description="Expected root mean square of this error, from the standard deviations of the parameters"
    )


class ResultCost(ResultModel):
    """Results with a-priori and with identified gains."""

    payload: list[CostQuantity] = Field(description="The payload, from all joints together")
    joints: list[CostJoint] = Field(description="One entry per joint, in order")
    arm: list[CostArm] = Field(description="Errors of the arm's parameters; empty if the true values are unknown")
    tolerance: float | None = Field(
        description="Largest relative error of the mass that passes with the identified gains, null if not specified"
    )
    passed: bool | None = Field(description="Whether the mass passes")

    @classmethod
    def of_verdict(cls, verdict: "CostVerdict", joints: Sequence[JointResult]) -> "ResultCost":
        """Return the results of a run with true values; `joints` are its gains."""
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
            arm=[CostArm.model_validate(each, from_attributes=True) for each in verdict.arm],
            tolerance=verdict.tolerance,
            passed=verdict.passed,
        )

    @classmethod
    def of_outcome(cls, a_priori: GainsOutcome, joints: Sequence[JointResult]) -> "ResultCost":
        """Return estimates with a-priori gains of the payload that was used to identify the gains of `joints`."""
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
    """Return the known values of a payload, by name."""
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
