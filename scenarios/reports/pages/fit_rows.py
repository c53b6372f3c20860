"""The rows of one joint with their places in time, position and speed: what the plots of a joint are drawn from."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.estimation.estimate import GainEstimate, IdentifiedGain
from ident.estimation.problem import Problem
from ident.observation.observation import Observation
from ident.recordings.recording import Recording
from ident.support.arrays import Array, Indices

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
        t: Time since the first log began, pauses between logs left out [s], shape (r,).
        stamp: Time that the log of each row has in the middle of its filter [s], shape (r,).
        V: Currents [drive units], shape (r,).
        residual: What the model leaves of them, shape (r,).
        q, dq: Position and speed of the joint, shape (r,); empty where nothing is drawn against them.
        motion: Number of each row's motion, shape (r,).
        sigma: Standard deviation of the residual [drive units].
        still: Stretches beside a reversal, whose samples are left out, from and to [s].
    """

    joint: int
    scale: float
    unit: str
    turning: bool
    t: Array
    stamp: Array
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


def fit_rows(problem: Problem, estimate: GainEstimate, joint: int, logs: Sequence[Recording]) -> FitRows:
    """The rows of a joint.

    Args:
        problem: The motions.
        estimate: What was found from them.
        joint: The joint, from 0.
        logs: What each motion was observed in.
    """
    rows, gain = estimate.solution.rows, estimate.joints[joint]
    own = rows.of(joint)
    turning = bool(problem.structure.arm.revolute[joint])
    known = isinstance(gain, IdentifiedGain)
    motion, stamp, still = rows.motion[own], np.empty(own.stop - own.start), list[tuple[float, float]]()
    first = np.array([log.t[0] for log in logs])
    later = np.array(begins(logs)[:-1]) - first  # place on the axis less time in the log, (motions,)
    for k in np.unique(motion).tolist():
        seen, at = problem.motions[k].observation, motion == k
        observed = seen.joints[joint]
        stamp[at] = observed.t[np.searchsorted(observed.position, rows.position[own][at])]
        still += [(a + float(later[k]), b + float(later[k])) for a, b in _still(seen, joint)]
    q, dq = _states(problem, joint, motion, rows.position[own])
    return FitRows(
        joint=joint,
        scale=gain.value if known else 1.0,
        unit=("N m" if turning else "N") if known else "drive units",
        turning=turning,
        t=stamp + later[motion],
        stamp=stamp,
        V=rows.V[own],
        residual=rows.residual[own],
        q=q,
        dq=dq,
        motion=motion,
        sigma=rows.sigma(joint),
        still=tuple(still),
    )


def _states(problem: Problem, joint: int, motion: Indices, position: Indices) -> tuple[Array, Array]:
    """Position and speed of a joint in the middle of its rows' filters, each of shape (r,)."""
    q, dq = np.empty(len(motion)), np.empty(len(motion))
    for k in np.unique(motion).tolist():
        behind, own = problem.motions[k].observation.full_rate, motion == k
        assert behind is not None, "asked of motions that were recorded"
        at = position[own] * behind.decimator.factor + len(behind.decimator.kernel) // 2
        q[own], dq[own] = behind.q[at, joint], behind.dq[at, joint]
    return q, dq


def begins(logs: Sequence[Recording]) -> tuple[float, ...]:
    """When each log begins if each follows the one before, and when the last one ends [s]."""
    return tuple(np.cumsum([0.0, *(len(log.t) * log.period for log in logs)]).tolist())


def _still(seen: Observation, joint: int) -> list[tuple[float, float]]:
    """Stretches of a log whose samples are left out for a joint, from and to, in the log's own time [s]."""
    behind, observed = seen.full_rate, seen.joints[joint]
    assert behind is not None, "asked of motions that were recorded"
    middle = 0.5 * (len(behind.decimator.kernel) - 1) * behind.period
    first = observed.t[0] - middle - observed.position[0] * observed.row_period  # of the filtered samples
    edges = np.flatnonzero(np.diff(np.concatenate(([True], behind.moving[:, joint], [True])).astype(int)))
    return [(first + a * behind.period, first + b * behind.period) for a, b in edges.reshape(-1, 2).tolist()]
