"""Drive gains for further use: values with their covariance, their curves, and the joints that have none."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ident.estimation.all_joints import GIVEN_STD, Sensitivity
from ident.estimation.estimate import GainCurve, GainEstimate
from ident.estimation.intervals import UNCERTAINTIES
from ident.estimation.problem import GainOptions
from ident.estimation.setting import GivenGain
from ident.model.arm import Arm
from ident.recordings.recording import Recording
from ident.support.arrays import Array, Indices, readonly
from ident.support.errors import GainsError

ROUNDING = 1e-6
"""Largest asymmetry and negative eigenvalue of a covariance, scaled to unit diagonal, that are rounding errors."""
OTHER_UNIT = 15.0
"""Ratio of two gains of one drive beyond which their units differ: geometric mean of 4, the difference of published
gains of one drive, and 57.3, the smallest factor between units (degrees)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KnownGains:
    """Drive gains of all or some joints of an arm, checked when created.

    Attributes:
        names: Names of all n joints.
        joints: The k joints that have a gain, from 0, in ascending order, shape (k,).
        value: Their gains [N m / drive unit, N / drive unit where a joint slides], shape (k,).
        covariance: Their total covariance, shape (k, k).
        curves: Gain over current, by joint from 0, of joints whose gain is not constant.

    Raises:
        GainsError: If shapes disagree, a gain is zero or not finite or changes its sign, or the covariance is invalid.
    """

    names: tuple[str, ...]
    joints: Indices
    value: Array
    covariance: Array
    curves: Mapping[int, GainCurve] = field(default_factory=dict[int, GainCurve])

    def __post_init__(self) -> None:
        """Check and freeze the arrays."""
        object.__setattr__(self, "value", readonly(self.value))
        object.__setattr__(self, "covariance", readonly(self.covariance))
        k, n = len(self.joints), len(self.names)
        if self.value.shape != (k,) or self.covariance.shape != (k, k):
            raise GainsError(
                f"gains: {k} joints, values {self.value.shape}, covariance {self.covariance.shape} do not fit; "
                "expected (k,) and (k, k)"
            )
        if k and (int(self.joints[0]) < 0 or int(self.joints[-1]) >= n or (np.diff(self.joints) <= 0).any()):
            raise GainsError(f"gains: joints {(self.joints + 1).tolist()}; expected increasing numbers from 1 to {n}")
        for joint, value in self.by_joint.items():
            if not np.isfinite(value) or value == 0.0:
                raise GainsError(f"gains: joint {joint + 1}: a gain of {value:g} is invalid; refuse the joint instead")
        for joint, curve in self.curves.items():
            if curve.relative(np.outer((1e-300, curve.largest), (1.0, -1.0))).min() <= 0.0:
                raise GainsError(
                    f"gains: joint {joint + 1}: its gain changes its sign with the current; check the curve"
                )
        variance = np.diag(self.covariance)
        if not np.isfinite(self.covariance).all() or (variance < 0.0).any():
            raise GainsError("gains: the covariance has a negative variance or is not finite")
        std = np.where(variance > 0.0, np.sqrt(variance), 1.0)
        unit = self.covariance / np.outer(std, std)
        if np.abs(unit - unit.T).max(initial=0.0) > ROUNDING:
            raise GainsError("gains: the covariance is not symmetric")
        if k and float(np.linalg.eigvalsh(unit)[0]) < -k * ROUNDING:
            raise GainsError("gains: the covariance has a negative eigenvalue; expected a positive semidefinite matrix")

    @property
    def std(self) -> Array:
        """Standard deviations [N m / drive unit], shape (k,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def by_joint(self) -> dict[int, float]:
        """The gains, by joint from 0."""
        return dict(zip(self.joints.tolist(), self.value.tolist(), strict=True))

    @property
    def log_covariance(self) -> Array:
        """Covariance of the logarithms, to first order, shape (k, k)."""
        return self.covariance / np.outer(self.value, self.value)

    def relative(self, v: Array, joint: Indices) -> Array:
        """Return the ratio of gains to `value` at currents v [drive units] of joints, from 0, arrays of one shape."""
        found = np.ones(v.shape)
        for j, curve in self.curves.items():
            found[joint == j] = curve.relative(v[joint == j])
        return found

    def at_currents_of(self, curves: Mapping[int, GainCurve]) -> "KnownGains":
        """Return constant gains: these at the currents at which gains with other curves hold, else as they are."""
        share, variance = np.ones(len(self.joints)), np.zeros(len(self.joints))
        for k, j in enumerate(self.joints.tolist()):
            if j in self.curves and j in curves:
                own, size = self.curves[j].even, np.array(curves[j].current)
                share[k], variance[k] = own.relative(size), np.maximum(own.rel_variance(size), 0.0)
        value = self.value * share
        covariance = np.outer(value, value) * (self.log_covariance + np.diag(variance))
        return replace(self, value=value, covariance=covariance, curves={})

    def check_arm(self, arm: Arm) -> None:
        """Raise `GainsError` if the arm has another number or other names of joints, or no joint has a gain."""
        if len(self.names) != arm.n:
            raise GainsError(f"gains of {len(self.names)} joints, but robot {arm.name} has {arm.n}")
        for number, (mine, its) in enumerate(zip(self.names, arm.joint_names, strict=True), 1):
            if not same_joint(number, mine, its):
                raise GainsError(f"gains: joint {number} is {mine}, but that of robot {arm.name} is {its}")
        if not len(self.joints):
            raise GainsError("gains: no joint has a gain; every one is refused")


def check_comparable(gains: KnownGains, other: KnownGains) -> None:
    """Refuse, by `GainsError`, gains that are not those of the same drives: of another sign or in another unit."""
    for joint, value, stated in _in_both(gains, other):
        if stated * value < 0.0:
            raise GainsError(
                f"assumed gains: joint {joint + 1}: {stated:g}, but its gain is {value:.4g}; give both the "
                "same sign, that of torque over current"
            )
    check_unit(gains, other, "assumed gains")


def check_unit(gains: KnownGains, other: KnownGains, which: str) -> None:
    """Refuse, by `GainsError`, gains of the same drives, `which` in the message, that are in another unit."""
    for joint, value, stated in _in_both(gains, other):
        ratio = abs(stated / value)
        if not 1.0 / OTHER_UNIT < ratio < OTHER_UNIT:
            raise GainsError(
                f"{which}: joint {joint + 1}: {stated:g} is {ratio:.2g} times its gain of {value:.4g}; check the unit, "
                "N m or N per unit of the logged current"
            )


def _in_both(gains: KnownGains, other: KnownGains) -> list[tuple[int, float, float]]:
    """Joints with a gain in both sets, from 0, and both gains."""
    there = other.by_joint
    return [(j, value, there[j]) for j, value in gains.by_joint.items() if j in there]


def same_joint(number: int, one: str, other: str) -> bool:
    """Whether two names can be those of one joint; a name that is the joint's number, from 1, matches any."""
    return one == other or str(number) in (one, other)


def stated_gains(arm: Arm, values: Sequence[float] | Array) -> KnownGains:
    """Return assumed gains of all joints of an arm [N m / drive unit], shape (n,), taken as exact.

    Raises:
        GainsError: If there is not one per joint, or one is zero or not finite.
    """
    if len(values) != arm.n:
        raise GainsError(f"{len(values)} gains, but robot {arm.name} has {arm.n} joints")
    value, covariance = np.array(values, np.float64), np.zeros((arm.n, arm.n))
    return KnownGains(names=arm.joint_names, joints=np.arange(arm.n), value=value, covariance=covariance)


def estimated_gains(estimate: GainEstimate) -> KnownGains:
    """Return the gains of an estimate, without refused ones, with the covariance from residuals, payload and model."""
    solution, given = estimate.solution, estimate.identified
    at = np.array([np.flatnonzero(solution.joints == j)[0] for j in given], dtype=np.intp)
    curves = {j: gain.curve for j, gain in given.items() if gain.curve is not None}
    value = np.array([gain.value for gain in given.values()])
    relative = np.outer(value, value) * estimate.covariance[np.ix_(at, at)]  # dg / g = -g d(1/g)
    for share in (solution.payload[at], solution.model[at]):
        relative = relative + share @ share.T
    return KnownGains(
        names=tuple(joint.joint for joint in estimate.joints),
        joints=np.array(list(given), dtype=np.intp),
        value=value,
        covariance=relative * np.outer(value, value),
        curves=curves,
    )


def held(gains: KnownGains) -> list[GivenGain]:
    """Return the gains as fixed gains of a fit of all joints."""
    return [GivenGain(*each) for each in gains.by_joint.items()]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shares:
    """Covariance of p parameters: from residuals, from the gains, and from the model's assumptions, each (p, p)."""

    residual: Array
    gains: Array
    model: Array

    @property
    def total(self) -> Array:
        """Their sum, shape (p, p)."""
        return self.residual + self.gains + self.model

    def of(self, J: Array) -> "Shares":
        """Covariance of J times the parameters, J of shape (k, p)."""
        return Shares(residual=J @ self.residual @ J.T, gains=J @ self.gains @ J.T, model=J @ self.model @ J.T)


def shares(found: Sensitivity, options: GainOptions, gains: KnownGains | None, rivals: Sequence[Array]) -> Shares:
    """Return the covariance of p parameters of a fit.

    A gain is fixed by a prior on log h with a very small standard deviation (`GivenGain`). To first order the
    sensitivity of a parameter to this prior is its sensitivity to the gain, so the covariance of the gains replaces
    that of the prior:

        C = C_residual + S cov(log g) S^T + B B^T,    S = -d parameter / d log h,

    where B has the change per standard deviation of every other prior, and with each alternative model, `rivals`, each
    of shape (p,). No gains are fixed if only the scale of one is given.
    """
    residual, belief = UNCERTAINTIES[options.uncertainty](found.fit.rows, found.influence), found.belief
    of_gains = np.zeros_like(residual)
    if gains is not None:
        at = belief.shape[1] - len(gains.names) + gains.joints
        S = -belief[:, at] / GIVEN_STD
        belief, of_gains = np.delete(belief, at, axis=1), S @ gains.log_covariance @ S.T
    B = np.column_stack((belief, *rivals))
    return Shares(residual=residual, gains=of_gains, model=B @ B.T)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointTorque:
    """Torques of the joints that have a gain, tau = g(v) v (paper, eq. 7): of the drive, with friction and offset.

    The interval is that of the gain; it does not include noise of the currents.
    """

    t: Array  # sample times [s], shape (N,)
    joints: Indices  # the k joints, from 0, shape (k,)
    tau: Array  # torques [N m, or N where a joint slides], shape (N, k)
    std: Array  # their standard deviations from the gains, shape (N, k)


def joint_torque(recording: Recording, gains: KnownGains) -> JointTorque:
    """Return the torques at every sample, of joints that have a gain; raises `GainsError` without any."""
    if recording.n != len(gains.names):
        raise GainsError(f"{recording.name}: {recording.n} joints, but gains of {len(gains.names)}")
    if not len(gains.joints):
        raise GainsError("gains: no joint has a gain; every one is refused")
    v = recording.v[:, gains.joints]
    g = gains.value * gains.relative(v, np.broadcast_to(gains.joints, v.shape))
    variance = np.broadcast_to(np.diag(gains.log_covariance), v.shape).copy()
    for k, j in enumerate(gains.joints.tolist()):
        if j in gains.curves:
            variance[:, k] = np.maximum(variance[:, k] + gains.curves[j].rel_variance(v[:, k]), 0.0)
    return JointTorque(t=recording.t, joints=gains.joints, tau=g * v, std=np.abs(g * v) * np.sqrt(variance))
