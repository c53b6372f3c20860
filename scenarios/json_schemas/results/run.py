"""JSON Schema of the result of a run or an identification."""

from typing import Any

from pydantic import Field

from scenarios.json_schemas.results.diagnoses import Diagnosed
from scenarios.support.result_model import ResultModel


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


class ResultFit(ResultModel):
    """How well the data are explained.

    Attributes:
        method: Name of the estimator.
        rows: Of the linear systems of all joints.
        error_norm: Norm of the residuals of all joints [drive units].
        rel_error_norm: The same as a share of the norm of the currents.
        sigma: Standard deviation of the residuals of all joints [drive units].
    """

    method: str
    rows: int
    error_norm: float
    rel_error_norm: float
    sigma: float


class ResultTiming(ResultModel):
    """Wall times [s].

    Attributes:
        simulate_s: For all motions [s].
        identify_s: For the estimate [s].
    """

    simulate_s: float | None
    identify_s: float


class ResultFinding(ResultModel):
    """A diagnosis that was compared by its predictions of the currents, in short.

    Attributes:
        statistic: What was found, in what `measure` says.
        failed: Whether it matters.
    """

    check: str = Field(description="name of the diagnosis")
    joint: int = Field(ge=1, description="the joint that is affected most")
    statistic: float
    threshold: float = Field(description="above it the statistic is no accident, in what `measure` says")
    measure: str = Field(description="what both are")
    failed: bool
    change: float | None = Field(description="of that joint's gain [%], null where no gain is moved")
    sentence: str | None = Field(description="what it means, null where it does not matter")


class Result(Diagnosed):
    """What `rx90 run --json` and `rx90 identify --json` print.

    Attributes:
        scenario: Its name.
        seed: Of every random number.
        passed: The verdict.
        gains: One a joint, in their order.
        payload: The payload's parameters, where they are found too.
        fit: How well the data are explained.
        timing: Wall times.
        notes: What the method chose and what one should know.
        consistency: Diagnoses that were compared by their predictions, in short.
    """

    scenario: str | None
    seed: int | None
    passed: bool | None
    gains: list[ResultGain]
    payload: list[dict[str, Any]]
    fit: ResultFit
    timing: ResultTiming
    notes: list[str] = Field(default_factory=list[str])
    consistency: list[ResultFinding] = Field(default_factory=list[ResultFinding])
