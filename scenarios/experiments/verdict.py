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

    joint: int = Field(ge=1)  # number of the joint, from 1
    true: float | None  # injected gain, in `unit`
    estimate: float | None  # identified gain, in `unit`, null if refused
    std: float | None  # total standard deviation of the estimate, in `unit`
    rel_error: float | None  # relative error of the estimate
    z: float | None  # error of the estimate in standard deviations, error over `std`
    tolerance: float | None  # largest relative error that passes
    identifiable: bool  # whether there is an estimate
    passed: bool | None  # whether the result is what the scenario expects
    reason: str | None  # why the joint is refused


class ArmError(ResultModel):
    """Identifiable parameters of the arm, all of one kind."""

    quantity: str  # kind of the parameters: first moments, including the masses, or inertias
    assumed: float  # relative error with the assumed gains: norm of the error over norm of the true parameters
    assumed_std: float  # expected rms of this relative error, from the standard deviations
    found: float | None  # relative error with the identified gains
    found_std: float | None  # expected rms of this relative error
