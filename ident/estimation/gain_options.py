"""Options: when a gain counts as identifiable, and how its uncertainty is estimated."""

from dataclasses import dataclass, field
from typing import Annotated

from annotated_types import Interval

from ident.estimation.intervals import UNCERTAINTIES
from ident.support.errors import OptionError
from ident.support.options import NAMES, refuse_outside, unknown_name


@dataclass(frozen=True, slots=True, kw_only=True)
class GainOptions:
    """Required accuracy of a gain, and estimation of its uncertainty.

    Attributes:
        max_rel_std: Largest predicted relative standard deviation of a gain that is not refused.
        noise_floor: Residual that any real drive has, as a share of the joint's rms current. A prediction never
            assumes less, so that a simulation without noise does not make a joint look identifiable.
        rank_tol: Smallest relative singular value of the scaled observation matrix.
        uncertainty: Method that estimates the covariance.
    """

    max_rel_std: Annotated[float, Interval(gt=0.0, le=1e6)] = 0.1
    noise_floor: Annotated[float, Interval(ge=0.0, le=1e3)] = 0.05
    rank_tol: Annotated[float, Interval(gt=0.0, lt=1.0)] = 1e-7
    uncertainty: str = field(default="cautious", metadata={NAMES: UNCERTAINTIES})

    def __post_init__(self) -> None:
        """Check the values; raises `OptionError`."""
        refuse_outside(self, OptionError)
        if self.uncertainty not in UNCERTAINTIES:
            raise unknown_name("uncertainty", self.uncertainty, UNCERTAINTIES)
