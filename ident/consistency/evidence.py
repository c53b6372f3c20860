"""What consistency tests read: the estimate, and what several of them need of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ident.arrays import Array
from ident.consistency.part import LinearFit, linear_fit
from ident.estimate import GainEstimate, IdentifiedGain
from ident.problem import Problem
from ident.uncertainty.cautious import cautious
from ident.uncertainty.classical import classical


@dataclass(frozen=True, kw_only=True, eq=False)
class Evidence:
    """What tests read; what several of them need is found once.

    Attributes:
        problem: Motions and payloads.
        estimate: What was found from them.
        drift: Whether the method lets friction differ between motions.
    """

    problem: Problem
    estimate: GainEstimate
    drift: bool

    @cached_property
    def identified(self) -> dict[int, int]:
        """Joints with a gain, from 0, and their places in the solution."""
        return {
            joint: k
            for k, joint in enumerate(self.estimate.solution.joints.tolist())
            if isinstance(self.estimate.joints[joint], IdentifiedGain)
        }

    def std(self, k: int) -> float:
        """Standard deviation of the 1/g at a place in the solution, from the residuals."""
        return float(np.sqrt(self.estimate.covariance[k, k]))

    def rel_std(self, joint: int) -> float:
        """Relative standard deviation that is claimed of a joint's gain, all shares together."""
        gain = self.estimate.joints[joint]
        assert isinstance(gain, IdentifiedGain), "asked of joints with a gain"
        return gain.total_std / abs(gain.value)

    @cached_property
    def fit(self) -> LinearFit | None:
        """The linear fit behind the estimate; None if it is not one of least squares."""
        return linear_fit(self.estimate.solution)

    @cached_property
    def sigma(self) -> Array:
        """Standard deviation of the residual of each row's joint [drive units], shape (r,)."""
        rows = self.estimate.solution.rows
        sigma = np.empty(len(rows.V))
        for joint in rows.unknowns:
            sigma[rows.of(joint)] = rows.sigma(joint)
        return sigma

    @cached_property
    def growth(self) -> Array:
        """Deviation of each 1/g that allows for errors that last, over that of unrelated ones (eq. 20), shape (k,)."""
        solution, options = self.estimate.solution, self.estimate.options
        plain = np.diag(classical(solution.rows, solution.influence, options.serial_s))
        claimed = np.diag(self.estimate.covariance)
        if options.uncertainty == "classical":
            claimed = np.diag(cautious(solution.rows, solution.influence, options.serial_s))
        return np.sqrt(np.divide(claimed, plain, out=np.ones(len(plain)), where=plain > 0.0))

    @cached_property
    def pull(self) -> Array:
        """What beliefs pull the unknowns by, `Q' e` of the weighted residuals, shape (u,); zero without beliefs."""
        rows = self.estimate.solution.rows
        return rows.explained.T @ (rows.weight * rows.residual)

    def states(self, joint: int) -> tuple[Array, Array] | None:
        """Positions and speeds of a joint, from 0, in the middle of its rows' filters, each of shape (r,).

        None if some motion is not from a recording.
        """
        rows, q, dq = self.estimate.solution.rows, list[Array](), list[Array]()
        own = rows.of(joint)
        for motion in np.unique(rows.motion[own]):
            behind = self.problem.motions[int(motion)].observation.full_rate
            if behind is None:
                return None
            at = rows.position[own][rows.motion[own] == motion] * behind.decimator.factor
            at = at + len(behind.decimator.kernel) // 2
            q.append(behind.q[at, joint])
            dq.append(behind.dq[at, joint])
        return np.concatenate(q), np.concatenate(dq)

    @cached_property
    def stated(self) -> Array:
        """Change of each row's current per deviation of what is stated of the payloads [drive units], shape (r, p)."""
        spread = [payload.known_part().spread for payload in self.problem.payloads]
        if not any(each.any() for each in spread):
            return np.zeros((len(self.estimate.solution.rows.V), 0))
        return self.payload_currents(spread)

    def payload_currents(self, parameters: Sequence[Array]) -> Array:
        """Change of each row's current by changes of the payloads' parameters [drive units], shape (r, p).

        Args:
            parameters: Columns of changes of each payload's standard parameters, each of shape (10, .), p in all.
        """
        solution, payloads = self.estimate.solution, self.problem.payloads
        rows = solution.rows
        first = np.cumsum([0, *(each.shape[1] for each in parameters)])
        found = np.zeros((len(rows.V), first[-1]))
        inverse = dict(zip(solution.joints.tolist(), solution.inverse.tolist(), strict=True))
        mounted = [id(payload) for payload in payloads]
        for run in rows.runs():
            joint, motion = int(rows.joint[run.start]), self.problem.motions[int(rows.motion[run.start])]
            if motion.payload is not None and joint in inverse:
                observed, which = motion.observation.joints[joint], mounted.index(id(motion.payload))
                at = np.searchsorted(observed.position, rows.position[run])
                found[run, first[which] : first[which + 1]] = inverse[joint] * (observed.W_L[at] @ parameters[which])
        return found
