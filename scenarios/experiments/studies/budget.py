"""The error budget of a sensitivity study: what each source costs alone, and its share of the variance among all."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy import stats

from ident.support.arrays import Array
from scenarios.experiments.studies.sensitivity import ALL, ALONE, NONE, SOBOL

NEEDED = ("trial", "joint", "design", "source", "sample", "rel_error")
"""Columns of a sensitivity study that its budget needs."""
TAILS = (2.5, 97.5)
"""Percentiles of the bootstrap that its intervals end at."""
RESAMPLES = 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval:
    """A value and its 95 % bootstrap interval.

    Attributes:
        value: A share of the gain, or of its error's variance.
        low, high: Ends of the interval, shares as the value is.
    """

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceCost:
    """What one error source costs one joint.

    Attributes:
        joint: Joint number, from 1.
        source: Its name.
        trials: Trials of the source alone that gave a gain.
        bias: Mean relative error it makes alone, that of the method with every source off included.
        rms: Root mean square of the relative error it makes alone.
        share: The source's share of the sum of all sources' mean squares.
        first, total: Sobol indices: share of the error's variance that goes if the source is known, and that stays if
            all others are; None if the design has too few complete samples.
    """

    joint: int
    source: str
    trials: int
    bias: float
    rms: Interval
    share: float
    first: Interval | None
    total: Interval | None


@dataclass(frozen=True, slots=True, kw_only=True)
class JointBudget:
    """The error budget of one joint.

    Attributes:
        joint: Joint number, from 1.
        costs: One a source, the largest first.
        floor: Relative error with every source off; None if the joint was refused.
        together: Root mean square of the relative error with all sources on.
        samples: Complete rows of the Sobol design that the indices come from.
        lost: Trials that gave no gain for the joint.
    """

    joint: int
    costs: tuple[SourceCost, ...]
    floor: float | None
    together: float
    samples: int
    lost: int

    @property
    def summed(self) -> float:
        """What `together` would be if the errors of independent sources added up: variances, and biases by sign."""
        floor = self.floor or 0.0
        bias = floor + sum(cost.bias - floor for cost in self.costs)
        variance = sum(cost.rms.value**2 - cost.bias**2 for cost in self.costs)
        return float(np.sqrt(variance + bias**2))


def budgets(rows: pd.DataFrame, sources: Sequence[str], joints: Sequence[int], seed: int) -> tuple[JointBudget, ...]:
    """Sum up a sensitivity study.

    Args:
        rows: A row a trial and joint, with `NEEDED`.
        sources: Names, in the order of the design.
        joints: Numbers of the joints that should have a gain.
        seed: Of the bootstrap.
    """
    return tuple(_joint_budget(rows.query("joint == @joint"), joint, sources, seed) for joint in joints)


def sobol_indices(A: Array, B: Array, AB: Array, seed: int) -> tuple[list[Interval], list[Interval]]:
    """First and total order indices of one output.

    Args:
        A: The output on matrix A, shape (n,), n a power of 2.
        B: On matrix B, shape (n,).
        AB: On A with the columns of source k from B, shape (d, n).
        seed: Of the bootstrap.
    """
    picks = np.random.default_rng(seed).integers(len(A), size=(RESAMPLES, len(A)))
    found = _sobol(A, B, AB)  # (2, d)
    low, high = np.percentile([_sobol(A[k], B[k], AB[:, k]) for k in picks], TAILS, axis=0)
    first, total = (
        [Interval(value=float(v), low=float(x), high=float(y)) for v, x, y in zip(*order, strict=True)]
        for order in zip(found, low, high, strict=True)
    )
    return first, total


def _sobol(A: Array, B: Array, AB: Array) -> Array:
    """First and total order indices, shape (2, d)."""
    found = stats.sobol_indices(func={"f_A": A[None], "f_B": B[None], "f_AB": AB[:, None]}, n=len(A))
    return np.array([found.first_order.ravel(), found.total_order.ravel()])


def _joint_budget(rows: pd.DataFrame, joint: int, sources: Sequence[str], seed: int) -> JointBudget:
    alone = {name: group["rel_error"].dropna().to_numpy() for name, group in _of(rows, ALONE).groupby("source")}
    squares = {name: float(np.mean(alone[name] ** 2)) for name in sources if len(alone.get(name, ())) > 0}
    indices, samples = _indices(_of(rows, SOBOL), sources, seed)
    costs = [
        SourceCost(
            joint=joint,
            source=name,
            trials=len(alone[name]),
            bias=float(np.mean(alone[name])),
            rms=_rms(alone[name], seed),
            share=square / max(sum(squares.values()), 1e-300),
            first=None if indices is None else indices[0][sources.index(name)],
            total=None if indices is None else indices[1][sources.index(name)],
        )
        for name, square in squares.items()
    ]
    floor, together = alone.get(NONE, np.empty(0)), alone.get(ALL, np.empty(0))
    return JointBudget(
        joint=joint,
        costs=tuple(sorted(costs, key=lambda cost: -cost.rms.value)),
        floor=float(floor[0]) if len(floor) else None,
        together=float(np.sqrt(np.mean(together**2))) if len(together) else float("nan"),
        samples=samples,
        lost=int(np.count_nonzero(rows["rel_error"].isna())),
    )


def _of(rows: pd.DataFrame, design: str) -> pd.DataFrame:
    return rows.query("design == @design")


def _indices(
    rows: pd.DataFrame, sources: Sequence[str], seed: int
) -> tuple[tuple[list[Interval], list[Interval]] | None, int]:
    """Sobol indices from the rows of the design that are complete, and how many that are.

    The estimator wants a power of 2: after a loss, the largest one that is left.
    """
    table = rows.assign(sample=rows["sample"].astype(int)).pivot_table(
        index="sample", columns="source", values="rel_error", dropna=False
    )
    wanted = ["A", "B", *sources]
    if not set(wanted) <= set(table.columns):
        return None, 0
    whole = table[wanted].dropna().to_numpy()
    n = 2 ** int(np.log2(len(whole))) if len(whole) else 0
    if n < 4:
        return None, n
    A, B, AB = whole[:n, 0], whole[:n, 1], whole[:n, 2:].T
    return sobol_indices(A, B, AB, seed), n


def _rms(error: Array, seed: int) -> Interval:
    value = float(np.sqrt(np.mean(error**2)))
    if len(error) < 2 or np.ptp(error) == 0.0:
        return Interval(value=value, low=value, high=value)
    picks = np.random.default_rng(seed).integers(len(error), size=(RESAMPLES, len(error)))
    resampled = np.sqrt(np.mean(error[picks] ** 2, axis=1))
    low, high = np.percentile(resampled, TAILS)
    return Interval(value=value, low=float(low), high=float(high))
