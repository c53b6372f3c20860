"""The arm from bare motions: ratios of gains, base parameters and friction, and a forecast of a loaded motion.

Without a payload the gains are known up to a common factor; shared link parameters determine their ratios. With one
gain fixed to 1, the model of all joints gives log |g_j| - log |g_r| of every joint j relative to a joint r, and all
parameters in the unit of g_r. With known gains, the same fit has all parameters in SI.

Forecast: with approximately known gains g the same motion with a payload would need the currents

    V' = V + W_L chi_L / g,

so the rows of the bare motions plus this term represent the loaded ones, including residuals; the estimate from both is
that of real motions, except for load-dependent friction.
"""

from dataclasses import dataclass, replace

import numpy as np

from ident.estimation.all_joints.columns import joint_columns, shared_arm, shared_parameters
from ident.estimation.all_joints.selection import AlternativeModel, Selected
from ident.estimation.all_joints.solution import Fitted, GivenGain
from ident.estimation.estimate import IdentifiedGain
from ident.estimation.estimators.nls import AllJointsOptions, all_joints_gains, chosen_model, setting_of
from ident.estimation.fixed_gains import braked_gain, deviations, held, shares
from ident.estimation.identifiability import ratio_refusal
from ident.estimation.joint_by_joint.pooled_system import PooledSystem
from ident.estimation.known_gains import KnownGains
from ident.estimation.problem import ObservedMotion, Problem
from ident.estimation.uncertainty import UNCERTAINTIES
from ident.model.parameters import unit_of
from ident.observation.observation import Observation
from ident.payload.payload import Payload
from ident.support.arrays import Array, Indices, Mask
from ident.support.errors import NotIdentifiable

RUNAWAY = 1e6
"""Largest plausible ratio of two gains of one arm: a wrong unit gives 1e3, prismatic and revolute joints 1e2."""
PLAIN = AllJointsOptions(friction="viscous-coulomb")
"""Model for methods other than `nls`, whose gains include load-dependent friction."""
FRICTION_UNITS = {"Fv": "s/rad", "cbrt": "(s/rad)^(1/3)", "by-direction": "s/rad"}
"""Units by name, for a revolute joint, without the drive unit."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """A parameter of the arm or of a joint's own friction.

    Attributes:
        name: Name as in the literature, numbered by joint; several names if only their sum is identifiable.
        unit: Unit of the value.
        value: Estimate.
        std: Standard deviation, including that of known gains.
    """

    name: str
    unit: str
    value: float
    std: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GainRatios:
    """Gains relative to that of one joint.

    Attributes:
        reference: The reference joint, from 0, with the most accurate ratios.
        value: g_j / g_reference, shape (n,).
        rel_std: Relative standard deviations, zero for the reference, shape (n,).
        given: Mask of sufficiently accurate ratios, shape (n,).
        max_rel_std: Largest relative standard deviation of such a ratio.

    Raises:
        NotIdentifiable: If a ratio is implausible: a gain diverged while its other parameters compensated.
    """

    reference: int
    value: Array
    rel_std: Array
    given: Mask
    max_rel_std: float

    def __post_init__(self) -> None:
        """Check the size of the ratios."""
        for joint in np.flatnonzero(self.given):
            if abs(np.log(np.abs(self.value[joint]))) > np.log(RUNAWAY):
                raise NotIdentifiable(
                    f"the gain of joint {joint + 1} diverged from that of joint {self.reference + 1}, to "
                    f"{self.value[joint]:.2g} times its size: the model does not hold for joint {joint + 1}; check its "
                    "coupling, friction and unit, or let the data select the friction law (option friction = auto)"
                )

    def reason(self, joint: int) -> str | None:
        """Return why a joint, from 0, has no ratio; None if it has one."""
        return ratio_refusal(float(self.rel_std[joint]), self.max_rel_std, self.reference)

    def against(self, believed: KnownGains) -> dict[int, tuple[float, float]]:
        """Compare with the ratios of a-priori gains; empty if these have no gain of the reference joint.

        Returns:
            By joint, from 0: ratio g_j / g_r over that of the given gains, minus 1, and its standard deviation,
            including that of the given gains.
        """
        at = {joint: k for k, joint in enumerate(believed.joints.tolist())}
        found, C = dict[int, tuple[float, float]](), believed.log_covariance
        r = at.get(self.reference)
        for joint, k in at.items() if r is not None else ():
            if k != r and self.given[joint]:
                share = float(self.value[joint] / (believed.value[k] / believed.value[r]))
                spread = max(float(C[k, k] + C[r, r] - 2.0 * C[k, r]), 0.0)
                found[joint] = share - 1.0, abs(share) * float(np.sqrt(self.rel_std[joint] ** 2 + spread))
        return found


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BareArm:
    """An arm without payload.

    Attributes:
        problem: Its motions.
        gains: Fixed gains; None for an arm in the unit of a reference gain.
        ratios: Ratios of gains; None with fixed gains.
        inertial: Base parameters, over the reference gain or in SI.
        inertial_covariance: Covariance of their values, shape (k, k).
        friction: Friction and offset of each joint [drive units], n tuples.
        selected: The model, and its fit.
    """

    problem: Problem
    gains: KnownGains | None
    ratios: GainRatios | None
    inertial: tuple[Parameter, ...]
    inertial_covariance: Array
    friction: tuple[tuple[Parameter, ...], ...]
    selected: Selected

    def in_si(self) -> tuple[Array, Array]:
        """Return base parameters with friction of the first motion, and their covariance from the residuals.

        Gains are taken as exact; zero where not identifiable, and for friction of joints without a gain. Shapes (b,)
        and (b, b).
        """
        assert self.gains is not None, "of an arm with fixed gains"
        final, structure = self.selected.final, self.problem.structure
        fit, arm, names = final.fit, shared_arm(structure.base), structure.base.names
        base, influence = np.zeros(len(names)), np.zeros((len(names), len(fit.rows.V)))
        influence[arm] = fit.theta_influence[: len(arm)]
        base[arm] = np.where(influence[arm].any(axis=1), fit.found.theta[: len(arm)], 0.0)
        for j, gain in zip(self.gains.joints.tolist(), self.gains.value.tolist(), strict=True):
            own = zip(final.own[j].names, fit.phi[j], fit.phi_influence[j], strict=True)
            for name, value, row in reversed(list(own)):  # values of the first motion are kept
                at = names.index(f"{name}{j + 1}")
                base[at], influence[at] = gain * value, gain * row
        return base, UNCERTAINTIES[self.problem.options.uncertainty](fit.rows, influence)


def gain_ratios(problem: Problem, options: AllJointsOptions) -> BareArm:
    """Identify ratios of gains, and the arm in drive units.

    Raises:
        NotIdentifiable: If no two joints have an identifiable common parameter.
    """
    given = braked_gain(joint_columns(problem, shared_parameters(problem)), per_motion=options.friction_per_motion)
    selected, most = chosen_model(setting_of(problem, options, [given]), options), problem.options.max_rel_std
    best = surest(_log_covariance(problem, selected), most)
    if best != given.joint:  # in units of the reference, other standard deviations do not depend on ratios
        given = GivenGain(best, float(np.sign(selected.final.fit.found.h[best])))
        selected = chosen_model(setting_of(problem, options, [given]), options)
    h, rel_std = selected.final.fit.found.h, _relative(_log_covariance(problem, selected))[best]
    if np.count_nonzero(rel_std <= most) < 2:
        raise NotIdentifiable(
            "bare motions determine no ratio of gains: no two joints excite a common link parameter; "
            "move more joints at once, or mount a payload"
        )
    ratios = GainRatios(reference=best, value=h[best] / h, rel_std=rel_std, given=rel_std <= most, max_rel_std=most)
    return _arm(problem, selected, None, ratios)


def arm_in_SI(problem: Problem, options: AllJointsOptions, gains: KnownGains) -> BareArm:
    """Identify base parameters in SI and friction in drive units with known gains, from motions with a bare flange.

    Raises:
        GainsError: If the gains are not of this arm.
    """
    gains.check_arm(problem.structure.arm)
    return _arm(problem, chosen_model(setting_of(problem, options, held(gains)), options), gains, None)


def arm_in_use(problem: Problem, gains: KnownGains) -> BareArm:
    """Identify the arm with given gains, from the bare motions of a problem, with viscous and Coulomb friction.

    Raises:
        NotIdentifiable: If no motion is bare.
        GainsError: If the gains are not of this arm.
    """
    bare = replace(problem, motions=tuple(motion for motion in problem.motions if motion.payload is None))
    if not bare.motions:
        raise NotIdentifiable("no motion is bare; record one without payload")
    return arm_in_SI(bare, PLAIN, gains)


def _arm(problem: Problem, selected: Selected, gains: KnownGains | None, ratios: GainRatios | None) -> BareArm:
    """Return the parameters of a fit; in the unit of the reference gain if there are ratios."""
    structure, options, final = problem.structure, problem.options, selected.final
    revolute, names = structure.arm.revolute.tolist(), structure.base.names
    fit, arm = final.fit, shared_arm(structure.base)
    scale = 1.0 if ratios is None else float(fit.found.h[ratios.reference])  # of size 1
    unit = "" if ratios is None else f" / g{ratios.reference + 1}"
    a = len(arm)
    rivals = [
        each.share * (each.other.fit.found.theta[:a] - each.final.fit.found.theta[:a]) for each in selected.rivals
    ]
    influence, belief = fit.theta_influence[:a], fit.theta_belief[:a]
    beside = np.column_stack((belief[:, :0], *rivals))
    C = scale**2 * shares(fit.rows, options, gains, influence=influence, belief=belief, rivals=beside).total
    std, shown = deviations(C), np.flatnonzero(influence.any(axis=1))
    inertial = tuple(
        Parameter(
            name=names[arm[k]],
            unit=unit_of(names[arm[k]], revolute) + unit,
            value=float(fit.found.theta[k] * scale),
            std=float(std[k]),
        )
        for k in shown
    )
    friction = list[tuple[Parameter, ...]]()
    for j, (own, phi) in enumerate(zip(final.own, fit.phi, strict=True)):
        belief = fit.phi_belief[j]
        beside = np.column_stack((belief[:, :0], *(rival_friction(each, j, final) for each in selected.rivals)))
        covariance = shares(fit.rows, options, gains, influence=fit.phi_influence[j], belief=belief, rivals=beside)
        each = zip(own.names, own.motion, phi.tolist(), deviations(covariance.total).tolist(), strict=True)
        friction.append(
            tuple(
                Parameter(
                    name=name if motion < 0 or len(problem.motions) == 1 else f"{name} in motion {motion + 1}",
                    unit=friction_unit(name, turns=revolute[j]),
                    value=value,
                    std=deviation,
                )
                for name, motion, value, deviation in each
            )
        )
    return BareArm(
        problem=problem,
        gains=gains,
        ratios=ratios,
        inertial=inertial,
        inertial_covariance=C[np.ix_(shown, shown)],
        friction=tuple(friction),
        selected=selected,
    )


def rival_friction(each: AlternativeModel, joint: int, final: Fitted) -> Array:
    """Return the change of a joint's own parameters in an alternative model, by name and motion.

    Zero for parameters of only one model: the forms of load-dependent friction have different parameters, and rigid and
    elastic joints are compared without load-dependent friction.
    """
    one, other = (
        dict(zip(zip(fit.own[joint].names, fit.own[joint].motion, strict=True), fit.fit.phi[joint], strict=True))
        for fit in (each.final, each.other)
    )
    keys = zip(final.own[joint].names, final.own[joint].motion, strict=True)
    return np.array([each.share * (other[key] - one[key]) if key in one and key in other else 0.0 for key in keys])


def friction_unit(name: str, *, turns: bool) -> str:
    """Return the unit of a joint's own parameter."""
    if name.startswith("load") or name.endswith("-share"):
        return "1"
    unit = FRICTION_UNITS.get(name, "")
    return f"units {unit if turns else unit.replace('rad', 'm')}".rstrip()


def _log_covariance(problem: Problem, selected: Selected) -> Array:
    """Return the covariance of log |g| relative to the given gain, shape (n, n)."""
    fit = selected.final.fit
    influence, rivals = fit.log_influence, selected.model
    return shares(fit.rows, problem.options, None, influence=influence, belief=fit.log_belief, rivals=rivals).total


def surest(C: Array, most: float) -> int:
    """Return the joint relative to which most gains are accurate, from the covariance of their logarithms (n, n)."""
    std = _relative(C)
    sure, size = np.count_nonzero(std <= most, axis=1), np.minimum(std, most).sum(axis=1)
    return min(range(len(C)), key=lambda r: (-sure[r], size[r]))


def _relative(C: Array) -> Array:
    """Return the standard deviation of log |g_j| - log |g_r|, shape (n, n), r first."""
    return np.sqrt(np.maximum(np.diag(C)[None, :] + np.diag(C)[:, None] - 2.0 * C, 0.0))


def forecast_gains(
    problem: Problem, options: AllJointsOptions, payload: Payload, in_si: BareArm, ratios: GainRatios
) -> tuple[float | str, ...]:
    """Return the expected accuracy of every gain if bare motions were repeated with a payload.

    Args:
        problem: Motions with a bare flange.
        options: Model of the arm.
        payload: The planned payload; all stated parameters affect the currents, `known` ones are used.
        in_si: The arm with known gains.
        ratios: Ratios of gains from the motions.

    Returns:
        The relative standard deviation of each joint's gain, or why there would be none or no forecast.

    Raises:
        NotIdentifiable: If no parameter of the payload is known, or it puts no torque on any joint.
    """
    if payload.known == "none":
        raise NotIdentifiable(
            "no parameter of the payload to be mounted is known, so it determines no gain; give its mass"
        )
    assert in_si.gains is not None, "of an arm with known gains"
    gain, joints = 1.0 / in_si.selected.final.fit.found.h, in_si.gains.joints
    loaded = [ObservedMotion(with_payload_torque(each.observation, payload, gain), payload) for each in problem.motions]
    estimate = all_joints_gains(replace(problem, motions=(*problem.motions, *loaded)), options)
    tied = bool(ratios.given[joints].any())
    unknown = "its gain is neither given nor identifiable relative to a given one, so the payload's torque is unknown"
    return tuple(
        unknown
        if j not in joints and not (tied and ratios.given[j])
        else abs(each.std / each.value)
        if isinstance(each, IdentifiedGain)
        else each.reason
        for j, each in enumerate(estimate.joints)
    )


def with_payload_torque(observation: Observation, payload: Payload, gain: Array) -> Observation:
    """Return a bare motion's rows with the added torque of a payload; gains [N m / drive unit] of shape (n,)."""
    chi = payload.known_part().chi
    joints = zip(observation.joints, gain.tolist(), strict=True)
    return replace(observation, joints=tuple(replace(each, V=each.V + each.W_L @ chi / g) for each, g in joints))


def predicted_torque(system: PooledSystem, base: Array, payload: Payload | None) -> Array:
    """Return the torque of arm and payload on the rows of a motion, including friction [N m], shape (r,).

    Args:
        system: Its rows.
        base: Base parameters of the arm, shape (b,).
        payload: Its payload, of which known parameters are used; None for a bare flange.
    """
    torque = system.W @ base
    return torque if payload is None else torque + system.W_L @ payload.known_part().chi


def rel_errors(error: Array, measured: Array, joint: Indices) -> dict[int, float]:
    """Return the norm of an error over that of the measured values, by joint from 0; all arguments have shape (r,)."""
    rows = {int(j): joint == j for j in np.unique(joint)}
    return {j: float(np.linalg.norm(error[at]) / np.linalg.norm(measured[at])) for j, at in rows.items()}
