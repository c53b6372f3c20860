"""A made-up linear solution with beliefs: what tests compute of it can be computed again."""

import numpy as np

from ident.estimation.estimate import GainEstimate, GainSolution, IdentifiedGain
from ident.estimation.intervals import Rows
from ident.estimation.problem import GainOptions


def linear_solution(rng: np.random.Generator):
    """Two joints of 2 motions with 30 rows each, 7 unknowns, beliefs about all; currents, and fits of some rows."""
    r, u = 120, 7
    W, belief, of = rng.normal(size=(r, u)), 2.3 * rng.normal(size=(u, u)), rng.normal(size=(2, u))
    weight = np.repeat([0.7, 3.1], r // 2)
    y, expected = rng.normal(size=r), rng.normal(size=u)
    stacked = np.vstack((weight[:, None] * W, belief))
    pseudo = np.linalg.pinv(stacked)
    z = pseudo @ np.concatenate((weight * y, expected))
    solution = GainSolution(
        rows=Rows(
            V=y,
            residual=y - W @ z,
            joint=np.repeat([0, 1], r // 2),
            motion=np.tile(np.repeat([0, 1], r // 4), 2),
            position=np.tile(np.arange(r // 4), 4) + 3,
            row_period=0.05,
            unknowns={0: 3.0, 1: 4.0},
            weight=weight,
            explained=np.linalg.qr(stacked)[0][:r],
        ),
        joints=np.array([0, 1]),
        inverse=of @ z,
        influence=(of @ pseudo[:, :r]) * weight,
        payload=np.zeros((2, 0)),
        model=np.zeros((2, 0)),
        load_rms=np.ones(2),
        friction=np.zeros((2, 2)),
        friction_influence=np.zeros((2, 2, r)),
        unsolved={},
    )

    def refit(kept: np.ndarray, currents: np.ndarray = y) -> np.ndarray:
        some = np.vstack(((weight[:, None] * W)[kept], belief))
        return of @ np.linalg.lstsq(some, np.concatenate(((weight * currents)[kept], expected)), rcond=None)[0]

    def left_of(kept: np.ndarray, more: np.ndarray | None = None) -> np.ndarray:
        """What a fit of some rows leaves of all, beside more columns of which nothing is believed."""
        more = np.zeros((r, 0)) if more is None else more
        X = np.column_stack((W, more))
        some = np.vstack(((weight[:, None] * X)[kept], np.pad(belief, ((0, 0), (0, more.shape[1])))))
        return y - X @ np.linalg.lstsq(some, np.concatenate(((weight * y)[kept], expected)), rcond=None)[0]

    return solution, y, left_of, refit


def linear_estimate(solution: GainSolution, *, rel_std: float) -> GainEstimate:
    """An estimate of a solution of two joints, whose gains have one relative deviation."""
    gains = tuple(
        IdentifiedGain(
            joint=f"joint{j + 1}",
            value=float(1.0 / solution.inverse[j]),
            residual_std=rel_std / abs(float(solution.inverse[j])),
            payload_rel_std=0.0,
            model_rel_std=0.0,
            predicted_rel_std=0.7 * rel_std,
        )
        for j in range(2)
    )
    return GainEstimate(
        method="made-up",
        joints=gains,
        solution=solution,
        covariance=np.diag((rel_std * solution.inverse) ** 2),
        options=GainOptions(),
    )
