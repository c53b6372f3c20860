"""Result of an identification: a gain or a reason for each joint, with rows, residuals and influence.

A solution becomes an estimate by its covariance, the predicted standard deviation and the contribution of the payload;
the sign of a gain is determined twice: by the payload's torque, and by friction, which always brakes.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, NamedTuple

import numpy as np
from annotated_types import Interval

from ident.estimation.intervals import UNCERTAINTIES, Rows
from ident.estimation.problem import GainOptions, Problem
from ident.support.arrays import Array, Indices, Mask, MaskedArray, once_per_object

FRICTION_Z = 10.0
"""Number of standard deviations beyond which the sign of friction is significant."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GainCurve:
    """Gain over current, g(i) = g (1 - slope (|i| - current) - by_sign sign(i)); the torque of the drive is g(i) i.

    Attributes:
        current: Size of the current at which g, the mean of both signs, holds [drive units]: rms with a payload.
        largest: Largest current of the logs [drive units]; larger ones have the gain of this one.
        slope: Relative fall of the gain per unit of current [1 / drive unit].
        by_sign: Relative fall of the gain at positive currents, and rise at negative ones.
        covariance: Covariance of slope, then of by_sign, with log g, slope and by_sign.
    """

    current: Annotated[float, Interval(ge=0.0)]
    largest: Annotated[float, Interval(gt=0.0)]
    slope: float
    by_sign: float
    covariance: tuple[tuple[float, float, float], tuple[float, float, float]]

    def _law(self, i: Array) -> Array:
        """Derivatives of g(i) / g by slope and by_sign at some currents, shape (.., 2)."""
        return -np.stack((np.minimum(np.abs(i), self.largest) - self.current, np.sign(i)), axis=-1)

    def relative(self, i: Array) -> Array:
        """Return g(i) / g at some currents [drive units], of any shape."""
        return 1.0 + self._law(i) @ (self.slope, self.by_sign)

    def rel_variance(self, i: Array) -> Array:
        """Return the variance of log g(i) at some currents, less that of log g, which may be larger."""
        x, K = self._law(i), np.array(self.covariance)
        return np.sum(x * (2.0 * K[:, 0] + x @ K[:, 1:]), axis=-1)

    @property
    def even(self) -> "GainCurve":
        """The mean of both signs."""
        (with_gain, own, _), nothing = self.covariance[0], (0.0, 0.0, 0.0)
        return replace(self, by_sign=0.0, covariance=((with_gain, own, 0.0), nothing))

    def words(self, joint: int, gain: float, unit: str) -> str:
        """Describe the curve of a joint, from 0, with gain g, by the unit of its torque."""
        said = f"joint {joint + 1}: {gain:.4g} {unit}/unit"
        if self.slope:
            end = gain * float(self.even.relative(np.array(self.largest)))
            way = "falls" if self.slope > 0.0 else "rises"
            said += f" at a current of {self.current:.3g}, {way} to {end:.4g} at {self.largest:.3g}, the largest seen"
        if self.by_sign:
            ways = ("larger", "smaller") if self.by_sign < 0.0 else ("smaller", "larger")
            said += f"; {100.0 * abs(self.by_sign):.2g} % {ways[0]} at positive and {ways[1]} at negative currents"
        return said


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentifiedGain:
    """The drive gain of one joint.

    Attributes:
        joint: Name of the joint.
        value: Joint torque per unit of current reference [N m / drive unit].
        residual_std: Contribution of the residuals to the standard deviation [N m / drive unit].
        payload_rel_std: Contribution of the payload's specified uncertainty, relative to the gain.
        model_rel_std: Contribution of the model's assumptions, relative to the gain.
        predicted_rel_std: Relative standard deviation expected of such data, at least that of `residual_std`.
        curve: The gain over the current, if laws of its size or sign correct it; else it is constant.
    """

    joint: str
    value: float
    residual_std: float
    payload_rel_std: float
    model_rel_std: float
    predicted_rel_std: float
    curve: GainCurve | None = None

    @property
    def payload_std(self) -> float:
        """Contribution of the payload's specified uncertainty [N m / drive unit]."""
        return self.payload_rel_std * abs(self.value)

    @property
    def model_std(self) -> float:
        """Contribution of the model's assumptions [N m / drive unit]."""
        return self.model_rel_std * abs(self.value)

    @property
    def std(self) -> float:
        """Total standard deviation, from residuals, payload and model [N m / drive unit]."""
        return float(np.linalg.norm((self.residual_std, self.payload_std, self.model_std)))


@dataclass(frozen=True, slots=True, kw_only=True)
class RefusedGain:
    """A joint, by name, whose gain the data do not determine; predicted relative deviation, None if not predictable."""

    joint: str
    reason: str
    predicted_rel_std: float | None


JointResult = IdentifiedGain | RefusedGain


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundParameter:
    """An inertial parameter of the payload, at the origin of the last frame, estimated with the gains.

    Attributes:
        name: One of `INERTIAL`.
        value: Estimate [kg m^2, kg m or kg].
        std: Its standard deviation, including the contribution of the gains.
    """

    name: str
    value: float
    std: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GainSolution:
    """The output of an estimator: 1/g of k joints and its derivatives, before identifiability is judged."""

    rows: Rows  # the r rows of the fit with their residuals, of the k joints or of more
    joints: Indices  # the k joints, from 0, shape (k,)
    inverse: Array  # 1/g, shape (k,)
    influence: Array  # derivative of each 1/g by the current of each row, shape (k, r)
    payload: Array  # relative change of each gain per standard deviation of each specified payload value, shape (k, p)
    model: Array  # relative change of each gain per standard deviation of each model assumption, shape (k, m)
    load_rms: Array  # root mean square of the known payload's torque on each joint [N m], shape (k,)
    # friction torque over g at typical speed, and its Coulomb part alone; their sign is that of g; Shape (k, 2):
    friction: Array
    friction_influence: Array  # its derivative by the current of each row, shape (k, 2, r)
    unsolved: Mapping[int, str]  # reasons of the joints without 1/g, by joint
    # the solution with rigid joints if the data selected elastic ones, as elasticity can imitate a fault; else None:
    stiff: "GainSolution | None" = None
    # gain over current, by joint from 0, of joints whose gain is not constant:
    curves: Mapping[int, GainCurve] = field(default_factory=dict[int, GainCurve])


@dataclass(frozen=True, slots=True, weakref_slot=True, kw_only=True, eq=False)
class GainEstimate:
    """Drive gains of an arm, with the data that they follow from.

    Attributes:
        method: Name of the method.
        joints: One result per joint.
        solution: Rows, residuals and the influence of each row.
        covariance: Covariance of the k values 1/g of the solution, from the residuals, shape (k, k).
        options: Options of covariance and refusals.
        payload: Payload parameters that the method estimated with the gains.
        remarks: What the method selected, in words.
    """

    method: str
    joints: tuple[JointResult, ...]
    solution: GainSolution = field(repr=False)
    covariance: Array
    options: GainOptions
    payload: tuple[FoundParameter, ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def identified(self) -> dict[int, IdentifiedGain]:
        """The gains, by joint from 0."""
        return {j: joint for j, joint in enumerate(self.joints) if isinstance(joint, IdentifiedGain)}

    @property
    def identifiable(self) -> Mask:
        """Which joints have a gain, shape (n,)."""
        return np.array([isinstance(joint, IdentifiedGain) for joint in self.joints])

    @property
    def gain(self) -> MaskedArray:
        """The gains [N m / drive unit], shape (n,), masked where refused."""
        return self._of_gains("value")

    @property
    def std(self) -> MaskedArray:
        """Total standard deviations, from residuals, payload and model, shape (n,), masked where refused."""
        return self._of_gains("std")

    @property
    def reasons(self) -> tuple[str | None, ...]:
        """Reason of each joint's refusal, None where it has a gain."""
        return tuple(None if isinstance(joint, IdentifiedGain) else joint.reason for joint in self.joints)

    def gain_at(self, current: Array) -> MaskedArray:
        """Return the gains [N m / drive unit] at currents with their signs, shape (n,) or (N, n).

        Masked where refused, and where a gain that is not constant is unknown: beyond the largest current of the logs.
        """
        current = np.asarray(current, np.float64)
        share, unknown = np.ones(current.shape), np.array(np.broadcast_to(~self.identifiable, current.shape))
        for j, gain in self.identified.items():
            if gain.curve is not None:
                share[..., j] = gain.curve.relative(current[..., j])
                unknown[..., j] = np.abs(current[..., j]) > gain.curve.largest
        return np.ma.array(self.gain.data * share, mask=unknown)

    def _of_gains(self, name: str) -> MaskedArray:
        numbers = [getattr(joint, name) if isinstance(joint, IdentifiedGain) else 0.0 for joint in self.joints]
        return np.ma.array(numbers, mask=~self.identifiable, dtype=np.float64)

    @property
    def rows(self) -> int:
        """Number of rows used, of all joints."""
        return len(self.solution.rows.V)

    @property
    def error_norm(self) -> float:
        """Norm of the residuals of all joints [drive units]."""
        return float(np.linalg.norm(self.solution.rows.residual))

    @property
    def rel_error_norm(self) -> float:
        """Ratio of the norm of the residuals to that of the currents, of all joints."""
        return self.error_norm / float(np.linalg.norm(self.solution.rows.V))

    @property
    def sigma(self) -> float:
        """Standard deviation of the residuals of all joints (eq. 19) [drive units]."""
        rows = self.solution.rows
        return self.error_norm / float(np.sqrt(len(rows.V) - sum(rows.unknowns.values())))

    def residual_share(self, joint: int) -> float | None:
        """Ratio of the norms of a joint's residual and currents, None if no row of the joint (from 0) was used."""
        rows = self.solution.rows
        return rows.residual_share(joint) if joint in rows.unknowns else None


def judge_identifiability(
    method: str, problem: Problem, solution: GainSolution, *, payload: tuple[FoundParameter, ...] = ()
) -> GainEstimate:
    """Judge the solution of a problem by a method joint by joint, with payload parameters that it also estimated."""
    options = problem.options
    covariance, std = uncertain(solution.rows, solution.influence, options)
    shares = [np.linalg.norm(each, axis=1) for each in (solution.payload, solution.model)]
    # std(g) / g = std(1/g) / (1/g); refusals use the total standard deviation
    predicted = np.linalg.norm([std / np.abs(solution.inverse), *shares], axis=0)
    names, joints = problem.structure.arm.joint_names, dict[int, JointResult]()
    for j, reason in solution.unsolved.items():
        joints[j] = RefusedGain(joint=names[j], reason=reason, predicted_rel_std=None)
    for k, (j, expected) in enumerate(zip(solution.joints.tolist(), predicted.tolist(), strict=True)):
        if expected > options.max_rel_std:
            load, unit = float(solution.load_rms[k]), "N m" if problem.structure.arm.revolute[j] else "N"
            why = f"the payload puts {load:.3g} {unit} rms on this joint" if load else "no payload loads this joint"
            most = f"exceeds {_percent(options.max_rel_std)}"
            reason = f"predicted standard deviation {_percent(expected)} of the gain {most}; {why}"
            joints[j] = RefusedGain(joint=names[j], reason=reason, predicted_rel_std=expected)
        else:
            gain = 1.0 / float(solution.inverse[k])
            joints[j] = IdentifiedGain(
                joint=names[j], value=gain,
                residual_std=float(np.sqrt(covariance[k, k])) * gain**2,  # g = 1/x: std(g) = g^2 std(x)
                payload_rel_std=float(shares[0][k]), model_rel_std=float(shares[1][k]), predicted_rel_std=expected,
                curve=solution.curves.get(j),
            )  # fmt: skip
    return GainEstimate(
        method=method, joints=tuple(joints[j] for j in sorted(joints)), solution=solution, covariance=covariance,
        options=options, payload=payload,
    )  # fmt: skip


def uncertain(rows: Rows, influence: Array, options: GainOptions) -> tuple[Array, Array]:
    """Return the covariance of k quantities, shape (k, k), and standard deviations of at least those of a real drive.

    `influence` is the derivative of each quantity by each row's current, shape (k, r).
    """
    covariance = UNCERTAINTIES[options.uncertainty](rows, influence)
    least = np.linalg.norm(influence * (options.noise_floor * rows.of_joints(rows.rms_current)), axis=1)
    return covariance, np.maximum(np.sqrt(np.diag(covariance)), least)


def ratio_refusal(rel_std: float, max_rel_std: float, reference: int) -> str | None:
    """Return the reason if the ratio of a gain to that of a reference joint, from 0, is refused, else None."""
    if rel_std <= max_rel_std:
        return None
    tied = f"these motions hardly excite the links that it shares with joint {reference + 1}"
    return f"standard deviation {_percent(rel_std)} of the ratio exceeds {_percent(max_rel_std)}; {tied}"


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"


class JointSigns(NamedTuple):
    """1/g, and friction over g, each over its standard deviation, shape (k,); both have the sign of the gain."""

    load_z: Array
    friction_z: Array


@once_per_object
def joint_signs(estimate: GainEstimate) -> JointSigns:
    """Return the significance of each solved gain's sign, by load and by friction.

    Of total and Coulomb friction, the more significant is taken; residuals are at least the noise floor of real drives.
    """
    solution = estimate.solution
    flat = solution.friction_influence.reshape(solution.friction.size, len(solution.rows.V))
    std = uncertain(solution.rows, flat, estimate.options)[1].reshape(solution.friction.shape)
    z = np.divide(solution.friction, std, out=np.zeros_like(std), where=std > 0.0)
    return JointSigns(solution.inverse / np.sqrt(np.diag(estimate.covariance)), largest(z))


def largest(x: Array) -> Array:
    """Return the value of largest magnitude along the last axis."""
    return np.take_along_axis(x, np.argmax(np.abs(x), axis=-1)[..., None], axis=-1)[..., 0]
