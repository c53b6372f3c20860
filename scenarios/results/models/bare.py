"""What bare motions alone say of gains."""

from pydantic import Field

from ident.arm_parameters.parameter_values import Parameter
from scenarios.results.models.diagnoses import DiagnosedResult
from scenarios.results.models.links import Links
from scenarios.support.result_model import ResultModel


class BareParameter(ResultModel):
    """A parameter that bare motions show."""

    parameter: str = Field(
        description="Its name as in the literature, numbered by joint; several if only their sum is identifiable"
    )
    unit: str = Field(description="Of its numbers")
    estimate: float = Field(description="What was found, in `unit`")
    std: float = Field(description="One standard deviation, that of the gains included where they are given, in `unit`")

    @classmethod
    def of(cls, found: Parameter) -> "BareParameter":
        """A parameter as it was found."""
        return cls(parameter=found.name, unit=found.unit, estimate=found.value, std=found.std)


class BareJoint(ResultModel):
    """A joint's gain over that of the reference joint, and its friction in drive units.

    Attributes:
        joint: Its number, from 1.
        name: Of the joint in the robot's model.
        ratio: Ratio of its gain to that of the reference joint, null where the motions do not show it.
        rel_std: Relative standard deviation of the ratio, 0 for the reference joint; null with the ratio.
        predicted_rel_std: The same, of a refused ratio too.
        reason: Why there is no ratio, null if there is one.
        gain: Its given gain [N m / drive unit], which base parameters in SI and links rest on; null if none is given.
        off_std: Standard deviation of `off`, a share too, that of the given gains included.
        predicted_rel_error: Norm of the error of its currents' prediction, each part of the motions from the others,
            relative to that of the currents; null where it has no row.
        fitted_rel_error: The same of the residual, relative too, where all parts are fitted to.
        friction: Friction and offset of the joint.
    """

    joint: int = Field(ge=1)
    name: str
    ratio: float | None
    rel_std: float | None
    predicted_rel_std: float
    reason: str | None
    gain: float | None = None
    off: float | None = Field(description="relative difference of this ratio from that of the given gains")
    off_std: float | None
    predicted_rel_error: float | None = None
    fitted_rel_error: float | None = None
    friction: list[BareParameter]


class ExpectedJoint(ResultModel):
    """What a payload would make of a joint's gain."""

    joint: int = Field(ge=1, description="Its number, from 1")
    rel_std: float | None = Field(
        description="Predicted relative standard deviation of the gain, null if it would be refused"
    )
    reason: str | None = Field(description="Why there is none, null if there is one")


class ExpectedGains(ResultModel):
    """What to expect of the gains if the same motions were repeated with a payload."""

    mass: float = Field(description="Of the payload [kg]")
    joints: list[ExpectedJoint] = Field(description="One entry per joint, in their order")


class BareResult(DiagnosedResult):
    """What `rx90 identify --json` prints of bare recordings alone."""

    reference: int = Field(
        ge=1, description="Number, from 1, of the joint relative to which the other gains are most certain"
    )
    joints: list[BareJoint] = Field(description="One entry per joint, in their order")
    base_parameters: list[BareParameter] = Field(description="Of the arm, divided by the gain of the reference joint")
    base_parameters_si: list[BareParameter] | None = Field(
        description="The same in SI units, with the gains that are given; null without any"
    )
    if_loaded: ExpectedGains | None = Field(description="Gains to expect with a payload, null without `--if-loaded`")
    consistent: Links | None = Field(
        description=(
            "Physically consistent links nearest to the model's; null without `--gains`, or if the model has none"
        )
    )
    consistent_reason: str | None = Field(description="Why there are none, null if there are")
    notes: list[str] = Field(description="Choices of the method, and remarks")
