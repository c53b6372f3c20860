"""The model of the result of `rx90 paper`."""

from typing import Annotated

from pydantic import ConfigDict, Field

from ident.model.parameters import INERTIAL
from scenarios.rendering.result import ResultModel


class _Finite(ResultModel):
    model_config = ConfigDict(frozen=True, allow_inf_nan=False)


class Claim(_Finite):
    """A claim of the paper."""

    claim: str = Field(description="The claim")
    holds: bool = Field(description="Whether the simulated experiment confirms it")


class PaperGain(_Finite):
    """The drive gain of one joint by eq. 27."""

    joint: int = Field(ge=1, description="Number of the joint, from 1")
    true: float = Field(description="Injected gain [N m / drive unit]")
    estimate: float | None = Field(description="Identified gain [N m / drive unit], null if refused")
    std: float | None = Field(
        description="Standard deviation of the estimate, from the residual as in the paper [N m / drive unit]"
    )
    identifiable: bool = Field(description="Whether there is an estimate")
    reason: str | None = Field(description="Why the joint is refused")


class PaperParameter(_Finite):
    """One of the ten standard parameters of a payload, in SI units."""

    parameter: str = Field(description="Name of the parameter: XX to ZZ, MX, MY, MZ or M")
    true: float = Field(description="True value of the mounted payload [kg m^2, kg m, kg]")
    estimate: float = Field(description="Estimate [kg m^2, kg m, kg]")
    std: float = Field(description="Standard deviation of the estimate, including that of the gains [kg m^2, kg m, kg]")
    tolerance: None = Field(default=None, description="Always null: no tolerance is specified")
    passed: None = Field(default=None, description="Always null: the parameter is not judged")
    known: bool = Field(description="Whether its value was given to the identification")
    essential: bool = Field(description="Whether its relative standard deviation is under 10 %")


class PaperFit(_Finite):
    """Quality of the fit of a case (table 4)."""

    method: str = Field(description="`ols` or `wls`: whether each joint's rows are weighted by its own residual")
    rows: int = Field(description="Number of rows of all joints and both motions")
    unknowns: int = Field(description="Number of estimated parameters of arm and payload")
    error_norm: float = Field(description="Norm of the residuals, each in standard deviations of its joint's residuals")
    rel_error_norm: float = Field(description="Ratio of this norm to the norm of the torques, weighted in the same way")
    sigma: float = Field(
        description="Standard deviation of the residuals, each in standard deviations of its joint's residuals"
    )


class PaperPayload(_Finite):
    """A payload identified with given gains."""

    gains: tuple[float, ...] = Field(description="Gains of this case, one per joint [N m / drive unit]")
    payload: Annotated[tuple[PaperParameter, ...], Field(min_length=len(INERTIAL), max_length=len(INERTIAL))] = Field(
        description=(
            "Its ten parameters, each with its true value, estimate and standard deviation, and whether it is essential"
        )
    )
    fit: PaperFit = Field(description="Quality of the fit")
    published: dict[str, object] = Field(description="The values that the paper prints; the gains only with case 2")

    def __getitem__(self, name: str) -> PaperParameter:
        """Return the parameter of that name."""
        return self.payload[INERTIAL.index(name)]


class _Numbered(_Finite):
    case: int = Field(ge=1, description="Number of the case")


class PaperCase(PaperPayload, _Numbered):
    """One of the paper's three cases."""


class WrongGains(_Finite):
    """Payload and fit with gain errors of 20 %, relative to case 2."""

    signs: str = Field(description="Signs of the gain errors of joints 1 to 4")
    M: float = Field(description="Ratio of the estimated masses")
    MZ: float = Field(description="Ratio of the first moments along the flange's axis")
    error_norm: float = Field(description="Ratio of the relative error norms")


class PaperResult(_Finite):
    """What `rx90 paper --json` prints."""

    gains: tuple[PaperGain, ...] = Field(
        description="Drive gains of all joints, of which cases 2 and 3 use those of joints 1 to 4"
    )
    cases: Annotated[tuple[PaperCase, ...], Field(min_length=3, max_length=3)] = Field(
        description=(
            "Cases 1, 2 and 3, each with its number, gains [N m / drive unit], payload parameters, fit and published "
            "values"
        )
    )
    patterns: Annotated[tuple[WrongGains, ...], Field(min_length=16, max_length=16)] = Field(
        description="Effect of each pattern of signs of the gain errors of case 3, relative to case 2"
    )
    second_payload: PaperPayload = Field(description="The second payload, identified with the gains of case 2")
    checks: tuple[Claim, ...] = Field(description="Claims of the paper")
    passed: bool = Field(description="Whether all claims hold")
