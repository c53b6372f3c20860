"""An effect that the model lacks, at a size that it may well have: what would it do to the gains, could data tell?

The currents that it adds, p, move each 1/g by the influence of the rows times p. What the fit leaves of p shows how
much of it is there: `s = p'^T e / p'^T p'`, in units of the assumed size, p' being p cleared of all that the fit
explains. What moves gains and shows in no residual is the danger.
"""

from dataclasses import dataclass

import numpy as np

from ident.arrays import Array
from ident.consistency.evidence import Evidence
from ident.consistency.stretches import stretches

NEW = 1e-3
"""Part of an effect that the fit must leave for the residual to show it."""
SHOWN_Z = 4.0
"""Deviations above zero from which on the residual shows an effect."""
UNTOLD = 0.5
"""Part of the assumed size that data must exclude for them to tell."""
SHOWN_MATTERS, UNTOLD_MATTERS = 0.5, 1.5
"""Change of a gain by all that data allow of an effect, in deviations of the gain, that is worth a word: where the
residual shows it, and where it is assumed alone."""
BOUND_Z = 2.0
"""Deviations above what is seen that an effect may still have."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Hidden:
    """An effect of assumed size.

    Attributes:
        seen: How much of it the residual shows, in units of the assumed size.
        std: Deviation of that, infinite where the fit explains all of it.
        moved: Relative change of the gain of each joint with one, by joint, if it is there and not in the model.
    """

    seen: float
    std: float
    moved: dict[int, float]

    @property
    def suspected(self) -> bool:
        """Whether the residual shows it, or cannot tell it from nothing or from half of it."""
        return self.shown or self.possible > UNTOLD

    @property
    def most(self) -> float:
        """Change of a gain by it, in deviations of the gain, above which it is worth a word."""
        return SHOWN_MATTERS if self.shown else UNTOLD_MATTERS

    @property
    def shown(self) -> bool:
        """Whether the residual surely shows some of it."""
        return self.seen > SHOWN_Z * self.std

    @property
    def possible(self) -> float:
        """The largest part of the assumed size that the data allow, 0 to 1."""
        return float(np.clip(self.seen + BOUND_Z * self.std, 0.0, 1.0)) if np.isfinite(self.std) else 1.0


def hidden_effect(evidence: Evidence, added: Array) -> Hidden:
    """What an effect would do, and what is seen of it.

    Args:
        evidence: The estimate.
        added: Current that the effect adds to each row [drive units], shape (r,).
    """
    solution = evidence.estimate.solution
    rows, Q = solution.rows, solution.rows.explained
    moved = -(solution.influence @ added) / solution.inverse  # of g = 1/x
    weighted = rows.weight * added
    known = Q.T @ weighted
    scale = rows.weight * evidence.sigma
    left, error = (weighted - Q @ known) / scale, rows.residual / evidence.sigma
    information = float(left @ left)
    if information <= (NEW * float(np.linalg.norm(added / evidence.sigma))) ** 2:
        seen, std = 0.0, float("inf")
    else:
        seen = float(left @ error) / information
        sums = stretches((left * (error - seen * left))[:, None], rows.motion, rows.position)
        std = float(np.sqrt(max(1.0, float(np.sum(sums**2)) / information) / information))
    return Hidden(seen=seen, std=std, moved={joint: float(moved[k]) for joint, k in evidence.identified.items()})
