"""Cross-validation: gains from part of each motion, currents predicted on the rest.

Each motion is cut into stretches of time. To first order, an estimate without one stretch differs by the influence of
its rows times the residual they have when they are not fitted to (`ident.estimation.uncertainty.jackknife`); no fit is
repeated.
What the model lacks in every stretch alike stays unseen: of that only another weight can tell.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.estimation.estimate import GainEstimate, IdentifiedGain
from ident.estimation.rows import Rows
from ident.estimation.uncertainty.jackknife import left_out
from ident.support.arrays import Array, Indices

TIME_BLOCKS = 5
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


def cross_validated(estimate: GainEstimate, blocks: int = TIME_BLOCKS) -> tuple[JointPrediction, ...]:
    """Predict every stretch of every motion from the others, joint by joint.

    Args:
        estimate: Gains with the rows they were found from.
        blocks: Parts that each motion is cut into.

    Returns:
        One result for each joint that has rows.
    """
    solution, rows = estimate.solution, estimate.solution.rows
    parts = left_out(rows, blocks)
    # 1/g without a block is 1/g less the influence of its rows times what they would be off by; dg / g = -g d(1/g)
    moved = np.array([solution.influence[:, block] @ fresh for block, fresh in parts])  # (parts, k)
    changes = moved / solution.inverse
    given = {
        int(joint): k for k, joint in enumerate(solution.joints) if isinstance(estimate.joints[joint], IdentifiedGain)
    }
    return tuple(
        replace(each, gain_change=changes[:, given[each.joint]]) if each.joint in given else each
        for each in _predicted(rows, parts)
    )


def predicted(rows: Rows, blocks: int = TIME_BLOCKS) -> tuple[JointPrediction, ...]:
    """As `cross_validated`, of a fit that gives no gains."""
    return _predicted(rows, left_out(rows, blocks))


def _predicted(rows: Rows, parts: Sequence[tuple[Indices, Array]]) -> tuple[JointPrediction, ...]:
    error = np.zeros(len(rows.V))
    for block, fresh in parts:
        error[block] = fresh
    return tuple(
        JointPrediction(
            joint=joint,
            share=float(np.linalg.norm(error[rows.of(joint)]) / np.linalg.norm(rows.V[rows.of(joint)])),
            fitted=rows.residual_share(joint),
            gain_change=np.zeros(0),
        )
        for joint in rows.unknowns
    )
