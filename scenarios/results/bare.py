"""Results of bare motions."""

from pydantic import Field

from ident.parameters.arm import Parameter
from scenarios.rendering.result import ResultModel
from scenarios.results.diagnoses import DiagnosedResult
from scenarios.results.links import Links


class BareParameter(ResultModel):
    """A parameter identified from bare motions."""

    parameter: str = Field(
        description="Name of the parameter, numbered by joint; several names if only their sum is identifiable"
    )
    unit: str = Field(description="Unit of the values")
    estimate: float = Field(description="Estimate, in `unit`")
    std: float = Field(description="Standard deviation, in `unit`, including that of the gains if these are given")

    @classmethod
    def of(cls, found: Parameter) -> "BareParameter":
        """Return an identified parameter."""
        return cls(parameter=found.name, unit=found.unit, estimate=found.value, std=found.std)


class BareJoint(ResultModel):
    """A joint's gain over that of the reference joint, and its friction in drive units.

    Attributes:
        joint: Number of the joint, from 1.
        name: Name of the joint in the robot's model.
        ratio: Ratio of its gain to that of the reference joint, null if not identifiable.
        rel_std: Relative standard deviation of the ratio, 0 for the reference joint; null with the ratio.
        predicted_rel_std: Predicted relative standard deviation, also for a refused ratio.
        reason: Why there is no ratio, null if there is one.
        gain: Given gain used for base parameters in SI and links [N m / drive unit]; null if none is given.
        off_std: Standard deviation of `off`, including that of the given gains; relative.
        predicted_rel_error: Norm of the prediction error of its currents, each part of the motions predicted from the
            others, relative to that of the currents; null without rows.
        fitted_rel_error: Norm of the residual of a fit of all parts, relative to that of the currents.
        friction: Friction and offset of the joint.
    """

    joint: int = Field(ge=1)
    name: str
    ratio: float | None
    rel_std: float | None
    predicted_rel_std: float
    reason: str | None
    gain: float | None = None
    off: float | None = Field(description="Relative difference between this ratio and that of the given gains")
    off_std: float | None
    predicted_rel_error: float | None = None
    fitted_rel_error: float | None = None
    friction: list[BareParameter]


class ExpectedJoint(ResultModel):
    """Expected accuracy of a joint's gain with a payload."""

    joint: int = Field(ge=1, description="Number of the joint, from 1")
    rel_std: float | None = Field(
        description="Predicted relative standard deviation of the gain, null if it would be refused"
    )
    reason: str | None = Field(description="Why the gain would be refused, null if it would not")


class ExpectedGains(ResultModel):
    """Expected gains if the same motions were repeated with a payload."""

    mass: float = Field(description="Mass of the payload [kg]")
    joints: list[ExpectedJoint] = Field(description="One entry per joint, in order")


class BareResult(DiagnosedResult):
    """What `rx90 identify --json` prints for bare recordings alone."""

    reference: int = Field(
        ge=1, description="Number of the reference joint, from 1: the one that gives the most accurate ratios"
    )
    joints: list[BareJoint] = Field(description="One entry per joint, in order")
    base_parameters: list[BareParameter] = Field(
        description="Base parameters of the arm, divided by the gain of the reference joint"
    )
    base_parameters_si: list[BareParameter] | None = Field(
        description="Base parameters in SI units, with the given gains; null without gains"
    )
    if_loaded: ExpectedGains | None = Field(description="Expected gains with a payload, null without `--if-loaded`")
    consistent: Links | None = Field(
        description=(
            "Physically consistent links nearest to the model's; null without `--gains`, or if the model has no masses"
        )
    )
    consistent_reason: str | None = Field(description="Why there are no such links, null if there are")
    notes: list[str] = Field(description="What the method selected, and remarks")
