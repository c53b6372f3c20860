"""What `rx90 verify` and `rx90 payload-of` print: payloads found from currents, and gains held against a scale."""

from collections.abc import Sequence
from dataclasses import asdict

from pydantic import Field

import ident.payload_identification.common_scale as common_scale
import ident.payload_identification.payload_body as payload_body
import ident.payload_identification.payload_estimate as payload_estimate
import ident.payload_identification.verification as verification
from ident.diagnosis.diagnosis import Diagnosed
from ident.estimation.cross_validation import JointPrediction
from ident.identification import Identification
from ident.model.parameters import UNITS
from ident.unseen import Unseen
from scenarios.results.models.diagnoses import DiagnosedResult, diagnosed_values
from scenarios.results.models.unseen import ResultUnseen
from scenarios.support.result_model import ResultModel


class Deviations(ResultModel):
    """A number and what its deviation is made of; null where the data do not show it.

    Attributes:
        estimate: What was found, in `unit`.
        std: One standard deviation, of all parts together, in `unit`.
        residual_std: The part of it from the residuals, in `unit`.
        gain_std: The part of it from the deviations of the gains, in `unit`.
        model_std: The part of it from the model's assumptions, in `unit`.
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
    """Mass, a coordinate of the centre, or an inertia about it."""


class _Parameter(ResultModel):
    parameter: str = Field(description="Name of the parameter: XX to ZZ, MX, MY, MZ or M")
    unit: str = Field(description="Unit of the values")


class PayloadParameter(Deviations, _Parameter):
    """A standard parameter at the origin of the last frame."""


class Weighed(ResultModel):
    """A known mass as all joints (joint null) or one joint weighs it [kg].

    Attributes:
        joint: The joint's number, from 1; null for all joints together.
        mass: What was found, null where the data do not show it [kg].
        std: One standard deviation of the mass, of all parts together; that of the scale is not in it [kg].
        residual_std: The part of it from the residuals [kg].
        gain_std: The part of it from the deviations of the gains [kg].
        model_std: The part of it from the model's assumptions [kg].
        rel_error: Relative error, found less stated over stated: the share by which the gains are too large.
        rel_std: Its standard deviation, relative to the stated mass as well, that of the scale included.
        verdict: "agrees", "differs" or "says nothing".
        reason: Why it says nothing.
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
    """A joint whose mass departs from that of the others.

    Attributes:
        joint: Its number, from 1.
        rel_error: Relative error, its mass over that of the others, less one.
        rel_std: Its standard deviation, relative as well.
    """

    joint: int = Field(ge=1)
    rel_error: float
    rel_std: float


class CommonError(ResultModel):
    """A mass on which joints agree and which differs from the scale: no single gain explains it.

    Attributes:
        joints: Their numbers, from 1.
        rel_error: Relative error, found less stated over stated.
        rel_std: Its standard deviation, relative as well, that of the scale included.
        apart: Joints that depart from them beyond their intervals.
    """

    joints: list[int]
    rel_error: float
    rel_std: float
    apart: list[Departure]


class Verification(DiagnosedResult):
    """What `rx90 verify --gains G --json` prints.

    Attributes:
        passed: Whether the mass from all joints agrees with the scale, that of no joint differs, and a motion that no
            fit has seen is predicted better than with other gains, where both are given.
        together: The mass from all joints.
        joints: The mass from each joint alone, in their order.
        payload: What was found of the payload: mass, centre and inertia, as many as the data show.
        common: Error on which joints agree against the scale, null where they do not agree.
        notes: Choices of the method, and remarks.
        unseen: How well a motion that was not used in any fit is predicted, null where none is given.
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
    found: verification.Verification, diagnosed: Diagnosed, unseen: Unseen | None = None
) -> Verification:
    """What a scale says of gains; masses are null where they do not show."""
    common = common_scale.common_error(found)
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
    """How well a joint's currents are predicted from other parts of the motions.

    Attributes:
        joint: Its number, from 1.
        name: Of the joint in the robot's model.
        predicted_rel_error: Norm of the error of the prediction, each part of the motions from the others, relative to
            that of the currents.
        fitted_rel_error: Norm of the residual relative to that of the currents, where all parts are fitted to.
        gain_changes: Relative change of the gain without each part; empty where the joint is refused.
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
        joints: Those that have rows.
        unseen: How well a motion that was not used in any fit is predicted, null where none is given.
    """

    method: str
    joints: list[PredictedJoint]
    unseen: ResultUnseen | None = None


def cross_validation_result(
    identified: Identification, found: Sequence[JointPrediction], unseen: Unseen | None = None
) -> CrossValidation:
    """How well parts of the motions are predicted from the others."""
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
        parameters: As many of the ten standard parameters as the data show.
        covariance: Of `parameters`, in their order and in products of their units [kg m^2, kg m, kg]; of all parts of
            the deviations together.
        body: Mass, centre and inertia about it, as many as follow from the parameters.
        joints: The mass from each joint alone against that from all; empty if it is not sure.
        notes: Choices of the method, and remarks.
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
    found: payload_estimate.FoundPayload,
    body: payload_body.FoundBody,
    joints: Sequence[verification.Weighed],
    diagnosed: Diagnosed,
) -> FoundPayload:
    """A payload: parameters at the origin of the last frame with covariance, mass, centre and inertia, joints alone."""
    return FoundPayload(
        parameters=[
            PayloadParameter(
                parameter=name,
                unit=UNITS[name],
                estimate=float(found.value[k]),
                std=float(found.covariance[k, k] ** 0.5),
                residual_std=float(found.residual[k, k] ** 0.5),
                gain_std=float(found.gains[k, k] ** 0.5),
                model_std=float(found.model[k, k] ** 0.5),
            )
            for k, name in enumerate(found.names)
        ],
        covariance=found.covariance.tolist(),
        body=list(map(_quantity, body.quantities)),
        refused={**found.refused, **body.refused},
        possible=body.possible,
        joints=list(map(_weighed, joints)),
        notes=list(found.selected.remarks),
        **diagnosed_values(diagnosed),
    )


def _common(common: common_scale.CommonError) -> CommonError:
    return CommonError(
        joints=[joint + 1 for joint in common.joints],
        rel_error=common.rel_error,
        rel_std=common.rel_std,
        apart=[Departure(**asdict(each) | {"joint": each.joint + 1}) for each in common.apart],
    )


def _weighed(each: verification.Weighed) -> Weighed:
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


def _quantity(each: payload_body.Quantity) -> Quantity:
    return Quantity(
        quantity=each.name,
        unit=each.unit,
        estimate=each.value,
        std=each.std,
        residual_std=each.residual_std,
        gain_std=each.gain_std,
        model_std=each.model_std,
    )
