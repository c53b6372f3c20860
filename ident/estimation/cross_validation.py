"""Cross-validation: gains from part of each motion, currents predicted on the rest.

Each motion is divided into time blocks. To first order, leaving out a block changes the estimate by the influence of
its rows times their residuals in a fit without the block (`ident.estimation.intervals`), so that no fit is
repeated. A model error common to all blocks is not detected; only a motion with another payload can reveal it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from ident.estimation.estimate import GainEstimate
from ident.estimation.intervals import Rows, left_out
from ident.support.arrays import Array

TIME_BLOCKS = 5
"""Number of time blocks of each motion."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointPrediction:
    """How well a joint's currents are predicted on rows that were not fitted.

    Attributes:
        joint: The joint, from 0.
        share: Ratio of the norm of the prediction error to that of the currents.
        fitted: Ratio of the norm of the residual of the fit to all rows to that of the currents.
        gain_change: Relative change of the gain if a block is left out, one per block, shape (parts,); empty for a
            refused joint, and without gains.
    """

    joint: int
    share: float
    fitted: float
    gain_change: Array


def cross_validated(estimate: GainEstimate, blocks: int = TIME_BLOCKS) -> tuple[JointPrediction, ...]:
    """Predict every time block of every motion from the others, joint by joint, with the changes of the gains."""
    solution = estimate.solution
    # without a block, 1/g changes by minus the influence of its rows times their residuals; dg / g = -g d(1/g)
    relative = dict(zip(solution.joints.tolist(), solution.influence / solution.inverse[:, None], strict=True))
    return predicted(solution.rows, blocks, {j: relative[j] for j in estimate.identified})


def predicted(
    rows: Rows, blocks: int = TIME_BLOCKS, gains: Mapping[int, Array] = MappingProxyType({})
) -> tuple[JointPrediction, ...]:
    """Predict every time block of every motion from the others, joint by joint.

    Args:
        rows: Rows of a fit.
        blocks: Number of time blocks of each motion.
        gains: Minus the relative change of a gain by the current of each row, shape (r,), by joint.

    Returns:
        One result for each joint that has rows.
    """
    parts, error = left_out(rows, blocks), np.zeros(len(rows.V))
    for block, fresh in parts:
        error[block] = fresh
    return tuple(
        JointPrediction(
            joint=joint,
            share=float(np.linalg.norm(error[rows.of(joint)]) / np.linalg.norm(rows.V[rows.of(joint)])),
            fitted=rows.residual_share(joint),
            gain_change=np.array([gains[joint][block] @ fresh for block, fresh in parts if joint in gains]),
        )
        for joint in rows.unknowns
    )
