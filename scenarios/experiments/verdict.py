"""What a judgement says of a gain and of the arm, and what is judged; without the simulator."""

from typing import NamedTuple

from pydantic import Field

from scenarios.rendering.result import ResultModel


class Claim(NamedTuple):
    """The answer of a method for one joint; each is None if it does not apply."""

    value: float | None  # gain [N m / drive unit]
    std: float | None  # its total standard deviation
    reason: str | None  # of a refusal


class GainVerdict(ResultModel):
    """One joint's gain; fields that need a true value are null if it is unknown."""

    joint: int = Field(ge=1, description="Number of the joint, from 1")
    true: float | None = Field(description="Injected gain, in `unit`")
    estimate: float | None = Field(description="Identified gain, in `unit`, null if refused")
    std: float | None = Field(description="Total standard deviation of the estimate, in `unit`")
    rel_error: float | None = Field(description="Relative error of the estimate")
    z: float | None = Field(description="Error of the estimate in standard deviations, error over `std`")
    tolerance: float | None = Field(description="Largest relative error that passes")
    identifiable: bool = Field(description="Whether there is an estimate")
    passed: bool | None = Field(description="Whether the result is what the scenario expects")
    reason: str | None = Field(description="Why the joint is refused")


class ArmError(ResultModel):
    """Identifiable parameters of the arm, all of one kind."""

    quantity: str = Field(description="Kind of the parameters: first moments, including the masses, or inertias")
    assumed: float = Field(
        description="Relative error with the assumed gains: norm of the error over norm of the true parameters"
    )
    assumed_std: float = Field(description="Expected rms of this relative error, from the standard deviations")
    found: float | None = Field(description="Relative error with the identified gains")
    found_std: float | None = Field(description="Expected rms of this relative error")
