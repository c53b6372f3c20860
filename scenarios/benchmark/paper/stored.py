"""The result of `rx90 paper`, read back as the values that its tables are made of."""

from collections.abc import Mapping
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from ident.model.parameters import INERTIAL


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True, allow_inf_nan=False)


class PaperGain(_Table):
    """The drive gain of one joint by eq. 27; a refused one has a reason in place of an estimate."""

    joint: int
    true: float
    estimate: float | None
    std: float | None
    reason: str | None


class PaperParameter(_Table):
    """One inertial parameter of a payload."""

    parameter: str
    true: float
    estimate: float
    std: float
    essential: bool


class PaperFit(_Table):
    """How well a case explains its rows."""

    rows: int
    unknowns: int
    error_norm: float
    rel_error_norm: float
    sigma: float


class PaperCase(_Table):
    """A payload identified with given gains.

    Attributes:
        gains: In use [N m / drive unit].
        payload: The ten parameters, in the order of `INERTIAL`.
        fit: How well its rows are explained.
    """

    gains: tuple[float, ...]
    payload: Annotated[tuple[PaperParameter, ...], Field(min_length=len(INERTIAL), max_length=len(INERTIAL))]
    fit: PaperFit

    def __getitem__(self, name: str) -> PaperParameter:
        """The parameter of that name."""
        return self.payload[INERTIAL.index(name)]


class PaperClaim(_Table):
    """A claim of the paper and whether it holds."""

    claim: str
    holds: bool


class StoredPaper(_Table):
    """The result of `rx90 paper`."""

    gains: tuple[PaperGain, ...]
    cases: tuple[PaperCase, PaperCase, PaperCase]
    second_payload: PaperCase
    checks: tuple[PaperClaim, ...]
    passed: bool


def stored_paper(document: Mapping[str, object]) -> StoredPaper:
    """The values of a result.

    Raises:
        pydantic.ValidationError: If they are not all there.
    """
    return StoredPaper.model_validate(document)
