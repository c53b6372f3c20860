"""Drive gains of all joints by ordinary least squares of the homogeneous form: a baseline with a known bias.

The torque of the known payload is regressed on the currents, whose noise makes every gain too small (by 0.3 to 0.7 % in
scenario `nominal`, by 8 to 14 % in `paper-noise`). This bias is computed in closed form and reported with the gains,
but not included in their intervals.
"""

from dataclasses import replace

import numpy as np
from scipy import linalg

from ident.estimation.all_joints.reduction import own_sigma
from ident.estimation.estimate import GainEstimate, IdentifiedGain
from ident.estimation.homogeneous import (
    HomogeneousOptions,
    HomogeneousSystem,
    Unknowns,
    gain_solution,
    homogeneous_system,
)
from ident.estimation.identifiability import judge_identifiability
from ident.estimation.problem import Problem
from ident.numerics.least_squares import factors

NAME = "ols"
FREE = 1e-6
"""Largest component of a gain's unit vector in the null space of the rows, beyond which the gain is not determined."""


def homogeneous_gains(problem: Problem, options: HomogeneousOptions) -> GainEstimate:
    """Estimate the gains of all joints by ordinary least squares of the homogeneous form.

    Args:
        problem: Motions, bare and loaded; all known parameters of a payload are used.
        options: Weights of rows.

    Returns:
        A gain or a reason for each joint; the remarks give the bias from current noise.

    Raises:
        NotIdentifiable: If no motion is bare, none is loaded, or no known torque sets the scale.
        TooFewRows: If there are no more rows than unknowns.
    """
    system = homogeneous_system(problem, options.weights)
    found = _solved(system)
    estimate = judge_identifiability(NAME, problem, gain_solution(system, found))
    return replace(estimate, remarks=_remarks(estimate, noise_bias(system, found)))


def _solved(system: HomogeneousSystem) -> Unknowns:
    """Least squares, with the minimum norm in scaled columns."""
    norms = np.linalg.norm(system.H, axis=0)
    scale = np.where(norms > 0.0, norms, 1.0)
    Q, R = linalg.qr(system.H / scale, mode="economic", check_finite=False)
    U, s, Vt = np.linalg.svd(R)
    shown = s > system.problem.options.rank_tol * s[0]
    explained = np.asarray(Q @ U[:, shown], np.float64)
    spread = Vt[shown].T / s[shown] / scale[:, None]
    pseudo = spread @ explained.T  # (u, r)
    x = pseudo @ system.k
    left = system.k - system.H @ x
    own = np.arange(system.n)
    by_current = -pseudo * (system.weight * x[system.joint])
    by_current += (spread @ spread[own].T)[:, system.joint] * (system.weight * left)  # the currents are columns too
    return Unknowns(
        x=x,
        by_current=by_current,
        by_load=pseudo * system.weight,
        explained=explained,
        seen=np.linalg.norm(Vt[~shown][:, own], axis=0) <= FREE,
    )


def _remarks(estimate: GainEstimate, bias: dict[int, float] | None) -> tuple[str, ...]:
    if bias is None:
        return ("the currents do not exceed their noise, so the bias of the gains is unknown",)
    return tuple(
        f"joint {j + 1}: noise of the currents makes this gain {100.0 * abs(each):.2g} % "
        f"too {'small' if each < 0.0 else 'large'}"
        for j, each in bias.items()
        if isinstance(estimate.joints[j], IdentifiedGain)
    )


def noise_bias(system: HomogeneousSystem, found: Unknowns) -> dict[int, float] | None:
    """Relative bias of each gain from current noise, by joint from 0.

    With I the block diagonal matrix of the currents and P the projection onto all other columns, the gains solve S g =
    I^T (1 - P) k, S = I^T (1 - P) I. White noise of standard deviation sigma_j adds to S, on average, N =
    diag(sigma_j^2 sum over the rows of j of (1 - P)_ii), and nothing to the right-hand side: E g = (S_0 + N)^-1 S_0
    g_0.

    Args:
        system: The equations; sigma_j is the residual of each joint's own least squares.
        found: Their solution by ordinary least squares.

    Returns:
        None if, given the arm's parameters, the currents do not exceed such noise.
    """
    solved = np.flatnonzero(found.seen)
    currents, others, gain = system.H[:, solved], system.H[:, system.n :], found.x[solved]
    Q = factors(others, rank_tol=system.problem.options.rank_tol).Q
    apart = currents - Q @ (Q.T @ currents)
    S = apart.T @ apart
    sigma = np.array([own_sigma(each, own) for each, own in zip(system.columns, system.own, strict=True)])
    left = system.weight**2 * (1.0 - np.sum(Q**2, axis=1))
    N = np.diag((sigma**2 * np.bincount(system.joint, weights=left))[solved])
    scale = 1.0 / np.sqrt(np.diag(S))  # scaled to unit diagonal, so that units of currents do not matter
    clean = scale[:, None] * (S - N) * scale
    if np.linalg.eigvalsh(clean)[0] <= 0.0:
        return None
    without = scale * np.linalg.solve(clean, scale * (S @ gain))
    return dict(zip(solved.tolist(), (gain / without - 1.0).tolist(), strict=True))
