"""Results of `rx90 verify` and `rx90 payload-of`: estimated payloads, and gains tested with a weighed mass."""

from collections.abc import Sequence
from dataclasses import asdict

from pydantic import Field

import ident.parameters.payload as payload
import ident.parameters.weighing as weighing
from ident.diagnosis.diagnosis import Diagnosed
from ident.estimation.cross_validation import JointPrediction
from ident.identification import Identification
from ident.unseen import Unseen
from scenarios.rendering.result import ResultModel
from scenarios.results.diagnoses import DiagnosedResult, diagnosed_values
from scenarios.results.unseen import ResultUnseen


class Deviations(ResultModel):
    """A number and the contributions to its standard deviation; null if not identifiable.

    Attributes:
        estimate: Estimate, in `unit`.
        std: Total standard deviation, in `unit`.
        residual_std: Contribution of the residuals to `std`, in `unit`.
        gain_std: Contribution of the gains' standard deviations to `std`, in `unit`.
        model_std: Contribution of the model's assumptions to `std`, in `unit`.
    """

    estimate: float | None = None
    std: float | None
    residual_std: float | None
    gain_std: float | None
    model_std: float | None


class _Quantity(ResultModel):
    quantity: str = Field(description="Name of the quantity: mass; x, y and z of the centre of mass; ixx to iyz")
    unit: str = Field(description="Unit of the values")


class Quantity(Deviations, _Quantity):
    """Mass, a coordinate of the centre, or an inertia about the centre."""


class _Parameter(ResultModel):
    parameter: str = Field(description="Name of the parameter: XX to ZZ, MX, MY, MZ or M")
    unit: str = Field(description="Unit of the values")


class PayloadParameter(Deviations, _Parameter):
    """A standard parameter at the origin of the last frame."""


class Weighed(ResultModel):
    """Estimate of a known mass from all joints (joint null) or from one joint [kg].

    Attributes:
        joint: Number of the joint, from 1; null for all joints together.
        mass: Estimated mass, null if not identifiable [kg].
        std: Total standard deviation of the estimated mass, without that of the scale [kg].
        residual_std: Contribution of the residuals to `std` [kg].
        gain_std: Contribution of the gains' standard deviations to `std` [kg].
        model_std: Contribution of the model's assumptions to `std` [kg].
        rel_error: Relative error of the mass, (estimate - weighed) / weighed, which equals that of the gains.
        rel_std: Standard deviation of `rel_error`, including that of the scale; relative.
        verdict: "agrees", "differs" or, if inconclusive, "says nothing".
        reason: Why the estimate is inconclusive.
    """

    joint: int | None
    mass: float | None
    std: float | None
    residual_std: float | None
    gain_std: float | None
    model_std: float | None
    rel_error: float | None
    rel_std: float | None
    verdict: str
    reason: str | None


class Departure(ResultModel):
    """A joint whose estimate of the mass differs from that of the others.

    Attributes:
        joint: Its number, from 1.
        rel_error: Relative difference: ratio of its mass to that of the others, minus one.
        rel_std: Standard deviation of `rel_error`; relative.
    """

    joint: int = Field(ge=1)
    rel_error: float
    rel_std: float


class CommonError(ResultModel):
    """An error of the mass that several joints have in common, which no single gain explains.

    Attributes:
        joints: Numbers of the joints, from 1.
        rel_error: Relative error, (estimate - weighed) / weighed.
        rel_std: Standard deviation of `rel_error`, including that of the scale; relative.
        apart: Joints that differ significantly from them.
    """

    joints: list[int]
    rel_error: float
    rel_std: float
    apart: list[Departure]


class Verification(DiagnosedResult):
    """What `rx90 verify --gains G --json` prints.

    Attributes:
        passed: Whether the mass from all joints agrees with the weighed one, that of no joint differs, and a motion
            that was not used in any fit is predicted better than with other gains, if both are given.
        together: Mass from all joints.
        joints: Mass from each joint alone, in order.
        payload: Identifiable values of the payload: mass, centre and inertia.
        common: Error of the mass that joints have in common, null if there is none.
        notes: What the method selected, and remarks.
        unseen: Prediction of a motion that was not used in any fit, null if none is given.
    """

    passed: bool
    mass: float = Field(description="Weighed mass [kg]")
    mass_std: float = Field(description="Standard deviation of the weighed mass [kg]")
    limit: float = Field(description="Number of standard deviations beyond which a mass differs significantly")
    together: Weighed
    joints: list[Weighed]
    payload: list[Quantity]
    common: CommonError | None
    notes: list[str]
    unseen: ResultUnseen | None = None


def verification_result(
    found: weighing.Verification, diagnosed: Diagnosed, unseen: Unseen | None = None
) -> Verification:
    """Return the result of a verification; masses are null if not identifiable."""
    common = weighing.common_error(found)
    return Verification(
        passed=found.passed and (unseen is None or unseen.passed),
        mass=found.payload.mass,
        mass_std=found.payload.mass_std,
        limit=found.limit,
        together=_weighed(found.together),
        joints=list(map(_weighed, found.joints)),
        payload=list(map(_quantity, found.body.quantities)),
        common=None if common is None else _common(common),
        notes=list(found.remarks),
        unseen=None if unseen is None else ResultUnseen.of(unseen),
        **diagnosed_values(diagnosed),
    )


class PredictedJoint(ResultModel):
    """Cross-validation of a joint's currents.

    Attributes:
        joint: Its number, from 1.
        name: Name of the joint in the robot's model.
        predicted_rel_error: Norm of the prediction error, each part of the motions predicted from the others, relative
            to that of the currents.
        fitted_rel_error: Norm of the residual of a fit of all parts, relative to that of the currents.
        gain_changes: Relative change of the gain without each part; empty if the joint is refused.
    """

    joint: int = Field(ge=1)
    name: str
    predicted_rel_error: float
    fitted_rel_error: float
    gain_changes: list[float]


class CrossValidation(DiagnosedResult):
    """What `rx90 verify --json` prints without gains.

    Attributes:
        method: Name of the estimator.
        joints: Joints with rows.
        unseen: Prediction of a motion that was not used in any fit, null if none is given.
    """

    method: str
    joints: list[PredictedJoint]
    unseen: ResultUnseen | None = None


def cross_validation_result(
    identified: Identification, found: Sequence[JointPrediction], unseen: Unseen | None = None
) -> CrossValidation:
    """Return the result of a cross-validation."""
    estimate = identified.estimate
    return CrossValidation(
        method=estimate.method,
        joints=[
            PredictedJoint(
                joint=each.joint + 1,
                name=estimate.joints[each.joint].joint,
                predicted_rel_error=each.share,
                fitted_rel_error=each.fitted,
                gain_changes=each.gain_change.tolist(),
            )
            for each in found
        ],
        unseen=None if unseen is None else ResultUnseen.of(unseen),
        **diagnosed_values(identified.found),
    )


class FoundPayload(DiagnosedResult):
    """What `rx90 payload-of --json` prints.

    Attributes:
        parameters: Identifiable ones of the ten standard parameters.
        covariance: Total covariance of `parameters`, in order and in products of their units [kg m^2, kg m, kg].
        body: Mass, centre and inertia about the centre, as far as identifiable.
        joints: Mass from each joint alone compared with that from all; empty if the latter is not significant.
        notes: What the method selected, and remarks.
    """

    parameters: list[PayloadParameter]
    covariance: list[list[float]]
    body: list[Quantity]
    refused: dict[str, str] = Field(description="Reasons why parameters or quantities have no value, by name")
    possible: bool | None = Field(
        description="Whether the parameters are physically consistent, null if not all are known"
    )
    joints: list[Weighed]
    notes: list[str]


def found_payload_result(
    found: payload.FoundPayload,
    body: payload.FoundBody,
    joints: Sequence[weighing.Weighed],
    diagnosed: Diagnosed,
) -> FoundPayload:
    """Return the result of a payload: parameters, mass, centre and inertia, estimates of single joints."""
    return FoundPayload(
        parameters=[
            PayloadParameter(
                parameter=each.name,
                unit=each.unit,
                estimate=each.value,
                std=each.std,
                residual_std=each.residual_std,
                gain_std=each.gain_std,
                model_std=each.model_std,
            )
            for each in found.parameters
        ],
        covariance=found.shares.total.tolist(),
        body=list(map(_quantity, body.quantities)),
        refused={**found.refused, **body.refused},
        possible=body.possible,
        joints=list(map(_weighed, joints)),
        notes=list(found.selected.remarks),
        **diagnosed_values(diagnosed),
    )


def _common(common: weighing.CommonError) -> CommonError:
    return CommonError(
        joints=[joint + 1 for joint in common.joints],
        rel_error=common.rel_error,
        rel_std=common.rel_std,
        apart=[Departure(**asdict(each) | {"joint": each.joint + 1}) for each in common.apart],
    )


def _weighed(each: weighing.Weighed) -> Weighed:
    mass = each.mass
    return Weighed(
        joint=None if each.joint is None else each.joint + 1,
        mass=mass and mass.value,
        std=mass and mass.std,
        residual_std=mass and mass.residual_std,
        gain_std=mass and mass.gain_std,
        model_std=mass and mass.model_std,
        rel_error=each.rel_error,
        rel_std=each.rel_std,
        verdict=each.verdict,
        reason=each.reason,
    )


def _quantity(each: payload.Quantity) -> Quantity:
    return Quantity(
        quantity=each.name,
        unit=each.unit,
        estimate=each.value,
        std=each.std,
        residual_std=each.residual_std,
        gain_std=each.gain_std,
        model_std=each.model_std,
    )
