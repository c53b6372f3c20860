"""The result of `rx90 paper`: what it prints, and what is read back for its page."""

from typing import Annotated

from pydantic import ConfigDict, Field

from ident.model.parameters import INERTIAL
from scenarios.support.result_model import ResultModel


class _Finite(ResultModel):
    model_config = ConfigDict(frozen=True, allow_inf_nan=False)


class Claim(_Finite):
    """A claim of the paper.

    Attributes:
        claim: In words.
        holds: Whether the simulated experiment confirms it.
    """

    claim: str
    holds: bool


class PaperGain(_Finite):
    """The drive gain of one joint by eq. 27.

    Attributes:
        joint: Its number, from 1.
        true: Injected gain [N m / drive unit].
        estimate: Identified gain [N m / drive unit], null if refused.
        std: Standard deviation of the estimate, from the residual as in the paper [N m / drive unit].
        identifiable: Whether there is an estimate.
        reason: Why the joint is refused.
    """

    joint: int = Field(ge=1)
    true: float
    estimate: float | None
    std: float | None
    identifiable: bool
    reason: str | None


class PaperParameter(_Finite):
    """One of the ten standard parameters of a payload, in SI units.

    Attributes:
        parameter: Its name: XX to ZZ, MX, MY, MZ or M.
        true: Of the payload that was mounted [kg m^2, kg m, kg].
        estimate: What was found [kg m^2, kg m, kg].
        std: Standard deviation of the estimate, that of the gains included [kg m^2, kg m, kg].
        tolerance: None is stated: null.
        passed: Nothing is asked: null.
        known: Whether it was given.
        essential: Whether its relative standard deviation is under 10 %.
    """

    parameter: str
    true: float
    estimate: float
    std: float
    tolerance: None = None
    passed: None = None
    known: bool
    essential: bool


class PaperFit(_Finite):
    """How well a case explains its rows (table 4).

    Attributes:
        method: `ols` or `wls`: whether each joint's rows are weighted by its own residual.
        rows: Of all joints and both motions.
        unknowns: Parameters of arm and payload that are solved for.
        error_norm: Norm of the residuals, each in deviations of its own joint's.
        rel_error_norm: The same as a share of the norm of the torques, weighted likewise.
        sigma: Standard deviation of the residuals, each in deviations of its own joint's.
    """

    method: str
    rows: int
    unknowns: int
    error_norm: float
    rel_error_norm: float
    sigma: float


class PaperPayload(_Finite):
    """A payload identified with given gains.

    Attributes:
        gains: In use, one a joint [N m / drive unit].
        payload: Its ten parameters, each with its true value, estimate and standard deviation, and whether it is
            essential.
        fit: How well its rows are explained.
        published: What the paper prints of it; of the gains, only with case 2.
    """

    gains: tuple[float, ...]
    payload: Annotated[tuple[PaperParameter, ...], Field(min_length=len(INERTIAL), max_length=len(INERTIAL))]
    fit: PaperFit
    published: dict[str, object]

    def __getitem__(self, name: str) -> PaperParameter:
        """The parameter of that name."""
        return self.payload[INERTIAL.index(name)]


class _Numbered(_Finite):
    case: int = Field(ge=1, description="Its number")


class PaperCase(PaperPayload, _Numbered):
    """One of the paper's three cases."""


class WrongGains(_Finite):
    """What the payload and the fit become with gains that are 20 % off, over what they are with those of case 2.

    Attributes:
        signs: Of the errors of joints 1 to 4.
        M: Ratio of the masses.
        MZ: Ratio of the first moments along the flange's axis.
        error_norm: Ratio of the relative error norms.
    """

    signs: str
    M: float
    MZ: float
    error_norm: float


class PaperResult(_Finite):
    """What `rx90 paper --json` prints.

    Attributes:
        gains: Drive gains of all joints, of which cases 2 and 3 use those of joints 1 to 4.
        cases: Cases 1, 2 and 3, each with its number, gains [N m / drive unit], payload parameters, fit and what the
            paper prints of it.
        patterns: What every pattern of signs of the errors of case 3 changes.
        second_payload: The same of the second payload, weighed with the gains of case 2.
        checks: Claims of the paper.
        passed: Whether all of them hold.
    """

    gains: tuple[PaperGain, ...]
    cases: Annotated[tuple[PaperCase, ...], Field(min_length=3, max_length=3)]
    patterns: Annotated[tuple[WrongGains, ...], Field(min_length=16, max_length=16)]
    second_payload: PaperPayload
    checks: tuple[Claim, ...]
    passed: bool
