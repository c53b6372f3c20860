"""Identification from bare motions: ratios of gains, base parameters, friction and offsets in drive units.

Without a payload the gains are known up to a common factor; shared link parameters determine their ratios. With one
gain fixed to 1, the model of all joints gives log |g_j| - log |g_r| of every joint j relative to a joint r, and all
parameters in the unit of g_r. With known gains, all parameters are in SI. Ratios can be compared with those of given
gains.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.arm_parameters.parameter_values import Parameter, friction_values, inertial_values
from ident.estimation.all_joints.columns import joint_columns, shared_parameters
from ident.estimation.all_joints.selection import Selected
from ident.estimation.all_joints.solution import GivenGain
from ident.estimation.estimators.nls import AllJointsOptions, chosen_model, setting_of
from ident.estimation.fixed_gains import braked_gain, held
from ident.estimation.identifiability import ratio_refusal
from ident.estimation.known_gains import KnownGains
from ident.estimation.problem import Problem
from ident.estimation.uncertainty import UNCERTAINTIES
from ident.support.arrays import Array, Mask
from ident.support.errors import NotIdentifiable

RUNAWAY = 1e6
"""Largest plausible ratio of two gains of one arm: a wrong unit gives 1e3, prismatic and revolute joints 1e2."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GainRatios:
    """Gains relative to that of one joint.

    Attributes:
        reference: The reference joint, from 0, with the most accurate ratios.
        value: g_j / g_reference, shape (n,).
        rel_std: Relative standard deviations, zero for the reference, shape (n,).
        given: Mask of sufficiently accurate ratios, shape (n,).
        max_rel_std: Largest relative standard deviation of such a ratio.
    """

    reference: int
    value: Array
    rel_std: Array
    given: Mask
    max_rel_std: float

    def reason(self, joint: int) -> str | None:
        """Return why a joint, from 0, has no ratio; None if it has one."""
        return ratio_refusal(float(self.rel_std[joint]), self.max_rel_std, self.reference)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BareArm:
    """An arm without payload.

    Attributes:
        ratios: Ratios of gains; None with fixed gains.
        inertial: Base parameters, over the reference gain or in SI.
        inertial_covariance: Covariance of their values, shape (k, k).
        friction: Friction and offset of each joint [drive units], n tuples.
        selected: The model, and its fit.
    """

    ratios: GainRatios | None
    inertial: tuple[Parameter, ...]
    inertial_covariance: Array
    friction: tuple[tuple[Parameter, ...], ...]
    selected: Selected


def gain_ratios(problem: Problem, options: AllJointsOptions) -> BareArm:
    """Identify ratios of gains, and the arm in drive units.

    Raises:
        NotIdentifiable: If no two joints have an identifiable common parameter.
    """
    columns = joint_columns(problem, shared_parameters(problem))
    braked = braked_gain(columns, per_motion=options.friction_per_motion)
    selected = _fitted(problem, options, [braked])
    best = _surest(_log_covariance(problem, selected), problem.options.max_rel_std)
    if best != braked.joint:  # in units of the reference, other standard deviations do not depend on ratios
        selected = _fitted(problem, options, [GivenGain(best, float(np.sign(selected.final.fit.found.h[best])))])
    h = selected.final.fit.found.h
    rel_std = _beside(_log_covariance(problem, selected))[best]
    most = problem.options.max_rel_std
    given = rel_std <= most
    if given.sum() < 2:
        raise NotIdentifiable(
            "bare motions determine no ratio of gains: no two joints excite a common link parameter; "
            "move more joints at once, or mount a payload"
        )
    ratios = GainRatios(reference=best, value=h[best] / h, rel_std=rel_std, given=given, max_rel_std=most)
    _check_size(ratios)
    inertial, C = inertial_values(problem, selected, float(h[best]), unit=f"/ g{best + 1}", gains=None)  # h of size 1
    return BareArm(
        ratios=ratios,
        inertial=inertial,
        inertial_covariance=C,
        friction=friction_values(problem, selected, None),
        selected=selected,
    )


def arm_in_SI(problem: Problem, options: AllJointsOptions, gains: KnownGains) -> BareArm:
    """Identify base parameters in SI and friction in drive units with known gains.

    Args:
        problem: Motions with a bare flange.
        options: Model of the arm.
        gains: Gains of its joints.

    Raises:
        GainsError: If the gains are not of this arm.
    """
    gains.check_arm(problem.structure.arm)
    selected = _fitted(problem, options, held(gains))
    inertial, C = inertial_values(problem, selected, 1.0, unit="", gains=gains)
    return BareArm(
        ratios=None,
        inertial=inertial,
        inertial_covariance=C,
        friction=friction_values(problem, selected, gains),
        selected=selected,
    )


def _check_size(ratios: GainRatios) -> None:
    """Refuse implausible ratios: a gain diverged while its other parameters compensated.

    Raises:
        NotIdentifiable: If there is one; the message names joint and ratio.
    """
    for joint in np.flatnonzero(ratios.given):
        if abs(np.log(np.abs(ratios.value[joint]))) > np.log(RUNAWAY):
            raise NotIdentifiable(
                f"the gain of joint {joint + 1} diverged from that of joint {ratios.reference + 1}, to "
                f"{ratios.value[joint]:.2g} times its size: the model does not hold for joint "
                f"{joint + 1}; check its coupling, friction and unit, or let the data select the friction "
                "law (option friction = auto)"
            )


def _fitted(problem: Problem, options: AllJointsOptions, given: Sequence[GivenGain]) -> Selected:
    return chosen_model(setting_of(problem, options, given), options)


def _log_covariance(problem: Problem, selected: Selected) -> Array:
    """Return the covariance of log |g| relative to the given gain, shape (n, n)."""
    fit = selected.final.fit
    own = UNCERTAINTIES[problem.options.uncertainty](fit.rows, fit.log_influence)
    model = np.hstack((fit.log_belief, selected.model))
    return own + model @ model.T


def _surest(C: Array, most: float) -> int:
    """Return the joint relative to which most gains are accurate."""
    std = _beside(C)
    sure = [int(np.count_nonzero(row)) for row in std <= most]
    size = [float(np.sum(row)) for row in np.minimum(std, most)]
    return min(range(len(C)), key=lambda r: (-sure[r], size[r]))


def _beside(C: Array) -> Array:
    """Return the standard deviation of log |g_j| - log |g_r|, shape (n, n), r first."""
    return np.sqrt(np.maximum(np.diag(C)[None, :] + np.diag(C)[:, None] - 2.0 * C, 0.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class RatioDiscrepancy:
    """Comparison of a ratio of gains with that of given gains.

    Attributes:
        joint: The joint, from 0.
        rel: Ratio g_j / g_r over that of the given gains, minus 1.
        std: Standard deviation of `rel`, including that of the given gains.
    """

    joint: int
    rel: float
    std: float


def ratio_discrepancies(ratios: GainRatios, believed: KnownGains) -> tuple[RatioDiscrepancy, ...]:
    """Compare ratios of gains with those of given gains; empty if the reference joint has no given gain.

    Args:
        ratios: Ratios from bare motions.
        believed: A-priori gains of the same arm, such as data-sheet gains.
    """
    at = {int(joint): k for k, joint in enumerate(believed.joints)}
    if ratios.reference not in at:
        return ()
    r, C = at[ratios.reference], believed.log_covariance
    found = list[RatioDiscrepancy]()
    for joint, k in at.items():
        if joint != ratios.reference and ratios.given[joint]:
            share = float(ratios.value[joint] / (believed.value[k] / believed.value[r]))
            spread = float(C[k, k] + C[r, r] - 2.0 * C[k, r])
            std = abs(share) * float(np.sqrt(ratios.rel_std[joint] ** 2 + max(spread, 0.0)))
            found.append(RatioDiscrepancy(joint=joint, rel=share - 1.0, std=std))
    return tuple(found)
