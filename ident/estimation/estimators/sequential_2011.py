"""Drive gains in sequence, from the payload's mass alone (paper, section III.B).

    1. the gains of the joints that the mass loads (eq. 27 with M known),
    2. with them, the payload's first moments from those joints (eq. 25),
    3. with the moments, the gains of the other joints (eq. 27 with M, MX, MY, MZ known).

The paper warns that errors accumulate. Here they are propagated: to first order every result is linear in the noise of
the currents, so that the influence of a row on a later gain includes its influence through the moments
(`docs/derivations.md`). Covariance and refusals follow from the influence as for any other method.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.estimation.estimate import FoundParameter, GainEstimate, GainSolution, IdentifiedGain, judge_identifiability
from ident.estimation.intervals import UNCERTAINTIES
from ident.estimation.joint_by_joint import JointFit, NoFit, joint_by_joint, joint_fit
from ident.estimation.problem import Problem
from ident.estimation.rows import Columns
from ident.model.parameters import INERTIAL
from ident.model.structure import PROBE_SEED, Structure, independent_columns, random_regressor
from ident.numerics.least_squares import least_squares, row_weights
from ident.payload.payload import KnownPayload
from ident.support.arrays import Array, Indices
from ident.support.errors import NotIdentifiable

NAME = "sequential-2011"
MOMENTS = ("MX", "MY", "MZ")
MOMENT_COLUMNS: Indices = np.array([INERTIAL.index(name) for name in MOMENTS])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FirstMoments:
    """First moments of the payload, estimated with identified gains.

    Attributes:
        value: MX, MY, MZ at the origin of the last frame [kg m], 0 if not identifiable, shape (3,).
        seen: Names of the identifiable ones.
        influence: Derivative by the current of each row, directly and through the gains, shape (3, r).
        joints: Joints of those rows, from 0, in ascending order.
        mass: The mass that they are based on [kg].
    """

    value: Array
    seen: tuple[str, ...]
    influence: Array
    joints: tuple[int, ...]
    mass: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SequentialOptions:
    """The method of section III.B has no options of its own."""


def sequential_gains(problem: Problem, options: SequentialOptions) -> GainEstimate:
    """Estimate drive gains in sequence; only the payload's mass is used (paper, section III.B).

    Args:
        problem: Motions, one payload; only its mass and mass_std are used.
        options: None yet.

    Returns:
        A gain or a reason for each joint, and the identifiable first moments.

    Raises:
        NotIdentifiable: If no motion is bare, none is loaded, or there are several payloads.
    """
    problem.check_difference()
    payload, *more = problem.payloads
    if more:
        raise NotIdentifiable(f"{NAME} accepts one payload; {1 + len(more)} are mounted")
    mass = replace(payload, known="mass").known_part()
    fits = [joint_fit(problem, joint, [mass]) for joint in range(problem.structure.arm.n)]
    first = judge_identifiability(NAME, problem, joint_by_joint(problem, fits, [mass]))
    found = [
        fit
        for fit, joint in zip(fits, first.joints, strict=True)
        if isinstance(fit, JointFit) and isinstance(joint, IdentifiedGain)
    ]
    if not found:
        return first
    moments = first_moments(problem, found, mass)
    known = _with_moments(mass, moments)
    both = [fit if j in moments.joints else joint_fit(problem, j, [known]) for j, fit in enumerate(fits)]
    solution = _carried(joint_by_joint(problem, both, [known]), both, moments, problem.payloads[0].mass_std)
    return judge_identifiability(NAME, problem, solution, payload=_parameters(problem, moments, solution))


def _with_moments(mass: KnownPayload, moments: FirstMoments) -> KnownPayload:
    """Return mass and first moments as known parameters."""
    chi = mass.chi.copy()
    chi[MOMENT_COLUMNS] = moments.value
    return KnownPayload(names=("M", *MOMENTS), chi=chi, spread=np.zeros((10, 1)))


def _carried(
    solution: GainSolution, fits: Sequence[JointFit | NoFit], moments: FirstMoments, mass_std: float
) -> GainSolution:
    """Return the solution with errors of the moments and the mass propagated to every gain.

    An error d of the payload's parameters changes the solution x by -1/g (W^+ W_L d); the moments depend on the
    currents.
    """
    influence, friction = solution.influence.copy(), solution.friction_influence.copy()
    through = _on_all_rows(moments, solution)
    later = [fit for fit in fits if isinstance(fit, JointFit)]
    for k, each in enumerate(later):
        if each.system.joint not in moments.joints:
            own = solution.rows.of(each.system.joint)
            W_L = each.system.rows.W_L[0][:, MOMENT_COLUMNS]
            influence[k] -= each.inverse * (influence[k, own] @ W_L) @ through
            friction[k] -= each.inverse * (friction[k][:, own] @ W_L) @ through
    mass = np.full((len(solution.joints), 1), mass_std / moments.mass)  # moments and gains are proportional to it
    return replace(solution, influence=influence, friction_influence=friction, payload=mass)


def _parameters(problem: Problem, moments: FirstMoments, solution: GainSolution) -> tuple[FoundParameter, ...]:
    """The identifiable moments, with standard deviations from residuals and mass."""
    options, rows = problem.options, solution.rows
    through = _on_all_rows(moments, solution)
    std = np.sqrt(np.diag(UNCERTAINTIES[options.uncertainty](rows, through)))
    weighed = np.abs(moments.value) * problem.payloads[0].mass_std / moments.mass
    return tuple(
        FoundParameter(name=name, value=float(moments.value[k]), std=float(np.hypot(std[k], weighed[k])))
        for k, name in enumerate(MOMENTS)
        if name in moments.seen
    )


def _on_all_rows(moments: FirstMoments, solution: GainSolution) -> Array:
    """Derivative of the moments by the current of each row of the solution, shape (3, r)."""
    through = np.zeros((len(MOMENTS), len(solution.rows.V)))
    through[:, np.isin(solution.rows.joint, moments.joints)] = moments.influence
    return through


def first_moments(problem: Problem, found: Sequence[JointFit], mass: KnownPayload) -> FirstMoments:
    """Estimate the payload's first moments from the joints whose gains are known (paper, eq. 25).

    Args:
        problem: Motions, one payload.
        found: Solutions of the joints whose gains the mass gives, in the order of the joints.
        mass: The mass, known.
    """
    joints = [fit.system.joint for fit in found]
    system = Columns.of(problem.motions, joints)
    gain = np.array([1.0 / fit.inverse for fit in found])
    each_gain = gain[np.searchsorted(joints, system.joint)]
    arm, body = _independent(problem.structure, joints, mass)
    W = np.hstack((system.W[:, arm], system.W_L[0][:, body]))
    Y = each_gain * system.V - system.W_L[0][:, mass.mask] @ mass.chi[mass.mask]
    weight = row_weights(W, Y, system.joint)
    fit = least_squares(W * weight[:, None], Y * weight, rank_tol=problem.options.rank_tol)
    at = {int(column): len(arm) + k for k, column in enumerate(body)}
    seen = [k for k, column in enumerate(MOMENT_COLUMNS) if int(column) in at]
    chosen = [at[int(MOMENT_COLUMNS[k])] for k in seen]
    P = fit.cofactor[chosen] @ (W * weight[:, None] ** 2).T  # moments = P @ Y, shape (seen, r)
    value, influence = np.zeros(len(MOMENTS)), np.zeros((len(MOMENTS), len(Y)))
    value[seen], influence[seen] = fit.x[chosen], P * each_gain
    for g, own in zip(gain, found, strict=True):  # dg = -g^2 d(1/g) also changes the left side
        rows = system.joint == own.system.joint
        influence[np.ix_(seen, rows)] -= g**2 * np.outer(P[:, rows] @ system.V[rows], own.influence)
    return FirstMoments(
        value=value,
        seen=tuple(MOMENTS[k] for k in seen),
        influence=influence,
        joints=tuple(joints),
        mass=float(mass.chi[INERTIAL.index("M")]),
    )


def _independent(structure: Structure, joints: Sequence[int], mass: KnownPayload) -> tuple[Indices, Indices]:
    """Base columns and payload columns that are independent on the rows of some joints."""
    W = random_regressor(structure.arm, np.random.default_rng(PROBE_SEED))
    rows = np.vstack([W[:, j, structure.base.columns] for j in joints])
    probes = np.vstack([structure.payload_probes[j] for j in joints])
    arm = np.sort(independent_columns(rows, [np.arange(rows.shape[1])]))
    rest = np.array([k for k in range(10) if not mass.mask[k] and k not in MOMENT_COLUMNS])
    return arm, np.sort(independent_columns(probes, [MOMENT_COLUMNS, rest]))
