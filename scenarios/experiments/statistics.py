"""Statistics of a study's rows, joint by joint: errors, coverage and pass rates, and the error budget of its sources.

Parts of a study are read one at a time, so it needs memory for three numbers per trial and joint with a gain.

Pass rule: for each joint, the number of misses among N trials is compared with the binomial distribution at the
required rate. A joint fails if that many misses, or more, have a probability below `false_alarm` / n. A method with the
required rate on every joint therefore fails in less than `false_alarm` of all studies (Bonferroni).

Budget of a sensitivity study: the error from each source alone, and its share of the total variance.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from scipy import stats

from ident.support.arrays import Array, Indices, Mask
from scenarios.experiments.schema import Scenario
from scenarios.experiments.study import ALL, ALONE, NONE, SOBOL
from scenarios.experiments.study_folder import StudyFolder
from scenarios.support.errors import StudyError

if TYPE_CHECKING:
    import pandas as pd

CONFIDENCE = 0.95
"""Level of the intervals of shares of trials."""
FALSE_ALARM = 0.01
"""Largest probability that a scenario whose joints have the required pass rate fails."""
SHOWN = 5000
"""Least number of injected gains kept per joint (if available); figures show no more points."""
COLUMNS = ("joint", "true", "std", "rel_error", "z", "identifiable", "passed", "failure", "tolerance")
"""Columns of a study that statistics and figures need."""
NEEDED = ("trial", "joint", "design", "source", "sample", "rel_error")
"""Columns of a sensitivity study that the budget uses."""
TAILS = (2.5, 97.5)
"""Percentiles of the bootstrap at the ends of an interval."""
RESAMPLES = 1000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointRows:
    """One joint in all trials of a study.

    Attributes:
        joint: Joint number, from 1.
        trials: Trials.
        failed: Number of trials without any estimate.
        passed: Trials that passed.
        tolerance: Largest relative error that passes, of the first trial.
        rel_error: Relative errors of the trials that gave a gain, shape (K,), as the following arrays.
        claimed: Estimated relative standard deviations.
        z: Errors over estimated standard deviations; NaN if there is none.
        step: The injected gain of every `step`-th of these trials is kept.
        true: Injected gains of every `step`-th trial [N m / drive unit], shape (ceil(K / step),).
    """

    joint: int
    trials: int
    failed: int
    passed: int
    tolerance: float
    rel_error: Array
    claimed: Array
    z: Array
    step: int
    true: Array

    @property
    def gains(self) -> int:
        """Number of trials that gave a gain."""
        return len(self.rel_error)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StudyRows:
    """All rows of a study.

    Attributes:
        joints: One entry per joint, in order.
        failures: Trials without any estimate by kind, the most frequent first.
    """

    joints: tuple[JointRows, ...]
    failures: Mapping[str, int]


def rows_in(folder: StudyFolder) -> StudyRows:
    """Gather the rows of a study's folder.

    Raises:
        StudyError: If a part cannot be read.
    """
    return study_rows(folder.tables(COLUMNS), trials=sum(len(part.trials) for part in folder.parts()))


@dataclass(slots=True, eq=False)
class _Gathered:
    """Accumulated data of one joint; `numbers` (3, trials) are written from the left, as growing needs a copy."""

    tolerance: float
    numbers: Array
    trials: int = 0
    gains: int = 0
    passed: int = 0
    true: list[Array] = field(default_factory=list[Array])
    failures: Counter[str] = field(default_factory=Counter[str])


def study_rows(tables: Iterable[pa.Table], *, trials: int) -> StudyRows:
    """Gather the rows of a study.

    `tables` have one row per trial and joint, in any order and division, with `COLUMNS`.
    """
    gathered: dict[int, _Gathered] = {}
    step = max(1, trials // SHOWN)
    for table in tables:
        joint, failure = table["joint"].to_numpy(), table["failure"]
        identifiable, passed = (pc.fill_null(table[name], False).to_numpy() for name in ("identifiable", "passed"))
        true, std, error, z = (table[name].to_numpy() for name in ("true", "std", "rel_error", "z"))
        numbers = np.stack([error, std / np.abs(true), z])
        for number in np.unique(joint).tolist():
            rows = np.flatnonzero(joint == number)
            if number not in gathered:
                gathered[number] = _Gathered(table["tolerance"][rows[0]].as_py(), np.empty((3, trials)))
            known, found = gathered[number], rows[identifiable[rows]]
            known.trials += len(rows)
            known.passed += int(np.count_nonzero(passed[rows]))
            known.failures.update(failure.take(rows).drop_null().to_pylist())
            known.true.append(true[found][-known.gains % step :: step].copy())  # not a view that keeps all of them
            known.numbers[:, known.gains : known.gains + len(found)] = numbers[:, found]
            known.gains += len(found)
    joints: list[JointRows] = []
    for number, known in sorted(gathered.items()):
        rel_error, claimed, z = known.numbers[:, : known.gains]
        joints.append(
            JointRows(
                joint=number,
                trials=known.trials,
                failed=known.failures.total(),
                passed=known.passed,
                tolerance=known.tolerance,
                rel_error=rel_error,
                claimed=claimed,
                z=z,
                step=step,
                true=np.concatenate(known.true),
            )
        )
    failures = dict(gathered[joints[0].joint].failures.most_common()) if joints else {}
    return StudyRows(joints=tuple(joints), failures=failures)


@dataclass(frozen=True, slots=True, kw_only=True)
class JointStatistics:
    """One joint over all trials of a study; values are None if no trial gave a gain.

    Attributes:
        joint: Joint number, from 1.
        trials: Number of trials of the study.
        failed: Number of trials without any estimate.
        refused: Number of trials with an estimate but without a gain for this joint.
        bias: Mean relative error.
        bias_std: Standard deviation of `bias`, relative to the gain.
        spread: Standard deviation of the relative error.
        p95: 95th percentile of the magnitude of the relative error.
        claimed: Root mean square of the estimated relative standard deviation.
        cover_1: Share of gains with an error below 1 estimated standard deviation (normal: 0.683).
        cover_2: Share of gains with an error below 2 estimated standard deviations (normal: 0.954).
        pass_rate: Share of trials that passed; a failed trial did not pass.
        pass_low, pass_high: Ends of the 95 % interval of that share (Clopper and Pearson).
        wanted: Share of passes that the scenario requires.
        allowed: Largest number of misses that is compatible with it.
        held: Whether the trials are compatible with that pass rate; for too few trials to test it, whether all passed.
    """

    joint: int
    trials: int
    failed: int
    refused: int
    bias: float | None
    bias_std: float | None
    spread: float | None
    p95: float | None
    claimed: float | None
    cover_1: float | None
    cover_2: float | None
    pass_rate: float
    pass_low: float
    pass_high: float
    wanted: float
    allowed: int
    held: bool

    @property
    def passed(self) -> int:
        """Number of trials that passed."""
        return round(self.pass_rate * self.trials)

    @property
    def gains(self) -> int:
        """Number of trials with a gain."""
        return self.trials - self.failed - self.refused


@dataclass(frozen=True, slots=True, kw_only=True)
class Coverage:
    """Coverage of an interval.

    Attributes:
        share: Share of intervals that contain the true value, of trials with a gain and a standard deviation.
        low, high: Ends of the 95 % interval of that share (Clopper and Pearson).
    """

    share: float
    low: float
    high: float


def coverage(held: Mask) -> Coverage | None:
    """Return the coverage of intervals, None without any."""
    return coverage_of(int(held.sum()), len(held)) if len(held) else None


def coverage_of(held: int, trials: int) -> Coverage:
    """Return the coverage of `trials` intervals, of which `held` contain the true value."""
    interval = stats.binomtest(held, trials).proportion_ci(CONFIDENCE, method="exact")
    return Coverage(share=held / trials, low=float(interval.low), high=float(interval.high))


def joint_statistics(joints: Sequence[JointRows], *, wanted: float, false_alarm: float) -> tuple[JointStatistics, ...]:
    """Compute statistics of a study, and apply the pass rule.

    `wanted` is the required pass rate, and `false_alarm` the largest probability that some joint fails although every
    joint has it.
    """
    found: list[JointStatistics] = []
    for rows in joints:
        passed = coverage_of(rows.passed, rows.trials)
        allowed = allowed_misses(rows.trials, wanted, false_alarm / len(joints))
        error, some = rows.rel_error, rows.gains > 0
        spread = float(np.std(error, ddof=1)) if rows.gains > 1 else None
        found.append(
            JointStatistics(
                joint=rows.joint,
                trials=rows.trials,
                failed=rows.failed,
                refused=rows.trials - rows.failed - rows.gains,
                bias=float(np.mean(error)) if some else None,
                bias_std=None if spread is None else spread / float(np.sqrt(rows.gains)),
                spread=spread,
                p95=float(np.percentile(np.abs(error), 95.0, overwrite_input=True)) if some else None,
                claimed=float(np.sqrt(np.mean(rows.claimed**2))) if some else None,
                cover_1=float(np.mean(np.abs(rows.z) < 1.0)) if some else None,
                cover_2=float(np.mean(np.abs(rows.z) < 2.0)) if some else None,
                pass_rate=passed.share,
                pass_low=passed.low,
                pass_high=passed.high,
                wanted=wanted,
                allowed=allowed,
                # with too few trials to test the rate, every one must pass
                held=rows.trials - rows.passed <= (allowed if allowed < rows.trials else 0),
            )
        )
    return tuple(found)


def allowed_misses(trials: int, wanted: float, false_alarm: float) -> int:
    """Return the number of misses that a pass rate of `wanted` exceeds in at most `false_alarm` of studies."""
    return int(stats.binom.isf(false_alarm, trials, 1.0 - wanted))


def detectable_rate(trials: int, allowed: int, power: float) -> float:
    """Return the pass rate below which a joint fails with a probability of at least `power`."""
    return float(1.0 - stats.beta.ppf(power, allowed + 1, trials - allowed)) if trials > allowed else 0.0


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


def budgets(rows: "pd.DataFrame", sources: Sequence[str], joints: Sequence[int], seed: int) -> tuple[BudgetJoint, ...]:
    """Return the budget of each joint. `rows` has one row per trial and joint, with the columns `NEEDED`."""
    return tuple(_joint_budget(rows.query("joint == @joint"), joint, sources, seed) for joint in joints)


def _joint_budget(rows: "pd.DataFrame", joint: int, sources: Sequence[str], seed: int) -> BudgetJoint:
    by_source = rows.query(f"design == {ALONE!r}").groupby("source")
    alone = {name: group["rel_error"].dropna().to_numpy() for name, group in by_source}
    squares = {name: float(np.mean(alone[name] ** 2)) for name in sources if len(alone.get(name, ())) > 0}
    # The estimator of Sobol indices needs a power of 2 of complete rows: the largest one available.
    design = rows.query(f"design == {SOBOL!r}")
    design = design.assign(sample=design["sample"].astype(int)).pivot_table(
        index="sample", columns="source", values="rel_error", dropna=False
    )
    whole = design.reindex(columns=["A", "B", *sources]).dropna().to_numpy()
    n = 2 ** int(np.log2(len(whole))) if len(whole) else 0
    indices = sobol_indices(whole[:n, 0], whole[:n, 1], whole[:n, 2:].T, seed) if n >= 4 else ([], [])
    first, total = (dict(zip(sources, order, strict=False)) for order in indices)
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
        samples=n,
        lost=int(np.count_nonzero(rows["rel_error"].isna())),
        summed=float(np.sqrt(variance + bias**2)),
        silent=[name for name in sources if name not in squares],
    )


def ranking(found: Sequence[BudgetJoint]) -> list[str]:
    """Return sources sorted by their share, summed over the joints, the largest first."""
    total = Counter[str]()
    for cost in (cost for budget in found for cost in budget.costs):
        total[cost.source] += cost.share  # pyright: ignore[reportArgumentType]  (a counter adds any numbers)
    return [source for source, _ in total.most_common()]


def sobol_indices(A: Array, B: Array, AB: Array, seed: int) -> tuple[list[Interval], list[Interval]]:
    """Return first- and total-order indices of one output; the seed is that of the bootstrap.

    The output is known on matrices A and B, both (n,), n a power of 2, and on A with the columns of source k from B,
    (d, n).
    """

    def indices(k: Indices) -> Array:  # (2, d)
        of = stats.sobol_indices(func={"f_A": A[k][None], "f_B": B[k][None], "f_AB": AB[:, k][:, None]}, n=len(A))
        return np.array([of.first_order.ravel(), of.total_order.ravel()])

    found, ends = (
        indices(np.arange(len(A))),
        np.percentile([indices(k) for k in _resampled(len(A), seed)], TAILS, axis=0),
    )
    first, total = (
        [Interval(value=float(v), low=float(x), high=float(y)) for v, x, y in zip(*order, strict=True)]
        for order in zip(found, *ends, strict=True)
    )
    return first, total


def _rms(error: Array, seed: int) -> Interval:
    value = float(np.sqrt(np.mean(error**2)))
    if len(error) < 2 or np.ptp(error) == 0.0:
        return Interval(value=value, low=value, high=value)
    low, high = np.percentile(np.sqrt(np.mean(error[_resampled(len(error), seed)] ** 2, axis=1)), TAILS)
    return Interval(value=value, low=float(low), high=float(high))


def _resampled(n: int, seed: int) -> Indices:
    """Return the indices of each bootstrap resample, shape (RESAMPLES, n)."""
    return np.random.default_rng(seed).integers(n, size=(RESAMPLES, n))
