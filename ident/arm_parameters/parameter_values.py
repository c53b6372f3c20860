"""Parameters of a fit of all joints, with standard deviations from residuals, alternative models, priors and gains."""

from dataclasses import dataclass

import numpy as np

from ident.estimation.all_joints.columns import shared_parameters
from ident.estimation.all_joints.selection import AlternativeModel, Selected
from ident.estimation.all_joints.solution import Fitted
from ident.estimation.fixed_gains import gain_covariance, own_beliefs
from ident.estimation.known_gains import KnownGains
from ident.estimation.problem import Problem
from ident.estimation.rows import Rows
from ident.estimation.uncertainty import UNCERTAINTIES
from ident.model.parameters import unit_of
from ident.support.arrays import Array

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


def inertial_values(
    problem: Problem, selected: Selected, scale: float, *, unit: str, gains: KnownGains | None
) -> tuple[tuple[Parameter, ...], Array]:
    """Return identifiable base parameters, and their covariance of shape (k, k).

    Args:
        problem: Motions with a bare flange.
        selected: The model, and its fit.
        scale: Factor of its parameters.
        unit: Suffix of each SI unit.
        gains: Fixed gains, None if only the scale of one is given.
    """
    names, arm, fit = problem.structure.base.names, shared_parameters(problem).arm.tolist(), selected.final.fit
    influence, belief = fit.theta_influence[: len(arm)], fit.theta_belief[: len(arm)]
    rivals = [_rival(each)[: len(arm)] for each in selected.rivals]
    C = _covariance(problem, fit.rows, influence, np.column_stack([belief[:, :0], *rivals]), belief, gains)
    std, felt = _std(C), np.flatnonzero(influence.any(axis=1))
    found = tuple(
        Parameter(
            name=names[arm[k]],
            unit=f"{unit_of(names[arm[k]], problem.structure.arm.revolute.tolist())}{' ' if unit else ''}{unit}",
            value=float(fit.found.theta[k] * scale),
            std=float(std[k] * abs(scale)),
        )
        for k in felt
    )
    return found, C[np.ix_(felt, felt)] * scale**2


def _covariance(
    problem: Problem, rows: Rows, influence: Array, rivals: Array, belief: Array, gains: KnownGains | None
) -> Array:
    """Return the covariance of parameters, shape (p, p): from residuals, alternative models, priors and fixed gains.

    Args:
        problem: The problem with its options.
        rows: Rows of the fit.
        influence: Influence of the rows on the parameters, shape (p, r).
        rivals: Change of the parameters with each alternative model, shape (p, rivals).
        belief: Change of the parameters per standard deviation of each prior, shape (p, beliefs).
        gains: Fixed gains, None if only the scale of one is given.
    """
    options = problem.options
    model = np.hstack((belief if gains is None else own_beliefs(belief, gains), rivals))
    C = UNCERTAINTIES[options.uncertainty](rows, influence) + model @ model.T
    if gains is not None:
        C = C + gain_covariance(belief, gains)
    return C


def _std(C: Array) -> Array:
    """Return standard deviations; negative variances due to rounding are 0."""
    return np.sqrt(np.maximum(np.diag(C), 0.0))


def _rival(each: AlternativeModel) -> Array:
    """Return the change of shared parameters in an alternative model, in the same order, compliance last."""
    one, other = each.final.fit.found.theta, each.other.fit.found.theta
    size = min(len(one), len(other))
    return each.share * (other[:size] - one[:size])


def friction_values(
    problem: Problem, selected: Selected, gains: KnownGains | None
) -> tuple[tuple[Parameter, ...], ...]:
    """Return each joint's own parameters [drive units], numbered by motion; arguments as in `inertial_values`."""
    final = selected.final
    found: list[tuple[Parameter, ...]] = []
    for joint, (own, phi, influence, belief) in enumerate(
        zip(final.own, final.fit.phi, final.fit.phi_influence, final.fit.phi_belief, strict=True)
    ):
        rivals = np.column_stack([belief[:, :0], *(_rival_friction(each, joint, final) for each in selected.rivals)])
        std = _std(_covariance(problem, final.fit.rows, influence, rivals, belief, gains))
        found.append(
            tuple(
                Parameter(
                    name=name if motion < 0 or len(problem.motions) == 1 else f"{name} in motion {motion + 1}",
                    unit=_friction_unit(name, turns=bool(problem.structure.arm.revolute[joint])),
                    value=float(phi[k]),
                    std=float(std[k]),
                )
                for k, (name, motion) in enumerate(zip(own.names, own.motion, strict=True))
            )
        )
    return tuple(found)


def _rival_friction(each: AlternativeModel, joint: int, final: Fitted) -> Array:
    """Return the change of a joint's own parameters in an alternative model, by name.

    Zero for parameters of only one model: the forms of load-dependent friction have different parameters, and rigid and
    elastic joints are compared without load-dependent friction.
    """
    one, other = (
        dict(zip(zip(fit.own[joint].names, fit.own[joint].motion, strict=True), fit.fit.phi[joint], strict=True))
        for fit in (each.final, each.other)
    )
    keys = zip(final.own[joint].names, final.own[joint].motion, strict=True)
    return np.array([each.share * (other[key] - one[key]) if key in one and key in other else 0.0 for key in keys])


def _friction_unit(name: str, *, turns: bool) -> str:
    if name.startswith("load") or name.endswith("-share"):
        return "1"
    unit = FRICTION_UNITS.get(name, "")
    return f"units {unit if turns else unit.replace('rad', 'm')}".rstrip()
