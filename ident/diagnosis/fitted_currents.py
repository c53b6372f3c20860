"""Currents of the fitted arm along each log, and their change by small faults, to first order.

All joints are fitted at once with viscous and Coulomb friction and rigid joints (`ident.estimation.all_joints`), free
payloads and the gain of one joint set to 1: no prior knowledge is needed, and currents do not depend on this scale.
Each fault is then a column of currents per joint, with the same filter as the rows.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ident.estimation.all_joints import Fit, fit
from ident.estimation.problem import Problem
from ident.estimation.setting import GivenGain, Setting, setting
from ident.estimation.sweep import Torques, assumed_compliance
from ident.estimation.terms import compliance_columns, torques_of
from ident.model.arm import Arm
from ident.model.displacement import States
from ident.model.regressor import inverse_dynamics
from ident.numerics.splines import CubicSpline
from ident.observation.full_rate import FullRate
from ident.payload.payload import Payload
from ident.support.arrays import Array, Indices
from ident.support.errors import IdentificationError

STEP = 1e-3
"""Relative step of numerical derivatives."""
PRIOR_STD = 1.0
"""Prior standard deviation of the logarithm of a gain, as in `nls`."""


@dataclass(frozen=True, eq=False)
class Reference:
    """A fit of all joints to logs with unknown payloads.

    Attributes:
        problem: The logs, with unknown payloads.
        ready: Inputs of the fit.
        fitted: The fit.
    """

    problem: Problem
    ready: Setting
    fitted: Fit

    @property
    def arm(self) -> Arm:
        """The arm."""
        return self.problem.structure.arm

    @property
    def h(self) -> Array:
        """1/g of each joint, relative to the one that was set, shape (n,)."""
        return self.fitted.h

    @cached_property
    def motions(self) -> tuple["ReferenceMotion", ...]:
        """Each log."""
        return tuple(ReferenceMotion(self, k) for k in range(len(self.problem.motions)))

    @cached_property
    def torques(self) -> tuple[Torques, ...]:
        """Torques of the fitted arm along each log."""
        return torques_of(self.ready, self.fitted.theta)

    @cached_property
    def softened(self) -> tuple[Array, ...]:
        """Change of each joint's currents per unit of each joint's compliance, n arrays of shape (r_j, n)."""
        columns, joint = compliance_columns(self.ready, self.torques), self.ready.columns.joint
        return tuple(h * columns[joint == j] for j, h in enumerate(self.h))

    @cached_property
    def compliance(self) -> Array:
        """Plausible compliance of each joint [rad / (N m)] or [m / N], shape (n,), in the units of `softened`."""
        return assumed_compliance(self.ready.sweeps[0], self.fitted.theta)

    def explained(self, log: int) -> tuple[Array, ...]:
        """Fitted currents of each joint's rows, zero outside a log, n arrays of shape (r_j,)."""
        rows = self.fitted.rows
        found = np.where(rows.motion == log, rows.V - rows.residual, 0.0)
        return tuple(found[rows.of(j)] for j in range(self.arm.n))


@dataclass(frozen=True, eq=False)
class ReferenceMotion:
    """One log of a reference: states at a sufficient rate for torques, and the filter that converts columns to rows."""

    reference: Reference
    log: int

    @property
    def behind(self) -> FullRate:
        """The motion at full rate."""
        return self.reference.problem.motions[self.log].observation.recorded

    @property
    def states(self) -> States:
        """States at which torques are evaluated."""
        return self.behind.states

    @property
    def along(self) -> Torques:
        """Torques of links, rotors and payload along the log."""
        return self.reference.torques[self.log]

    @staticmethod
    def of(arm: Arm, chi: Array, states: States) -> Array:
        """Torques of an arm with given parameters, shape (S, n)."""
        return inverse_dynamics(arm, chi, states.q, states.dq, states.ddq)

    def rows(self, torque: Array) -> tuple[Array, ...]:
        """Convert torques at `TORQUE_RATE` to currents of each joint's rows.

        Args:
            torque: m torques of each joint, shape (S, n, m).

        Returns:
            n arrays of shape (r_j, m).
        """
        own = self.reference.problem.motions[self.log].observation.joints
        moving, (at, weight) = self.behind.moving[self.behind.at], self._filter
        return tuple(
            self.reference.h[j]
            * np.einsum(
                "rl,rlm->rm", weight[each.position], np.where(moving[:, j, None], torque[:, j], 0.0)[at[each.position]]
            )
            for j, each in enumerate(own)
        )

    @cached_property
    def _filter(self) -> tuple[Indices, Array]:
        """The decimation filter at these times: indices and weights of each row, both of shape (rows, l)."""
        D, samples = self.behind.decimator, self.behind.at
        begin = D.factor * np.arange(D.rows(len(self.behind.q)))  # first sample of a row's filter
        first = np.searchsorted(samples, begin)
        count = int(np.max(np.searchsorted(samples, begin + len(D.kernel)) - first, initial=1))
        at = np.minimum(first[:, None] + np.arange(count), len(samples) - 1)
        lag = samples[at] - begin[:, None]
        weight = np.where(lag < len(D.kernel), D.kernel[np.minimum(lag, len(D.kernel) - 1)], 0.0)
        return at, weight / weight.sum(axis=1, keepdims=True)

    def displaced(self) -> Array:
        """Derivative of the torques by each joint's zero [N m / rad], shape (S, n, n)."""
        still = np.zeros_like(self.states.q)
        return self.along.links.displaced(States(np.ones_like(still), still, still))

    def changed(self, arm: Arm) -> Array:
        """Derivative of the torques by a parameter of the arm that was changed by `STEP`, shape (S, n)."""
        return (self.of(arm, self.along.chi, self.states) - self.along.sampled) / STEP

    def tilted(self) -> Array:
        """Derivative by a rotation of the base about two horizontal axes [N m / rad], shape (S, n, 2)."""
        return -self.along.tilted()

    def hurried(self) -> Array:
        """Derivative by a factor of time, shape (S, n)."""
        states = self.states
        slower = States(states.q, states.dq * (1.0 - STEP), states.ddq * (1.0 - 2.0 * STEP))
        return (self.of(self.reference.arm, self.along.chi, slower) - self.along.sampled) / STEP

    def rate(self) -> Array:
        """Rate of change of the torques and of viscous friction [N m / s], shape (S, n)."""
        t = self.behind.t[self.behind.at]
        rate = CubicSpline.through(t, self.along.sampled)(t, 1)
        return rate + self._viscous() / self.reference.h * self.states.ddq

    def _viscous(self) -> Array:
        """Coefficient of viscous friction of each joint in this log [drive units s/rad], shape (n,)."""
        fitted = self.reference.fitted
        friction = [fitted.friction(j) for j in range(self.reference.arm.n)]
        return np.array([own.get(("Fv", self.log), own.get(("Fv", -1), 0.0)) for own in friction])


def reference(problem: Problem) -> Reference | None:
    """Fit all joints; None if the fit fails, as for logs of a different arm."""
    if any(motion.observation.full_rate is None for motion in problem.motions):
        return None
    unknown = _unknown(problem)
    try:
        ready = setting(unknown, per_motion=True, prior_std=PRIOR_STD, given=[GivenGain(0, 1.0)])
        ready = ready.with_gains([ready.braked()])
        fitted = fit(ready, {}, None)
    except IdentificationError:
        return None
    return Reference(unknown, ready, fitted)


def _unknown(problem: Problem) -> Problem:
    """Return the same logs with unknown payloads; the first mounting counts as bare."""
    first = problem.motions[0].payload
    others = {id(each): Payload(mass=1.0, known="none") for each in problem.payloads if each is not first}
    motions = tuple(
        replace(each, payload=None if each.payload is None else others.get(id(each.payload)))
        for each in problem.motions
    )
    return replace(problem, motions=motions)
