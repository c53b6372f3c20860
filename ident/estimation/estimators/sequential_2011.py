"""Drive gains in sequence, from the payload's mass alone (paper, section III.B).

    1. the gains of the joints that the mass loads (eq. 27 with M known),
    2. with them, the payload's first moments from those joints (eq. 25),
    3. with the moments, the gains of the other joints (eq. 27 with M, MX, MY, MZ known).

The paper warns that errors accumulate. Here they are carried along: every result is, to first order, linear in the
noise of the currents, so the influence of each row on a later gain has a part that comes through the moments
(`docs/derivations.md`), and covariance and refusal follow from the influence as for any other method.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.estimation.estimate import FoundParameter, GainEstimate, GainSolution, IdentifiedGain
from ident.estimation.identifiability import judge_identifiability
from ident.estimation.joint_by_joint.first_moments import MOMENT_COLUMNS, MOMENTS, FirstMoments, first_moments
from ident.estimation.joint_by_joint.joint_fit import JointFit, NoFit, joint_by_joint, joint_fit
from ident.estimation.problem import Problem
from ident.estimation.uncertainty import UNCERTAINTIES
from ident.payload.payload import KnownPayload
from ident.support.arrays import Array
from ident.support.errors import NotIdentifiable

NAME = "sequential-2011"


@dataclass(frozen=True, slots=True, kw_only=True)
class SequentialOptions:
    """The method of section III.B has no options of its own."""


def sequential_gains(problem: Problem, options: SequentialOptions) -> GainEstimate:
    """Estimate drive gains joint group by joint group; only the payload's mass is used (paper, section III.B).

    Args:
        problem: Motions, one payload; its mass and mass_std count, nothing else.
        options: None yet.

    Returns:
        A gain or a reason for each joint, and the first moments where some joint showed them.

    Raises:
        NotIdentifiable: If no motion is bare, none is loaded, or there are several payloads.
    """
    problem.check_difference()
    payload, *more = problem.payloads
    if more:
        raise NotIdentifiable(f"{NAME} takes one payload; {1 + len(more)} are mounted")
    mass = replace(payload, known="mass").known_part()
    fits = [joint_fit(problem, joint, [mass]) for joint in range(problem.structure.arm.n)]
    first = judge_identifiability(NAME, problem, joint_by_joint(fits, [mass], problem.row_period))
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
    solution = _carried(joint_by_joint(both, [known], problem.row_period), both, moments, problem.payloads[0].mass_std)
    return judge_identifiability(NAME, problem, solution, payload=_parameters(problem, moments, solution))


def _with_moments(mass: KnownPayload, moments: FirstMoments) -> KnownPayload:
    """Mass and first moments as known."""
    chi = mass.chi.copy()
    chi[MOMENT_COLUMNS] = moments.value
    return KnownPayload(names=("M", *MOMENTS), chi=chi, spread=np.zeros((10, 1)))


def _carried(
    solution: GainSolution, fits: Sequence[JointFit | NoFit], moments: FirstMoments, mass_std: float
) -> GainSolution:
    """The solution with what the errors of the moments do to the later joints, and with the mass behind every gain.

    A payload parameter off by d moves the solution x by -1/g (W^+ W_L d), and the moments move with the currents.
    """
    influence, friction = solution.influence.copy(), solution.friction_influence.copy()
    through = _on_all_rows(moments, solution)
    later = [fit for fit in fits if isinstance(fit, JointFit)]
    for k, each in enumerate(later):
        if each.system.rows.joint not in moments.joints:
            own = solution.rows.of(each.system.rows.joint)
            W_L = each.system.rows.W_L[0][:, MOMENT_COLUMNS]
            influence[k] -= each.inverse * (influence[k, own] @ W_L) @ through
            friction[k] -= each.inverse * (friction[k][:, own] @ W_L) @ through
    mass = np.full((len(solution.joints), 1), mass_std / moments.mass)  # the moments, and so every gain, scale with it
    return replace(solution, influence=influence, friction_influence=friction, payload=mass)


def _parameters(problem: Problem, moments: FirstMoments, solution: GainSolution) -> tuple[FoundParameter, ...]:
    """The moments that some joint showed, with deviations from residuals and from the mass together."""
    options, rows = problem.options, solution.rows
    through = _on_all_rows(moments, solution)
    std = np.sqrt(np.diag(UNCERTAINTIES[options.uncertainty](rows, through, options.serial_s)))
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
