"""Cross-validation: gains from part of each motion, currents predicted on the rest.

Each motion is divided into time blocks. To first order, leaving out a block changes the estimate by the influence of
its rows times their residuals in a fit without the block (`ident.estimation.intervals`), so that no fit is
repeated. A model error common to all blocks is not detected; only a motion with another payload can reveal it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.estimation.estimate import GainEstimate, IdentifiedGain
from ident.estimation.intervals import Rows, left_out
from ident.support.arrays import Array, Indices

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
            refused joint.
    """

    joint: int
    share: float
    fitted: float
    gain_change: Array


def cross_validated(estimate: GainEstimate, blocks: int = TIME_BLOCKS) -> tuple[JointPrediction, ...]:
    """Predict every time block of every motion from the others, joint by joint.

    Args:
        estimate: Gains with the rows that they were estimated from.
        blocks: Number of time blocks of each motion.

    Returns:
        One result for each joint that has rows.
    """
    solution, rows = estimate.solution, estimate.solution.rows
    parts = left_out(rows, blocks)
    # without a block, 1/g changes by minus the influence of its rows times their residuals; dg / g = -g d(1/g)
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
    """As `cross_validated`, for a fit without gains."""
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
