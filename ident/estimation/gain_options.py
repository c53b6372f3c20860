"""When a gain counts as identifiable, and how its uncertainty is found."""

from dataclasses import dataclass, field

from ident.estimation.uncertainty import UNCERTAINTIES
from ident.support.options import NAMES, check_range, unknown_name


@dataclass(frozen=True, slots=True, kw_only=True)
class GainOptions:
    """How sure a gain has to be, and how its uncertainty is found.

    Attributes:
        max_rel_std: Largest predicted relative standard deviation of a gain.
        noise_floor: Residual that any real drive has, as a share of the joint's rms current. A prediction never
            assumes less, so that a simulation without noise does not make a joint look identifiable.
        serial_s: Time after which residuals are taken as unrelated [s].
        rank_tol: Smallest relative singular value of the scaled observation matrix.
        uncertainty: How the covariance is found.
    """

    max_rel_std: float = 0.1
    noise_floor: float = 0.05
    serial_s: float = 1.0
    rank_tol: float = 1e-7
    uncertainty: str = field(default="cautious", metadata={NAMES: UNCERTAINTIES})

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            OptionError: If one makes no sense.
        """
        check_range("max_rel_std", self.max_rel_std, above=0.0, upto=1e6)
        check_range("noise_floor", self.noise_floor, least=0.0, upto=1e3)
        check_range("serial_s", self.serial_s, least=0.0, upto=1e3, unit="s")
        check_range("rank_tol", self.rank_tol, above=0.0, below=1.0)
        if self.uncertainty not in UNCERTAINTIES:
            raise unknown_name("uncertainty", self.uncertainty, UNCERTAINTIES)
