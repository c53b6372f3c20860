"""Drive gains of all joints by ordinary least squares of the homogeneous form: a baseline that is known to be biased.

The torque of the known payload is regressed on the currents, whose noise makes every gain too small (by 0.3 to 0.7 %
in scenario `nominal`, by 8 to 14 % in `paper-noise`). How much stands beside the gains, in closed
form; it is no part of their intervals.
"""

from dataclasses import replace

import numpy as np
from scipy import linalg

from ident.estimation.estimate import GainEstimate, IdentifiedGain
from ident.estimation.homogeneous.bias import noise_bias
from ident.estimation.homogeneous.solved import Unknowns, gain_solution
from ident.estimation.homogeneous.system import HomogeneousSystem, homogeneous_system
from ident.estimation.homogeneous.weights import HomogeneousOptions
from ident.estimation.identifiability import judge_identifiability
from ident.estimation.problem import Problem

NAME = "ols"
FREE = 1e-6
"""Part of a gain's direction in combinations that the rows do not show, beyond which the gain is not determined."""


def homogeneous_gains(problem: Problem, options: HomogeneousOptions) -> GainEstimate:
    """Estimate the gains of all joints by ordinary least squares of the homogeneous form.

    Args:
        problem: Motions, bare and loaded; all that is known of a payload is used.
        options: Weights of rows.

    Returns:
        A gain or a reason for each joint, and in the remarks what the noise of the currents does to each.

    Raises:
        NotIdentifiable: If no motion is bare, none is loaded, or no known torque sets the scale.
        TooFewRows: If there are no more rows than unknowns.
    """
    system = homogeneous_system(problem, options.weights)
    found = _solved(system)
    estimate = judge_identifiability(NAME, problem, gain_solution(system, found))
    return replace(estimate, remarks=_remarks(estimate, noise_bias(system, found)))


def _solved(system: HomogeneousSystem) -> Unknowns:
    """Least squares; of combinations that the rows do not show, the shortest in unit columns."""
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
    by_current += (spread @ spread[own].T)[:, system.joint] * (system.weight * left)  # the columns move as well
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
