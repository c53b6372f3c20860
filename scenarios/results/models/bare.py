"""What bare motions alone say of gains."""

from pydantic import Field

from ident.arm_parameters.parameter_values import Parameter
from scenarios.results.models.diagnoses import DiagnosedResult
from scenarios.results.models.links import Links
from scenarios.support.result_model import ResultModel


class BareParameter(ResultModel):
    """A parameter that bare motions show.

    Attributes:
        parameter: Its name as in the literature, numbered by joint; several where only their sum shows.
        unit: Of its numbers.
        estimate: What was found, in `unit`.
        std: One standard deviation, that of the gains included where they are given, in `unit`.
    """

    parameter: str
    unit: str
    estimate: float
    std: float

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
    off: float | None = Field(description="relative difference of the given gains' ratio from this one")
    off_std: float | None
    predicted_rel_error: float | None = None
    fitted_rel_error: float | None = None
    friction: list[BareParameter]


class ExpectedJoint(ResultModel):
    """What a payload would make of a joint's gain.

    Attributes:
        joint: Its number, from 1.
        rel_std: Relative standard deviation to expect of the gain, null if it would be refused.
        reason: Why there is none, null if there is one.
    """

    joint: int = Field(ge=1)
    rel_std: float | None
    reason: str | None


class ExpectedGains(ResultModel):
    """What to expect of the gains if the same motions were repeated with a payload.

    Attributes:
        mass: Of the payload [kg].
        joints: One entry a joint, in their order.
    """

    mass: float
    joints: list[ExpectedJoint]


class BareResult(DiagnosedResult):
    """What `rx90 identify --json` prints of bare recordings alone.

    Attributes:
        reference: Number, from 1, of the joint beside which the others are surest.
        joints: One entry a joint, in their order.
        base_parameters: Of the arm, over the gain of the reference joint.
        base_parameters_si: The same with gains that are given, null without any.
        if_loaded: What a payload would add, null unless `--if-loaded` asks.
        consistent: Links that bodies can have, nearest to the model's; null without `--gains`, or if the model has no
            bodies.
        consistent_reason: Why there are none, null if there are.
        notes: What the method chose and what one should know.
    """

    reference: int = Field(ge=1)
    joints: list[BareJoint]
    base_parameters: list[BareParameter]
    base_parameters_si: list[BareParameter] | None
    if_loaded: ExpectedGains | None
    consistent: Links | None
    consistent_reason: str | None
    notes: list[str]
