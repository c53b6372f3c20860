"""The error budget of a sensitivity study: the error from each source alone, and its share of the total variance."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy import stats

from ident.support.arrays import Array, Indices
from scenarios.experiments.schema import Scenario
from scenarios.experiments.sensitivity import ALL, ALONE, NONE, SOBOL
from scenarios.experiments.study_folder import StudyFolder
from scenarios.support.errors import StudyError

NEEDED = ("trial", "joint", "design", "source", "sample", "rel_error")
"""Columns of a sensitivity study that the budget uses."""
TAILS = (2.5, 97.5)
"""Percentiles of the bootstrap at the ends of an interval."""
RESAMPLES = 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval:
    """A value and its 95 % bootstrap interval.

    Attributes:
        value: A share of the gain, or of the variance of its error.
        low, high: Ends of the interval, relative as the value.
    """

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceCost:
    """Error of one joint's gain from one source.

    Attributes:
        joint: Joint number, from 1.
        source: Name of the source.
        trials: Trials of the source alone that gave a gain.
        bias: Mean relative error from the source alone, including that of the method without sources.
        rms: Root mean square of the relative error from the source alone.
        share: The source's share of the sum of all sources' mean squares.
        first, total: Sobol indices: share of the error's variance that vanishes if the source is known, and that
            remains if all others are known; None if the design has too few complete samples.
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
class BudgetJoint:
    """Relative errors of one joint's gain.

    Attributes:
        joint: Number of the joint, from 1.
        costs: One entry per source with which, alone, the joint has a gain, the largest error first.
        floor: Relative error with every source off, null where the joint was refused.
        together: Root mean square of the relative error with all sources on, null where no such trial gave a gain.
        samples: Number of rows of the Sobol design from which the indices are computed.
        lost: Number of trials without a gain for the joint.
        summed: Relative error expected for `together` if the sources are independent and their effects add up.
        silent: Sources with which, alone, the joint never has a gain.
    """

    joint: int
    costs: list[SourceCost]
    floor: float | None
    together: float | None
    samples: int
    lost: int
    summed: float
    silent: list[str]


def study_budget(scenario: Scenario, folder: StudyFolder, seed: int) -> tuple[BudgetJoint, ...]:
    """Compute the budget of a sensitivity study, of joints that should have a gain.

    Raises:
        StudyError: If no trial gave the gain of a joint that should have one; if a part is damaged.
    """
    wanted = [joint for joint, identifiable in enumerate(scenario.table.tolerance.identifiable, 1) if identifiable]
    found = budgets(folder.table(NEEDED), list(scenario.table.sources), wanted, seed)
    silent = ", ".join(str(each.joint) for each in found if not each.costs)
    if silent:
        raise StudyError(f"{folder.path}: no trial gave a gain of joint {silent}; see column `reason` of the rows")
    return found


def budgets(rows: pd.DataFrame, sources: Sequence[str], joints: Sequence[int], seed: int) -> tuple[BudgetJoint, ...]:
    """Return the budget of each joint. `rows` has one row per trial and joint, with the columns `NEEDED`."""
    return tuple(_joint_budget(rows.query("joint == @joint"), joint, sources, seed) for joint in joints)


def ranking(found: Sequence[BudgetJoint]) -> list[str]:
    """Return sources sorted by their share, summed over the joints, the largest first."""
    total: dict[str, float] = {}
    for cost in (cost for budget in found for cost in budget.costs):
        total[cost.source] = total.get(cost.source, 0.0) + cost.share
    return sorted(total, key=lambda source: -total[source])


def sobol_indices(A: Array, B: Array, AB: Array, seed: int) -> tuple[list[Interval], list[Interval]]:
    """Return first- and total-order indices of one output.

    Args:
        A: The output on matrix A, shape (n,), n a power of 2.
        B: On matrix B, shape (n,).
        AB: On A with the columns of source k from B, shape (d, n).
        seed: Seed of the bootstrap.
    """

    def indices(k: Indices) -> Array:  # (2, d)
        of = stats.sobol_indices(func={"f_A": A[k][None], "f_B": B[k][None], "f_AB": AB[:, k][:, None]}, n=len(A))
        return np.array([of.first_order.ravel(), of.total_order.ravel()])

    found, low, high = indices(np.arange(len(A))), *_percentiles([indices(k) for k in _resampled(len(A), seed)])
    first, total = (
        [Interval(value=float(v), low=float(x), high=float(y)) for v, x, y in zip(*order, strict=True)]
        for order in zip(found, low, high, strict=True)
    )
    return first, total


def _joint_budget(rows: pd.DataFrame, joint: int, sources: Sequence[str], seed: int) -> BudgetJoint:
    by_source = rows.query(f"design == {ALONE!r}").groupby("source")
    alone = {name: group["rel_error"].dropna().to_numpy() for name, group in by_source}
    squares = {name: float(np.mean(alone[name] ** 2)) for name in sources if len(alone.get(name, ())) > 0}
    first, total, samples = _indices(rows.query(f"design == {SOBOL!r}"), sources, seed)
    costs = [
        SourceCost(
            joint=joint,
            source=name,
            trials=len(alone[name]),
            bias=float(np.mean(alone[name])),
            rms=_rms(alone[name], seed),
            share=square / max(sum(squares.values()), 1e-300),
            first=first.get(name),
            total=total.get(name),
        )
        for name, square in squares.items()
    ]
    none, together = alone.get(NONE, np.empty(0)), alone.get(ALL, np.empty(0))
    floor = float(none[0]) if len(none) else None
    # Signed biases beyond that of the method, and variances, of independent sources add up.
    bias = (floor or 0.0) + sum(cost.bias - (floor or 0.0) for cost in costs)
    variance = sum(cost.rms.value**2 - cost.bias**2 for cost in costs)
    return BudgetJoint(
        joint=joint,
        costs=sorted(costs, key=lambda cost: -cost.rms.value),
        floor=floor,
        together=float(np.sqrt(np.mean(together**2))) if len(together) else None,
        samples=samples,
        lost=int(np.count_nonzero(rows["rel_error"].isna())),
        summed=float(np.sqrt(variance + bias**2)),
        silent=[name for name in sources if name not in squares],
    )


def _indices(
    rows: pd.DataFrame, sources: Sequence[str], seed: int
) -> tuple[dict[str, Interval], dict[str, Interval], int]:
    """Return Sobol indices by source from the complete rows of the design, and the number of these.

    The estimator needs a power of 2: with missing rows, the largest one available.
    """
    table = rows.assign(sample=rows["sample"].astype(int)).pivot_table(
        index="sample", columns="source", values="rel_error", dropna=False
    )
    whole = table.reindex(columns=["A", "B", *sources]).dropna().to_numpy()
    n = 2 ** int(np.log2(len(whole))) if len(whole) else 0
    if n < 4:
        return {}, {}, n
    first, total = sobol_indices(whole[:n, 0], whole[:n, 1], whole[:n, 2:].T, seed)
    return dict(zip(sources, first, strict=True)), dict(zip(sources, total, strict=True)), n


def _rms(error: Array, seed: int) -> Interval:
    value = float(np.sqrt(np.mean(error**2)))
    if len(error) < 2 or np.ptp(error) == 0.0:
        return Interval(value=value, low=value, high=value)
    low, high = _percentiles(np.sqrt(np.mean(error[_resampled(len(error), seed)] ** 2, axis=1)))
    return Interval(value=value, low=float(low), high=float(high))


def _resampled(n: int, seed: int) -> Indices:
    """Return the indices of each bootstrap resample, shape (RESAMPLES, n)."""
    return np.random.default_rng(seed).integers(n, size=(RESAMPLES, n))


def _percentiles(values: Array | list[Array]) -> tuple[Array, Array]:
    """Return the ends of a 95 % interval over the first axis."""
    low, high = np.percentile(values, TAILS, axis=0)
    return low, high
