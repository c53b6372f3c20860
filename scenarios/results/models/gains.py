"""A joint's gain and a payload's parameter, as results have them."""

from dataclasses import asdict
from typing import TYPE_CHECKING

from pydantic import Field

from ident.estimation.estimate import FoundParameter, IdentifiedGain, JointResult, RefusedGain
from scenarios.support.result_model import ResultModel

if TYPE_CHECKING:  # a process that only identifies has nothing to judge
    from scenarios.experiments.judge import GainVerdict


class ResultGain(ResultModel):
    """One joint's gain; what needs a truth is null where there is none.

    Attributes:
        joint: Its number, from 1.
        true: Injected gain [N m / drive unit].
        std: Standard deviation of the estimate, all shares together [N m / drive unit].
        rel_error: Relative error of the estimate.
        z: Error of the estimate in standard deviations, error over `std`.
        tolerance: Relative error that passes.
        identifiable: Whether there is an estimate.
        passed: Whether the joint is as its scenario wants it.
        reason: Why the joint is refused.
        name: Of the joint in the robot's model.
        residual_std: Share of the residuals [N m / drive unit].
        payload_std: Share of what is stated of the payload [N m / drive unit].
        model_std: Share of what the model takes for granted [N m / drive unit].
        total_std: The same as `std` [N m / drive unit].
        predicted_rel_std: Relative standard deviation that the payload lets one expect.
    """

    joint: int = Field(ge=1)
    true: float | None
    estimate: float | None = Field(description="[N m / drive unit], null if refused")
    std: float | None
    rel_error: float | None
    z: float | None
    tolerance: float | None
    identifiable: bool
    passed: bool | None
    reason: str | None
    name: str | None = None
    residual_std: float | None = None
    payload_std: float | None = None
    model_std: float | None = None
    total_std: float | None = None
    predicted_rel_std: float | None = None

    @classmethod
    def of(cls, joint: int, found: JointResult, verdict: "GainVerdict | None" = None) -> "ResultGain":
        """What was found of a joint, from 1, and how it was judged if there was a truth."""
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
                "total_std": gain and gain.std,
                "predicted_rel_std": found.predicted_rel_std,
            }
        )


class ResultParameter(ResultModel):
    """A parameter of the payload that the method found on its way; `tolerance` and `passed` are null.

    Attributes:
        parameter: Its name: XX to ZZ, MX, MY, MZ or M.
        true: Of what was mounted, null where that is not known [kg m^2, kg m or kg].
        estimate: What was found [kg m^2, kg m or kg].
        std: One standard deviation, that of the gains included [kg m^2, kg m or kg].
        tolerance: Always null: nothing is asked of it [kg m^2, kg m or kg].
        passed: Always null.
    """

    parameter: str
    true: float | None = None
    estimate: float
    std: float
    tolerance: float | None = None
    passed: bool | None = None

    @classmethod
    def of(cls, found: FoundParameter, true: float | None) -> "ResultParameter":
        """What was found, beside the truth."""
        return cls(parameter=found.name, true=true, estimate=found.value, std=found.std)
