"""Two models of the currents that logs are compared with: each joint alone, and all joints at once.

The free model checks logs. The unknowns of joint j are its base parameters, common to all logs; friction and offset of
each log; ten payload parameters of every mounting, without a bare log but one; and friction laws of real drives. It
uses no gain and no specified payload, so an error of these cannot be mistaken for a fault of the logs.

The reference gives the change of the currents by small faults, to first order. All joints are fitted at once with
viscous and Coulomb friction and rigid joints (`ident.estimation.all_joints`), free payloads and the gain of one joint
set to 1: no prior knowledge is needed, and currents do not depend on this scale.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from ident.diagnosis.evidence import Fits, free_fit
from ident.estimation.all_joints import Fit, fit
from ident.estimation.intervals import BLOCKS, BlockedFit
from ident.estimation.problem import OWN, Columns, Problem, Stacked
from ident.estimation.setting import setting
from ident.estimation.sweep import Sweep, Torques, assumed_compliance
from ident.estimation.terms import compliance_columns, torques_of
from ident.numerics.splines import slopes
from ident.observation.full_rate import FullRate
from ident.payload.payload import Payload
from ident.support.arrays import Array, Indices, once_per_object
from ident.support.errors import IdentificationError

COUPLED = ("Fvm", "Fcm")
"""Friction of motors that turn with two joints."""


def free_fits(problem: Problem, rows: Sequence[Columns], terms: Sequence[Array | None]) -> Fits:
    """Fit each joint's rows alone, with further terms if any, n arrays (r_j, m); None with fewer rows than unknowns."""
    blocks, parts = BLOCKS * len(problem.motions), list[BlockedFit | None]()
    for own, more in zip(rows, terms or (None,) * len(rows), strict=True):
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
    return Fits(tuple(parts))


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
    laws, speed = list[Array](), rows.own("Fv")
    if speed.any():  # friction that grows less than linearly with speed, or differs between directions
        share = np.where(rows.weight > 0.0, rows.weight, 1.0)
        laws = [np.cbrt(speed / share) * share, np.abs(speed)]
    payloads = rows.W_L[1:] if rows.loaded.all() else rows.W_L  # one acts like the last link
    return np.column_stack((rows.W, *later, *payloads, *laws))


LARGEST_ANGLE = np.deg2rad(15.0)
"""Largest error of a zero and tilt of the base for which the first order is valid [rad]."""
PRIOR_STD = 1.0
"""Prior standard deviation of the logarithm of a gain, as in `nls`."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Reference:
    """What a fit of all joints to logs with unknown payloads gives; the fit itself is as large as the logs."""

    problem: Problem  # the logs
    rows: Stacked  # their rows
    h: Array  # 1/g of each joint, relative to the one that was set, shape (n,)
    theta: Array  # shared parameters, shape (p,)
    friction: tuple[dict[tuple[str, int], float], ...]  # values of each joint's own columns by name and motion
    explained: tuple[Array, ...]  # fitted currents of each joint's rows, n arrays of shape (r_j, 1)
    torques: tuple[Torques, ...]  # torques of the fitted arm along each log

    def change(self, of: Callable[[Torques], Array]) -> tuple[Array, ...]:
        """Change of each joint's currents, n arrays of shape (r_j, m), by one of the torques of a log, (S, n, m)."""
        return self._currents(self.rows.of_logs([_filtered(each.sweep, of(each)) for each in self.torques]))

    def softened(self) -> tuple[Array, ...]:
        """Change of each joint's currents per plausible compliance of each joint, n arrays of shape (r_j, n)."""
        size = assumed_compliance(self.torques[0].sweep, self.theta)
        return self._currents(compliance_columns(self.rows, self.torques) * np.where(size > 0.0, size, 1.0))

    def _currents(self, torque: Array) -> tuple[Array, ...]:
        return tuple(h * torque[self.rows.joint == j] for j, h in enumerate(self.h))

    def within(
        self, columns: Sequence[Array], logs: Sequence[int], joints: Sequence[int] | None = None
    ) -> tuple[Array | None, ...]:
        """Return columns of each joint's rows, zero outside given logs, None outside given joints, if any."""
        rows, own = self.rows, range(len(self.h)) if joints is None else joints
        inside = np.isin(rows.motion, logs)[:, None]
        return tuple(each * inside[rows.joint == j] if j in own else None for j, each in enumerate(columns))

    def rate(self, along: Torques) -> Array:
        """Rate of change of the torques and of viscous friction along a log [N m / s], shape (S, n, 1)."""
        log = along.sweep.number
        viscous = np.array([own.get(("Fv", log), own.get(("Fv", -1), 0.0)) for own in self.friction])
        braking = viscous / self.h * along.sweep.behind.states.ddq
        return (slopes(along.sweep.knots, along.sampled) + braking)[..., None]


def _filtered(sweep: Sweep, torque: Array) -> Array:
    """Convert torques (S, n, m) to rows, joint by joint, by their own values alone; `Sweep.rows` interpolates."""
    behind = sweep.behind
    moving = behind.moving[behind.at][:, :, None] * torque
    rows = (_row_filter(behind) @ moving.reshape(len(moving), -1)).reshape(-1, *moving.shape[1:])
    return np.vstack([rows[each.position, j] for j, each in enumerate(sweep.motion.observation.joints)])


@once_per_object
def _row_filter(behind: FullRate) -> sparse.csr_array:
    """The decimation filter at the samples of the torques, shape (rows, S)."""
    D, samples = behind.decimator, behind.at
    begin = D.factor * np.arange(D.rows(len(behind.q)))  # first sample of a row's filter
    ends = np.searchsorted(samples, np.stack((begin, begin + len(D.kernel))))
    at = np.concatenate([np.arange(*each) for each in ends.T])
    row = np.repeat(np.arange(len(begin)), ends[1] - ends[0])
    weight = D.kernel[samples[at] - begin[row]]
    weight /= np.bincount(row, weight)[row]
    return sparse.csr_array((weight, (row, at)), shape=(len(begin), len(samples)))


def reference(problem: Problem) -> Reference | None:
    """Fit all joints, with unknown payloads; None if the fit fails, as for logs of another arm."""
    if any(motion.observation.full_rate is None for motion in problem.motions):
        return None
    try:
        fitted = reference_fit(problem)
    except IdentificationError:
        return None
    rows, joints, currents = fitted.ready.columns, range(len(fitted.h)), fitted.fitted_currents[:, None]
    return Reference(
        problem=problem, rows=rows, h=fitted.h, theta=fitted.theta,
        friction=tuple(fitted.friction(j) for j in joints),
        explained=tuple(currents[rows.joint == j] for j in joints),
        torques=torques_of(fitted.ready, fitted.theta),
    )  # fmt: skip


def reference_fit(problem: Problem) -> Fit:
    """Fit all joints of logs with unknown payloads and an unknown scale; raises `NotIdentifiable`."""
    first = problem.motions[0].payload  # the others, bare or not, differ from this mounting by an unknown payload
    others = {id(each.payload): Payload(1.0, known="none") for each in problem.motions if each.payload is not first}
    unknown = tuple(replace(each, payload=others.get(id(each.payload))) for each in problem.motions)
    return fit(setting(replace(problem, motions=unknown), per_motion=True, prior_std=PRIOR_STD, given=None), {}, None)
