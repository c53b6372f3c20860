"""Estimates as a method would give them, for whoever only reads them."""

import numpy as np

from ident.estimation.estimate import GainEstimate, GainSolution, IdentifiedGain, RefusedGain
from ident.estimation.intervals import Rows
from ident.estimation.problem import GainOptions


def gain_estimate(*gains: float | None, std: float, reason: str) -> GainEstimate:
    """Gains with one standard deviation; None for a joint refused for `reason`."""
    joints = tuple(
        RefusedGain(joint=f"j{k}", reason=reason, predicted_rel_std=None)
        if gain is None
        else IdentifiedGain(
            joint=f"j{k}",
            value=gain,
            residual_std=std,
            payload_rel_std=0.02,
            model_rel_std=0.03,
            predicted_rel_std=std / abs(gain),
        )
        for k, gain in enumerate(gains, 1)
    )
    solved = np.array([j for j, gain in enumerate(gains) if gain is not None])
    k = len(solved)
    numbers = np.repeat(solved, 3)
    rows = Rows(
        V=np.full(3 * k, 2.0),
        residual=np.full(3 * k, 0.1),
        joint=numbers,
        motion=np.zeros(3 * k, dtype=np.intp),
        position=np.tile(np.arange(3), k),
        row_period=0.05,
        unknowns={int(j): 1 for j in solved},
        weight=np.ones(3 * k),
        explained=np.zeros((3 * k, 0)),
    )
    solution = GainSolution(
        rows=rows,
        joints=solved,
        inverse=np.array([1.0 / gain for gain in gains if gain is not None]),
        influence=np.zeros((k, 3 * k)),
        payload=np.zeros((k, 0)),
        model=np.zeros((k, 0)),
        load_rms=np.full(k, 3.0),
        friction=np.full((k, 2), 2.0),
        friction_influence=np.zeros((k, 2, 3 * k)),
        unsolved={j: reason for j, gain in enumerate(gains) if gain is None},
    )
    return GainEstimate(method="ls-2011", joints=joints, solution=solution, covariance=np.eye(k), options=GainOptions())
