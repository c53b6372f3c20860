"""Two models of the currents that logs are compared with: each joint alone, and all joints at once.

The free model checks logs. The unknowns of joint j are its base parameters, common to all logs; friction and offset of
each log; ten payload parameters of every mounting but the first; and friction laws of real drives. It uses no gain and
no specified payload, so an error of these cannot be mistaken for a fault of the logs.

The reference gives the change of the currents by small faults, to first order. All joints are fitted at once with
viscous and Coulomb friction and rigid joints (`ident.estimation.all_joints`), free payloads and the gain of one joint
set to 1: no prior knowledge is needed, and currents do not depend on this scale.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ident.diagnosis.evidence import BLOCKS, Fits, FreeFit, fits_of, free_fit
from ident.estimation.all_joints import Fit, fit
from ident.estimation.problem import Problem
from ident.estimation.rows import OWN, Columns, joint_rows
from ident.estimation.setting import Setting, setting
from ident.estimation.sweep import Sweep, Torques, assumed_compliance
from ident.estimation.terms import compliance_columns, torques_of
from ident.model.arm import Arm
from ident.model.displacement import States
from ident.model.regressor import inverse_dynamics
from ident.numerics.splines import CubicSpline
from ident.observation.full_rate import FullRate
from ident.payload.payload import Payload
from ident.support.arrays import Array, Indices, once_per_object
from ident.support.errors import IdentificationError

COUPLED = ("Fvm", "Fcm")
"""Friction of motors that turn with two joints."""


@dataclass(frozen=True, slots=True, eq=False)
class FreeModel:
    """Free fits of all joints, prepared for held-out predictions."""

    problem: Problem  # the observed logs; two mountings are two payload objects, even if equal
    rows: tuple[Columns, ...]  # rows of each joint
    fits: Fits  # each joint's fit; None where it has fewer rows than unknowns


def free_model(problem: Problem, further: Sequence[Array | None] = ()) -> FreeModel:
    """Fit every joint of a problem freely, with further columns of each joint, n arrays of shape (r_j, m), if any."""
    n, blocks = problem.structure.arm.n, BLOCKS * len(problem.motions)
    rows, parts = tuple(joint_rows(problem, joint) for joint in range(n)), list[FreeFit | None]()
    for own, more in zip(rows, further or (None,) * n, strict=True):
        W = free_columns(problem, own)
        W = W if more is None else np.column_stack((W, more))
        if len(own.V) <= W.shape[1]:
            parts.append(None)
            continue
        fitted = free_fit(W, own.V, numbered_blocks(problem, own.motion, own.position), blocks)
        if (dry := own.own("Fc")).any():  # friction proportional to the motor torque of the fitted model
            W = np.column_stack((W, np.abs(own.V - fitted.residual) * dry))
            fitted = free_fit(W, own.V, fitted.block, blocks)
        parts.append(fitted)
    return FreeModel(problem, rows, fits_of(parts))


def numbered_blocks(problem: Problem, motion: Indices, position: Indices) -> Indices:
    """Time block of each row, numbered through all logs, from its log and its number in this log, both of shape (r,).

    Numbers include the rows that joints omit.
    """
    joints = (each.observation.joints for each in problem.motions)
    rows = [1 + max((int(own.position[-1]) for own in each if len(own.position)), default=0) for each in joints]
    return motion * BLOCKS + np.minimum(position * BLOCKS // np.array(rows)[motion], BLOCKS - 1)


def free_columns(problem: Problem, rows: Columns) -> Array:
    """Columns of the model of a joint's currents, shape (r, p)."""
    drifting = rows.of_parameter(*OWN, *COUPLED)
    later = [rows.W[:, drifting] * (rows.motion == log)[:, None] for log in range(1, len(problem.motions))]
    first = problem.motions[0].payload
    payloads = [W_L for W_L, payload in zip(rows.W_L, problem.payloads, strict=True) if payload is not first]
    laws, speed = list[Array](), rows.own("Fv")
    if speed.any():  # friction that grows less than linearly with speed, or differs between directions
        share = np.where(rows.weight > 0.0, rows.weight, 1.0)
        laws = [np.cbrt(speed / share) * share, np.abs(speed)]
    return np.column_stack((rows.W, *later, *payloads, *laws))


STEP = 1e-3
"""Relative step of numerical derivatives."""
LARGEST_ANGLE = np.deg2rad(15.0)
"""Largest error of a zero and tilt of the base for which the first order is valid [rad]."""
PRIOR_STD = 1.0
"""Prior standard deviation of the logarithm of a gain, as in `nls`."""


@dataclass(frozen=True, eq=False)
class Reference:
    """A fit of all joints to logs with unknown payloads."""

    problem: Problem  # the logs, with unknown payloads
    ready: Setting  # inputs of the fit
    fitted: Fit  # the fit

    @property
    def h(self) -> Array:
        """1/g of each joint, relative to the one that was set, shape (n,)."""
        return self.fitted.h

    @cached_property
    def torques(self) -> tuple[Torques, ...]:
        """Torques of the fitted arm along each log."""
        return torques_of(self.ready, self.fitted.theta)

    def change(self, of: Callable[[Torques], Array]) -> tuple[Array, ...]:
        """Change of each joint's currents, n arrays of shape (r_j, m), by one of the torques of a log, (S, n, m)."""
        return self._currents(self.ready.of_logs([_filtered(each.sweep, of(each)) for each in self.torques]))

    @cached_property
    def softened(self) -> tuple[Array, ...]:
        """Change of each joint's currents per unit of each joint's compliance, n arrays of shape (r_j, n)."""
        return self._currents(compliance_columns(self.ready, self.torques))

    def _currents(self, torque: Array) -> tuple[Array, ...]:
        joint = self.ready.columns.joint
        return tuple(h * torque[joint == j] for j, h in enumerate(self.h))

    @cached_property
    def compliance(self) -> Array:
        """Plausible compliance of each joint [rad / (N m)] or [m / N], shape (n,), in the units of `softened`."""
        return assumed_compliance(self.ready.sweeps[0], self.fitted.theta)

    def explained(self, log: int) -> tuple[Array, ...]:
        """Fitted currents of each joint's rows, zero outside a log, n arrays of shape (r_j,)."""
        columns = self.ready.columns
        found = np.where(columns.motion == log, self.fitted.fitted_currents, 0.0)
        return tuple(found[columns.joint == j] for j in range(self.ready.n))

    def within(
        self, columns: Sequence[Array], logs: Sequence[int], joints: Sequence[int] | None = None
    ) -> tuple[Array | None, ...]:
        """Return columns of each joint's rows, zero outside given logs, None outside given joints, if any."""
        rows = self.ready.columns
        inside = (np.isin(rows.motion[rows.joint == j], logs)[:, None] for j in range(self.ready.n))
        chosen = enumerate(zip(columns, inside, strict=True))
        return tuple(each * own if joints is None or j in joints else None for j, (each, own) in chosen)

    def rate(self, along: Torques) -> Array:
        """Rate of change of the torques and of viscous friction along a log [N m / s], shape (S, n, 1)."""
        knots, log = along.sweep.knots, along.sweep.number
        friction = [self.fitted.friction(j) for j in range(self.ready.n)]
        viscous = np.array([own.get(("Fv", log), own.get(("Fv", -1), 0.0)) for own in friction])
        rate = CubicSpline.through(knots, along.sampled)(knots, 1)
        return (rate + viscous / self.h * along.sweep.behind.states.ddq)[..., None]


def _filtered(sweep: Sweep, torque: Array) -> Array:
    """Convert torques (S, n, m) to rows, joint by joint, by their own values alone; `Sweep.rows` interpolates."""
    behind = sweep.behind
    moving, (at, weight) = behind.moving[behind.at], _row_filter(behind)
    parts = list[Array]()
    for j, each in enumerate(sweep.motion.observation.joints):
        own = np.where(moving[:, j, None], torque[:, j], 0.0)[at[each.position]]
        parts.append(np.einsum("rl,rlm->rm", weight[each.position], own))
    return np.concatenate(parts)


@once_per_object
def _row_filter(behind: FullRate) -> tuple[Indices, Array]:
    """The decimation filter at the samples of the torques: indices and weights of each row, both of shape (rows, l)."""
    D, samples = behind.decimator, behind.at
    begin = D.factor * np.arange(D.rows(len(behind.q)))  # first sample of a row's filter
    first = np.searchsorted(samples, begin)
    count = int(np.max(np.searchsorted(samples, begin + len(D.kernel)) - first, initial=1))
    at = np.minimum(first[:, None] + np.arange(count), len(samples) - 1)
    lag = samples[at] - begin[:, None]
    weight = np.where(lag < len(D.kernel), D.kernel[np.minimum(lag, len(D.kernel) - 1)], 0.0)
    return at, weight / weight.sum(axis=1, keepdims=True)


def with_arm(along: Torques, arm: Arm) -> Array:
    """Derivative of the torques by a parameter of the arm that was changed by `STEP`, shape (S, n, 1)."""
    return _difference(along, arm, along.sweep.behind.states)


def with_time(along: Torques) -> Array:
    """Derivative of the torques by a factor of time, shape (S, n, 1)."""
    states = along.sweep.behind.states
    return _difference(along, along.arm, States(states.q, states.dq * (1.0 - STEP), states.ddq * (1.0 - 2.0 * STEP)))


def _difference(along: Torques, arm: Arm, states: States) -> Array:
    return (inverse_dynamics(arm, along.chi, states.q, states.dq, states.ddq) - along.sampled)[..., None] / STEP


def reference(problem: Problem) -> Reference | None:
    """Fit all joints; None if the fit fails, as for logs of a different arm."""
    if any(motion.observation.full_rate is None for motion in problem.motions):
        return None
    unknown = _unknown(problem)
    try:
        ready = setting(unknown, per_motion=True, prior_std=PRIOR_STD, given=None)
        fitted = fit(ready, {}, None)
    except IdentificationError:
        return None
    return Reference(unknown, ready, fitted)


def _unknown(problem: Problem) -> Problem:
    """Return the same logs with unknown payloads; the first mounting counts as bare."""
    first = problem.motions[0].payload
    others = {id(each): Payload(mass=1.0, known="none") for each in problem.payloads if each is not first}
    return replace(
        problem, motions=tuple(replace(each, payload=others.get(id(each.payload))) for each in problem.motions)
    )
