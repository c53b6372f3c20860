"""Ratios of gains from bare motions against gains believed beforehand."""

from dataclasses import dataclass

import numpy as np

from ident.arm_parameters.bare import GainRatios
from ident.estimation.known_gains import KnownGains


@dataclass(frozen=True, slots=True, kw_only=True)
class RatioDiscrepancy:
    """A gain beside what another joint says of it, against gains believed beforehand.

    Attributes:
        joint: The joint, from 0.
        rel: (g_j / g_r) here over that of the gains believed, less 1.
        std: Standard deviation of `rel`, that of the gains believed included: as `rel`, a share of what is believed.
    """

    joint: int
    rel: float
    std: float


def ratio_discrepancies(ratios: GainRatios, believed: KnownGains) -> tuple[RatioDiscrepancy, ...]:
    """Ratios of gains against those of gains believed beforehand; none if the reference has no such gain.

    Args:
        ratios: From bare motions.
        believed: Gains of the same arm, as from data sheets.
    """
    at = {int(joint): k for k, joint in enumerate(believed.joints)}
    if ratios.reference not in at:
        return ()
    r, C = at[ratios.reference], believed.log_covariance
    found = list[RatioDiscrepancy]()
    for joint, k in at.items():
        if joint != ratios.reference and ratios.given[joint]:
            share = float(ratios.value[joint] / (believed.value[k] / believed.value[r]))
            spread = float(C[k, k] + C[r, r] - 2.0 * C[k, r])
            std = abs(share) * float(np.sqrt(ratios.rel_std[joint] ** 2 + max(spread, 0.0)))
            found.append(RatioDiscrepancy(joint=joint, rel=share - 1.0, std=std))
    return tuple(found)
