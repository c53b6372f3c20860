"""From the unknowns of the homogeneous form to gains, with the influence of each row."""

from dataclasses import dataclass

import numpy as np

from ident.estimation.estimate import GainSolution
from ident.estimation.homogeneous.system import HomogeneousSystem
from ident.estimation.rows import Rows
from ident.support.arrays import Array, Mask

UNSEEN = "its rows do not determine the gain"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Unknowns:
    """A solution of the homogeneous equations.

    Attributes:
        x: Gains, shared parameters, own friction, shape (u,).
        by_current: Derivative of x by the current of each row, shape (u, r).
        by_load: Derivative of x by the known torque of each row [1/(N m)], shape (u, r).
        explained: Orthonormal columns that span what the unknowns explain, shape (r, e).
        seen: Which gains the equations determine, shape (n,).
    """

    x: Array
    by_current: Array
    by_load: Array
    explained: Array
    seen: Mask


def gain_solution(system: HomogeneousSystem, found: Unknowns) -> GainSolution:
    """Gains, residuals and influence in the form that every estimator hands over."""
    solved = np.flatnonzero(found.seen)
    kept = found.seen[system.joint]
    g = found.x[: system.n]
    h = 1.0 / g[solved]
    influence = -(h**2)[:, None] * found.by_current[solved]
    stated = np.hstack(
        [
            np.concatenate([each.payload[which] for each in system.columns]) @ spread
            for which, spread in enumerate(system.shared.spread)
        ]
    )
    loaded = np.concatenate([each.payload.any(axis=(0, 2)) for each in system.columns])
    known = system.k / system.weight
    friction, by_current = _friction(system, found)
    friction_influence = h[:, None, None] * by_current[solved] + friction[solved][:, :, None] * influence[:, None, :]
    return GainSolution(
        rows=_rows(system, found),
        joints=solved,
        inverse=h,
        influence=influence[:, kept],
        payload=h[:, None] * (found.by_load[solved] @ stated),
        model=np.zeros((len(solved), 0)),
        load_rms=np.array([np.sqrt(np.mean(known[loaded & (system.joint == j)] ** 2)) for j in solved]),
        friction=h[:, None] * friction[solved],
        friction_influence=friction_influence[:, :, kept],
        unsolved={j: UNSEEN for j in np.flatnonzero(~found.seen).tolist()},
    )


def _friction(system: HomogeneousSystem, found: Unknowns) -> tuple[Array, Array]:
    """Friction torque of each joint, total and dry, shape (n, 2), and its derivative by the currents, (n, 2, r)."""
    friction, by_current = np.zeros((system.n, 2)), np.zeros((system.n, 2, len(system.k)))
    for j, own in enumerate(system.own):
        for k, name in enumerate(own.names):
            if name in ("Fv", "Fc"):
                size, at = float(np.sqrt(np.mean(own.F[:, k] ** 2))), system.friction_at(j) + k
                for which in (0, 1) if name == "Fc" else (0,):
                    friction[j, which] += size * found.x[at]
                    by_current[j, which] += size * found.by_current[at]
    return friction, by_current


def _rows(system: HomogeneousSystem, found: Unknowns) -> Rows:
    """Rows of the joints that have a gain, in current units.

    A joint wired backwards has its residual's sign turned between torque and current, and so its rows of `explained`.
    """
    kept = found.seen[system.joint]
    gain = found.x[system.joint[kept]]
    left = system.H[kept] @ found.x - system.k[kept]
    share = np.sum(found.explained**2, axis=1)
    return Rows(
        V=np.concatenate([each.V for each in system.columns])[kept],
        residual=left / (system.weight[kept] * gain),
        joint=system.joint[kept],
        motion=np.concatenate([each.motion for each in system.columns])[kept],
        position=np.concatenate([each.position for each in system.columns])[kept],
        row_period=system.problem.row_period,
        unknowns={j: float(share[system.joint == j].sum()) for j in np.flatnonzero(found.seen).tolist()},
        weight=np.abs(gain) * system.weight[kept],
        explained=found.explained[kept] * np.sign(gain)[:, None],
    )
