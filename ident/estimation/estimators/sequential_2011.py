"""Drive gains in sequence, from the payload's mass alone (paper, section III.B).

    1. the gains of the joints that the mass loads (eq. 27 with M known),
    2. with them, the payload's first moments from those joints (eq. 25),
    3. with the moments, the gains of the other joints (eq. 27 with M, MX, MY, MZ known).

The paper warns that errors accumulate. Here they are propagated: to first order every result is linear in the noise of
the currents, so that the influence of a row on a later gain includes its influence through the moments
(`docs/derivations.md`). Covariance and refusals follow from the influence as for any other method.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ident.estimation.estimate import FoundParameter, GainEstimate, judge_identifiability
from ident.estimation.intervals import UNCERTAINTIES
from ident.estimation.joint_by_joint import JointFit, joint_by_joint, joint_fit
from ident.estimation.problem import Columns, NoOptions, Problem
from ident.model.parameters import INERTIAL
from ident.model.structure import PROBE_SEED, independent_columns, random_regressor
from ident.numerics.least_squares import least_squares, row_weights
from ident.payload.payload import KnownPayload
from ident.support.arrays import Array, Indices, Mask
from ident.support.errors import NotIdentifiable

NAME = "sequential-2011"
MOMENTS = ("MX", "MY", "MZ")
MOMENT_COLUMNS: Indices = np.array([INERTIAL.index(name) for name in MOMENTS])


def sequential_gains(problem: Problem, _: NoOptions | None = None) -> GainEstimate:
    """Estimate drive gains in sequence (paper, section III.B); of the payload, only mass and mass_std are used."""
    problem.check_difference()
    payload, *more = problem.payloads
    if more:
        raise NotIdentifiable(f"{NAME} accepts one payload; {1 + len(more)} are mounted")
    mass = replace(payload, known="mass").known_part()
    fits = [joint_fit(problem, joint, [mass]) for joint in range(problem.structure.arm.n)]
    first = judge_identifiability(NAME, problem, joint_by_joint(problem, fits, [mass]))
    found = [fit for fit in fits if isinstance(fit, JointFit) and first.identifiable[fit.system.joint]]
    if not found:
        return first
    joints = [fit.system.joint for fit in found]
    value, seen, by_current = first_moments(problem, found, mass)
    chi = mass.chi.copy()
    chi[MOMENT_COLUMNS] = value
    known = KnownPayload(names=("M", *MOMENTS), chi=chi, spread=np.zeros((10, 1)))
    both = [fit if j in joints else joint_fit(problem, j, [known]) for j, fit in enumerate(fits)]
    solution = joint_by_joint(problem, both, [known])
    rows, influence, friction = solution.rows, solution.influence.copy(), solution.friction_influence.copy()
    through = np.zeros((len(MOMENTS), len(rows.V)))
    through[:, np.isin(rows.joint, joints)] = by_current
    for k, each in enumerate(fit for fit in both if isinstance(fit, JointFit)):
        if each.system.joint not in joints:  # an error d of the moments changes the solution by -1/g W^+ W_L d
            own, W_L = rows.of(each.system.joint), each.system.rows.W_L[0][:, MOMENT_COLUMNS]
            influence[k] -= each.inverse * (influence[k, own] @ W_L) @ through
            friction[k] -= each.inverse * (friction[k][:, own] @ W_L) @ through
    weighed = payload.mass_std / payload.mass  # moments and gains are proportional to the mass
    of_mass = np.full((len(solution.joints), 1), weighed)
    solution = replace(solution, influence=influence, friction_influence=friction, payload=of_mass)
    residual = np.sqrt(np.diag(UNCERTAINTIES[problem.options.uncertainty](rows, through)))
    std = np.hypot(residual, value * weighed)
    moments = [FoundParameter(name=MOMENTS[k], value=float(value[k]), std=float(std[k])) for k in np.flatnonzero(seen)]
    return judge_identifiability(NAME, problem, solution, payload=tuple(moments))


def first_moments(problem: Problem, found: Sequence[JointFit], mass: KnownPayload) -> tuple[Array, Mask, Array]:
    """Estimate the payload's first moments from the joints whose gains the mass gives (paper, eq. 25).

    Returns MX, MY, MZ at the origin of the last frame [kg m], 0 if not identifiable, shape (3,); whether each is; and
    the derivative by the current of each row of those joints, directly and through the gains, shape (3, r).
    """
    joints = [fit.system.joint for fit in found]
    system = Columns.of(problem.motions, joints)
    gain = np.array([1.0 / fit.inverse for fit in found])
    each_gain = gain[np.searchsorted(joints, system.joint)]
    structure = problem.structure
    probes = random_regressor(structure.arm, np.random.default_rng(PROBE_SEED))[..., structure.base.columns]
    arm = np.sort(independent_columns(np.vstack([probes[:, j] for j in joints]), [np.arange(probes.shape[2])]))
    rest = np.array([k for k in range(10) if not mass.mask[k] and k not in MOMENT_COLUMNS])
    of_payload = np.vstack([structure.payload_probes[j] for j in joints])
    body = np.sort(independent_columns(of_payload, [MOMENT_COLUMNS, rest]))
    W = np.hstack((system.W[:, arm], system.W_L[0][:, body]))
    Y = each_gain * system.V - system.W_L[0][:, mass.mask] @ mass.chi[mass.mask]
    weight = row_weights(W, Y, system.joint)
    fit = least_squares(W * weight[:, None], Y * weight, rank_tol=problem.options.rank_tol)
    seen = np.isin(MOMENT_COLUMNS, body)
    chosen = len(arm) + np.searchsorted(body, MOMENT_COLUMNS[seen])
    P = fit.cofactor[chosen] @ (W * weight[:, None] ** 2).T  # moments = P @ Y, shape (seen, r)
    value, influence = np.zeros(len(MOMENTS)), np.zeros((len(MOMENTS), len(Y)))
    value[seen], influence[seen] = fit.x[chosen], P * each_gain
    for g, own in zip(gain, found, strict=True):  # dg = -g^2 d(1/g) also changes the left side
        rows = system.joint == own.system.joint
        influence[np.ix_(np.flatnonzero(seen), rows)] -= g**2 * np.outer(P[:, rows] @ system.V[rows], own.influence)
    return value, seen, influence
