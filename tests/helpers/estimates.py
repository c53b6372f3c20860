"""Estimates as a method would give them, for whoever only reads them."""

import numpy as np

from ident.estimation.estimate import GainEstimate, GainSolution, IdentifiedGain, RefusedGain
from ident.estimation.intervals import Basis, Rows
from ident.estimation.problem import GainOptions


def solution_of(
    rows: Rows, joints: np.ndarray, inverse: np.ndarray, influence: np.ndarray, unsolved: dict[int, str] | None = None
) -> GainSolution:
    """A solution of which nothing else is asked."""
    k, r = influence.shape
    return GainSolution(
        rows=rows, joints=joints, inverse=inverse, influence=influence, payload=np.zeros((k, 0)),
        model=np.zeros((k, 0)), load_rms=np.full(k, 3.0), friction=np.full((k, 2), 2.0),
        friction_influence=np.zeros((k, 2, r)), unsolved=unsolved or {},
    )  # fmt: skip


def gain_of(joint: str, value: float, std: float, *, payload: float = 0.02, model: float = 0.03) -> IdentifiedGain:
    """A gain whose predicted deviation is that of its residual."""
    return IdentifiedGain(
        joint=joint, value=value, residual_std=std, payload_rel_std=payload, model_rel_std=model,
        predicted_rel_std=std / abs(value),
    )  # fmt: skip


def estimate_of(solution: GainSolution, *joints: IdentifiedGain | RefusedGain) -> GainEstimate:
    k = len(solution.joints)
    return GainEstimate(method="ls-2011", joints=joints, solution=solution, covariance=np.eye(k), options=GainOptions())


def gain_estimate(*gains: float | None, std: float, reason: str) -> GainEstimate:
    """Gains with one standard deviation; None for a joint refused for `reason`."""
    joints = (
        RefusedGain(joint=f"j{k}", reason=reason, predicted_rel_std=None)
        if gain is None
        else gain_of(f"j{k}", gain, std)
        for k, gain in enumerate(gains, 1)
    )
    solved = np.array([j for j, gain in enumerate(gains) if gain is not None])
    k = len(solved)
    rows = Rows(
        V=np.full(3 * k, 2.0), residual=np.full(3 * k, 0.1), joint=np.repeat(solved, 3),
        motion=np.zeros(3 * k, dtype=np.intp), position=np.tile(np.arange(3), k),
        unknowns={int(j): 1 for j in solved}, weight=np.ones(3 * k), explained=Basis.of(np.zeros((3 * k, 0))),
    )  # fmt: skip
    inverse = np.array([1.0 / gain for gain in gains if gain is not None])
    unsolved = {j: reason for j, gain in enumerate(gains) if gain is None}
    return estimate_of(solution_of(rows, solved, inverse, np.zeros((k, 3 * k)), unsolved), *joints)
