"""The rows of one joint with their places in time, position and speed: what the plots of a joint are drawn from."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.arrays import Array, Indices
from ident.consistency.evidence import Evidence
from ident.estimate import IdentifiedGain
from ident.observation import Observation

GAP = 1.5
"""Rows further apart than this many periods are not joined."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FitRows:
    """Rows of one joint, motions one after the other.

    Attributes:
        joint: The joint, from 0.
        scale: Of a current to what is drawn: the gain, or 1 where it is refused.
        unit: Of that.
        turning: Whether the joint turns; else it slides.
        t: Time since the first motion began, pauses between motions left out [s], shape (r,).
        V: Currents [drive units], shape (r,).
        residual: What the model leaves of them, shape (r,).
        q, dq: Position and speed of the joint, empty if they are not known, shape (r,).
        motion: Number of each row's motion, shape (r,).
        sigma: Standard deviation of the residual [drive units].
        still: Stretches beside a reversal, whose samples are left out, from and to [s].
    """

    joint: int
    scale: float
    unit: str
    turning: bool
    t: Array
    V: Array
    residual: Array
    q: Array
    dq: Array
    motion: Indices
    sigma: float
    still: tuple[tuple[float, float], ...]

    def broken(self, values: Array) -> tuple[Array, Array]:
        """Times and values with NaN where rows are left out or a motion ends, for a line that is drawn."""
        step = np.diff(self.t)
        gaps = np.flatnonzero((step > GAP * np.median(step)) | (np.diff(self.motion) > 0)) + 1
        return np.insert(self.t, gaps, self.t[gaps] - 0.5 * step[gaps - 1]), np.insert(values, gaps, np.nan)


def fit_rows(evidence: Evidence, joint: int, begins: Sequence[float]) -> FitRows:
    """The rows of a joint.

    Args:
        evidence: The estimate and the motions.
        joint: The joint, from 0.
        begins: When each motion begins on the axis of time [s].
    """
    rows, gain = evidence.estimate.solution.rows, evidence.estimate.joints[joint]
    own = rows.of(joint)
    turning = bool(evidence.problem.structure.arm.revolute[joint])
    known = isinstance(gain, IdentifiedGain)
    motion, t, still = rows.motion[own], np.empty(own.stop - own.start), list[tuple[float, float]]()
    for k in np.unique(motion).tolist():
        seen = evidence.problem.motions[k].observation
        at = motion == k
        t[at] = begins[k] + _first_row(seen) + rows.position[own][at] * rows.row_period
        still += [(begins[k] + a, begins[k] + b) for a, b in _still(seen, joint)]
    states = evidence.states(joint)
    q, dq = (np.empty(0), np.empty(0)) if states is None else states
    return FitRows(
        joint=joint,
        scale=gain.value if known else 1.0,
        unit=("N m" if turning else "N") if known else "drive units",
        turning=turning,
        t=t,
        V=rows.V[own],
        residual=rows.residual[own],
        q=q,
        dq=dq,
        motion=motion,
        sigma=rows.sigma(joint),
        still=tuple(still),
    )


def begins(evidence: Evidence) -> tuple[float, ...]:
    """When each motion begins if each follows the one before [s]."""
    found = [0.0]
    for motion in evidence.problem.motions:
        seen = motion.observation
        if (behind := seen.full_rate) is not None:
            found.append(found[-1] + len(behind.q) * behind.period)
            continue
        first = seen.joints[0]
        found.append(found[-1] + float(first.position[-1] + 1) * first.row_period)
    return tuple(found)


def _first_row(seen: Observation) -> float:
    """Middle of the filter of a motion's first row, since its first filtered sample [s]."""
    behind = seen.full_rate
    return 0.0 if behind is None else 0.5 * (len(behind.decimator.kernel) - 1) * behind.period


def _still(seen: Observation, joint: int) -> list[tuple[float, float]]:
    """Stretches of a motion whose samples are left out for a joint, since its first filtered sample [s]."""
    behind = seen.full_rate
    if behind is None:
        return []
    edges = np.flatnonzero(np.diff(np.concatenate(([True], behind.moving[:, joint], [True])).astype(int)))
    return [(float(a) * behind.period, float(b) * behind.period) for a, b in edges.reshape(-1, 2)]
