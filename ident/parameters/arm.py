"""The arm from bare motions: ratios of gains, base parameters and friction.

Without a payload the gains are known up to a common factor; shared link parameters determine their ratios. With one
gain fixed to 1, the model of all joints gives log |g_j| - log |g_r| of every joint j relative to a joint r, and all
parameters in the unit of g_r. With known gains, the same fit has all parameters in SI.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ident.estimation.all_joints import Fit
from ident.estimation.estimate import ratio_refusal
from ident.estimation.estimators.nls import AllJointsOptions, chosen_model, setting_of
from ident.estimation.intervals import UNCERTAINTIES, deviations
from ident.estimation.known_gains import KnownGains, Shares, held, shares
from ident.estimation.problem import Columns, Problem
from ident.estimation.selection import AlternativeModel, Selected
from ident.estimation.setting import GivenGain, Setting
from ident.model.parameters import unit_of
from ident.payload.payload import Payload
from ident.support.arrays import Array, Indices, Mask
from ident.support.errors import NotIdentifiable

RUNAWAY = 1e6
"""Largest plausible ratio of two gains of one arm: a wrong unit gives 1e3, prismatic and revolute joints 1e2."""
PLAIN = AllJointsOptions(friction="viscous-coulomb")
"""Model for methods other than `nls`, whose gains include load-dependent friction."""
FRICTION_UNITS = {
    **dict.fromkeys(("Fv", "by-direction"), "units s/rad"),
    "cbrt": "units (s/rad)^(1/3)",
    **dict.fromkeys(("Fc", "off"), "units"),
}
"""Units of a revolute joint's own parameters in drive units; those of shares are 1."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """A number with its standard deviations: from the residuals, the gains, and the model's assumptions."""

    name: str
    unit: str
    value: float
    residual_std: float
    gain_std: float = 0.0
    model_std: float = 0.0

    @property
    def std(self) -> float:
        """Total standard deviation."""
        return float(np.linalg.norm((self.residual_std, self.gain_std, self.model_std)))


def quantities(names: Sequence[str], units: Sequence[str], values: Array, of: Shares) -> tuple[Quantity, ...]:
    """Return numbers with the standard deviations of their covariance."""
    stds = [deviations(part).tolist() for part in (of.residual, of.gains, of.model)]
    return tuple(
        Quantity(name=name, unit=unit, value=value, residual_std=residual, gain_std=gain, model_std=model)
        for name, unit, value, residual, gain, model in zip(names, units, values.tolist(), *stds, strict=True)
    )


def shared_shares(selected: Selected, gains: KnownGains | None, k: Indices) -> Shares:
    """Return the covariance of parameters that joints share, by their indices."""
    rivals = [each.share * (each.other.theta[k] - each.final.theta[k]) for each in selected.rivals]
    return shares(selected.final.of_theta(k), selected.final.ready.problem.options, gains, rivals)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GainRatios:
    """Gains relative to that of one joint; raises `NotIdentifiable` for an implausible ratio, of a diverged gain."""

    reference: int  # the reference joint, from 0, with the most accurate ratios
    value: Array  # g_j / g_reference, shape (n,)
    rel_std: Array  # relative standard deviations, zero for the reference, shape (n,)
    given: Mask  # mask of sufficiently accurate ratios, shape (n,)
    max_rel_std: float  # largest relative standard deviation of such a ratio

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
        """Return ratios g_j / g_r over those of assumed gains, minus 1, with standard deviations, by joint from 0.

        The deviations include those of the given gains; it is empty if these have no gain of the reference joint.
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


@dataclass(frozen=True, kw_only=True, eq=False)
class BareArm:
    """An arm without payload."""

    gains: KnownGains | None  # fixed gains; None for an arm in the unit of a reference gain
    ratios: GainRatios | None  # ratios of gains; None with fixed gains
    selected: Selected  # the model, and its fit

    @property
    def problem(self) -> Problem:
        """Its motions."""
        return self.selected.final.ready.problem

    @cached_property
    def _shown(self) -> Indices:
        """Shared parameters of the arm that the motions excite."""
        arm = slice(len(self.selected.final.ready.shared.arm))
        return np.flatnonzero(self.selected.final.of_theta(arm).influence.any(axis=1))

    @cached_property
    def _shares(self) -> Shares:
        return shared_shares(self.selected, self.gains, self._shown)

    @property
    def inertial_covariance(self) -> Array:
        """Covariance of the values of `inertial`, shape (k, k)."""
        return self._shares.total

    @cached_property
    def inertial(self) -> tuple[Quantity, ...]:
        """Base parameters, over the reference gain or in SI, k of them."""
        final, structure, over, scale = self.selected.final, self.problem.structure, "", 1.0
        if self.ratios is not None:
            over, scale = f" / g{self.ratios.reference + 1}", float(final.h[self.ratios.reference])  # of size 1
        names = [structure.base.names[k] for k in final.ready.shared.arm[self._shown]]
        units = [unit_of(name, structure.arm.revolute.tolist()) + over for name in names]
        return quantities(names, units, scale * final.theta[self._shown], self._shares)

    @cached_property
    def friction(self) -> tuple[tuple[Quantity, ...], ...]:
        """Friction and offset of each joint [drive units], n tuples."""
        final, several, found = self.selected.final, len(self.problem.motions) > 1, list[tuple[Quantity, ...]]()
        for j, turns in enumerate(self.problem.structure.arm.revolute.tolist()):
            own, rivals = final.friction(j), [rival_friction(each, j, final) for each in self.selected.rivals]
            names = [f"{name} in motion {motion + 1}" if several and motion >= 0 else name for name, motion in own]
            units = [friction_unit(name, turns=turns) for name, _ in own]
            of = shares(final.of_joint(j), self.problem.options, self.gains, rivals)
            found.append(quantities(names, units, np.array(list(own.values())), of))
        return tuple(found)

    def in_si(self) -> tuple[Array, Array]:
        """Return base parameters with friction of the first motion, and their covariance from the residuals.

        Gains are taken as exact; zero where not identifiable, and for friction of joints without a gain. Shapes (b,)
        and (b, b).
        """
        assert self.gains is not None, "of an arm with fixed gains"
        final, names = self.selected.final, self.problem.structure.base.names
        arm, base = final.ready.shared.arm[self._shown], np.zeros(len(names))
        influence = np.zeros((len(names), len(final.rows.V)))
        base[arm], influence[arm] = final.theta[self._shown], final.of_theta(self._shown).influence
        for j, gain in self.gains.by_joint.items():
            own = zip(final.friction(j).items(), final.of_joint(j).influence, strict=True)
            for ((name, _), value), row in reversed(list(own)):  # values of the first motion are kept
                at = names.index(f"{name}{j + 1}")
                base[at], influence[at] = gain * value, gain * row
        return base, UNCERTAINTIES[self.problem.options.uncertainty](final.rows, influence)


def gain_ratios(problem: Problem, options: AllJointsOptions, believed: KnownGains | None = None) -> BareArm:
    """Identify ratios of gains, with believed curves, and the arm in drive units; `NotIdentifiable` if none shows."""
    ready = linearised(setting_of(problem, options, None), believed)
    (given,) = ready.given
    selected, most = chosen_model(ready, options), problem.options.max_rel_std
    best = surest(_log_covariance(problem, selected), most)
    if best != given.joint:  # in units of the reference, other standard deviations do not depend on ratios
        selected = chosen_model(ready.with_gains([GivenGain(best, float(np.sign(selected.final.h[best])))]), options)
    h, rel_std = selected.final.h, _relative(_log_covariance(problem, selected))[best]
    if np.count_nonzero(rel_std <= most) < 2:
        raise NotIdentifiable(
            "bare motions determine no ratio of gains: no two joints excite a common link parameter; "
            "move more joints at once, or mount a payload"
        )
    ratios = GainRatios(reference=best, value=h[best] / h, rel_std=rel_std, given=rel_std <= most, max_rel_std=most)
    return BareArm(gains=None, ratios=ratios, selected=selected)


def arm_in_SI(problem: Problem, options: AllJointsOptions, gains: KnownGains) -> BareArm:
    """Identify an arm in SI, friction in drive units, from bare motions; `GainsError` if the gains are not of it."""
    return BareArm(gains=gains, ratios=None, selected=with_fixed_gains(problem, options, gains))


def with_fixed_gains(problem: Problem, options: AllJointsOptions, gains: KnownGains) -> Selected:
    """Fit all joints with fixed gains; raises GainsError if these are not of the arm."""
    gains.check_arm(problem.structure.arm)
    return chosen_model(linearised(setting_of(problem, options, held(gains)), gains), options)


def linearised(ready: Setting, gains: KnownGains | None) -> Setting:
    """Return the same problem with the currents of constant gains that have the same torques."""
    if gains is None or not gains.curves:
        return ready
    return ready.with_currents(ready.columns.V * gains.relative(ready.columns.V, ready.columns.joint))


def arm_in_use(problem: Problem, gains: KnownGains) -> BareArm:
    """Identify the arm with given gains, from the bare motions of a problem, with viscous and Coulomb friction.

    Raises `NotIdentifiable` if no motion is bare, `GainsError` if the gains are not of this arm.
    """
    bare = replace(problem, motions=tuple(motion for motion in problem.motions if motion.payload is None))
    if not bare.motions:
        raise NotIdentifiable("no motion is bare; record one without payload")
    return arm_in_SI(bare, PLAIN, gains)


def rival_friction(each: AlternativeModel, joint: int, final: Fit) -> Array:
    """Return the change of a joint's own parameters in an alternative model; zero for those of only one model."""
    one, other = each.final.friction(joint), each.other.friction(joint)
    return np.array(
        [each.share * (other[key] - one[key]) if key in one and key in other else 0.0 for key in final.friction(joint)]
    )


def friction_unit(name: str, *, turns: bool) -> str:
    """Return the unit of a joint's own parameter."""
    unit = FRICTION_UNITS.get(name, "1")
    return unit if turns else unit.replace("rad", "m")


def _log_covariance(problem: Problem, selected: Selected) -> Array:
    """Return the covariance of log |g| relative to the given gain, (n, n)."""
    return shares(selected.final.log_h, problem.options, None, list(selected.model.T)).total


def surest(C: Array, most: float) -> int:
    """Return the joint relative to which most gains are accurate, from the covariance of their logarithms (n, n)."""
    std = _relative(C)
    sure, size = np.count_nonzero(std <= most, axis=1), np.minimum(std, most).sum(axis=1)
    return min(range(len(C)), key=lambda r: (-sure[r], size[r]))


def _relative(C: Array) -> Array:
    """Return the standard deviation of log |g_j| - log |g_r|, shape (n, n), r first."""
    return np.sqrt(np.maximum(np.diag(C)[None, :] + np.diag(C)[:, None] - 2.0 * C, 0.0))


def predicted_torque(system: Columns, base: Array, payload: Payload | None) -> Array:
    """Return the torque on the rows of a motion, including friction [N m], shape (r,).

    `base` are the base parameters of the arm, shape (b,); the known parameters of the payload are used.
    """
    torque = system.W @ base
    return torque if payload is None else torque + system.carried @ payload.known_part().chi


def rel_errors(error: Array, measured: Array, joint: Indices) -> dict[int, float]:
    """Return the norm of an error over that of the measured values, by joint from 0; all arguments have shape (r,)."""
    rows = {int(j): joint == j for j in np.unique(joint)}
    return {j: float(np.linalg.norm(error[at]) / np.linalg.norm(measured[at])) for j, at in rows.items()}
