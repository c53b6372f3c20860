"""Values published by Gautier and Briot (2011): tables 2, 3 and 4, and the second payload of section V."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class PublishedCase:
    """One case of tables 2 and 4.

    Attributes:
        MZ: First moment [kg m].
        MZ_2sigma: Two standard deviations [kg m].
        M: Mass [kg].
        M_2sigma: Two standard deviations [kg].
        error_norm: Norm of the residual of the weighted system.
        rel_error_norm: `error_norm` over the norm of the left side.
        sigma: Standard deviation of the residual.
    """

    MZ: float
    MZ_2sigma: float
    M: float
    M_2sigma: float
    error_norm: float
    rel_error_norm: float
    sigma: float


CASES = (
    PublishedCase(
        MZ=1.04, MZ_2sigma=0.0378, M=6.71, M_2sigma=0.158, error_norm=77.28, rel_error_norm=0.075643, sigma=1.16293
    ),
    PublishedCase(
        MZ=0.934, MZ_2sigma=0.0449, M=7.17, M_2sigma=0.162, error_norm=76.11, rel_error_norm=0.0744996, sigma=1.14535
    ),
    PublishedCase(
        MZ=0.867, MZ_2sigma=0.0453, M=8.65, M_2sigma=0.198, error_norm=85.85, rel_error_norm=0.0840385, sigma=1.29288
    ),
)
GAINS = (0.9401, 0.9619, 1.1148, 0.9146)
"""Table 3, joints 1 to 4 [N m / drive unit]."""
GAINS_2SIGMA = (0.0817, 0.0357, 0.0372, 0.0503)
ROWS_LESS_UNKNOWNS = 4416
"""(77.28 / 1.16293)^2, exactly."""
SECOND_MASS = 4.35
SECOND_MASS_2SIGMA = 0.150
"""The second payload, weighed as 4.275 kg [kg]."""
