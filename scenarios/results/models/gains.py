"""A joint's gain and a payload's parameter in results."""

from dataclasses import asdict
from typing import TYPE_CHECKING

from pydantic import Field

from ident.estimation.estimate import FoundParameter, IdentifiedGain, JointResult, RefusedGain
from scenarios.support.result_model import ResultModel

if TYPE_CHECKING:  # not needed by a process that only identifies
    from scenarios.experiments.judge import GainVerdict


class ResultGain(ResultModel):
    """One joint's gain; fields that need a true value are null if it is unknown."""

    joint: int = Field(ge=1, description="Number of the joint, from 1")
    true: float | None = Field(description="Injected gain [N m / drive unit]")
    estimate: float | None = Field(description="Identified gain [N m / drive unit], null if refused")
    std: float | None = Field(description="Total standard deviation of the estimate [N m / drive unit]")
    rel_error: float | None = Field(description="Relative error of the estimate")
    z: float | None = Field(description="Error of the estimate in standard deviations, error over `std`")
    tolerance: float | None = Field(description="Largest relative error that passes")
    identifiable: bool = Field(description="Whether there is an estimate")
    passed: bool | None = Field(description="Whether the result is what the scenario expects")
    reason: str | None = Field(description="Why the joint is refused")
    name: str | None = Field(None, description="Name of the joint in the robot's model")
    residual_std: float | None = Field(None, description="Contribution of the residuals to `std` [N m / drive unit]")
    payload_std: float | None = Field(
        None, description="Contribution of the payload's specified uncertainty [N m / drive unit]"
    )
    model_std: float | None = Field(None, description="Contribution of the model's assumptions [N m / drive unit]")
    predicted_rel_std: float | None = Field(None, description="Predicted relative standard deviation of the gain")

    @classmethod
    def of(cls, joint: int, found: JointResult, verdict: "GainVerdict | None" = None) -> "ResultGain":
        """Return the result of a joint, from 1, with its verdict if the true gain is known."""
        gain = found if isinstance(found, IdentifiedGain) else None
        values: dict[str, object] = {
            "joint": joint,
            "true": None,
            "estimate": gain and gain.value,
            "std": gain and gain.std,
            "rel_error": None,
            "z": None,
            "tolerance": None,
            "identifiable": gain is not None,
            "passed": None,
            "reason": found.reason if isinstance(found, RefusedGain) else None,
        }
        return cls.model_validate(
            {
                **(values if verdict is None else asdict(verdict)),
                "name": found.joint,
                "residual_std": gain and gain.residual_std,
                "payload_std": gain and gain.payload_std,
                "model_std": gain and gain.model_std,
                "predicted_rel_std": found.predicted_rel_std,
            }
        )


class ResultParameter(ResultModel):
    """A parameter of the payload that the method also estimates."""

    parameter: str = Field(description="Name of the parameter: XX to ZZ, MX, MY, MZ or M")
    true: float | None = Field(
        default=None, description="True value of the mounted payload, null if unknown [kg m^2, kg m or kg]"
    )
    estimate: float = Field(description="Estimate [kg m^2, kg m or kg]")
    std: float = Field(
        description="Standard deviation of the estimate, including that of the gains [kg m^2, kg m or kg]"
    )

    @classmethod
    def of(cls, found: FoundParameter, true: float | None) -> "ResultParameter":
        """Return an estimated parameter with its true value."""
        return cls(parameter=found.name, true=true, estimate=found.value, std=found.std)
