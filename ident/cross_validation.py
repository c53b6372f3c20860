"""Cross-validation: gains from part of each motion, currents predicted on the rest.

Each motion is cut into stretches of time. To first order, an estimate without one stretch differs by the influence of
its rows times the residual they have when they are not fitted to (`ident.uncertainty.jackknife`); no fit is repeated.
What the model lacks in every stretch alike stays unseen: of that only another weight can tell.
"""

from dataclasses import dataclass

import numpy as np

from ident.arrays import Array
from ident.estimate import GainEstimate, IdentifiedGain
from ident.uncertainty.jackknife import left_out

STRETCHES = 5
"""Parts that each motion is cut into; gains come from the others."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointPrediction:
    """How well a joint's currents are predicted where the estimate has not seen them.

    Attributes:
        joint: The joint, from 0.
        share: Norm of the prediction's error over that of the currents.
        fitted: The same of the residual where all rows are fitted to.
        gain_change: Relative changes of the gain without each stretch, shape (parts,); empty for a refused joint.
    """

    joint: int
    share: float
    fitted: float
    gain_change: Array


def cross_validated(estimate: GainEstimate, stretches: int = STRETCHES) -> tuple[JointPrediction, ...]:
    """Predict every stretch of every motion from the others, joint by joint.

    Args:
        estimate: Gains with the rows they were found from.
        stretches: Parts that each motion is cut into.

    Returns:
        One result for each joint that has rows.
    """
    solution, rows = estimate.solution, estimate.solution.rows
    parts = left_out(rows, stretches)
    error = np.zeros(len(rows.V))
    for block, fresh in parts:
        error[block] = fresh
    # 1/g without a block is 1/g less the influence of its rows times what they would be off by; dg / g = -g d(1/g)
    moved = np.array([solution.influence[:, block] @ fresh for block, fresh in parts])  # (parts, k)
    changes = moved / solution.inverse
    found = list[JointPrediction]()
    for joint in rows.unknowns:
        own = rows.of(joint)
        at = np.flatnonzero(solution.joints == joint)
        given = len(at) > 0 and isinstance(estimate.joints[joint], IdentifiedGain)
        found.append(
            JointPrediction(
                joint=joint,
                share=float(np.linalg.norm(error[own]) / np.linalg.norm(rows.V[own])),
                fitted=rows.residual_share(joint),
                gain_change=changes[:, at[0]] if given else np.zeros(0),
            )
        )
    return tuple(found)
