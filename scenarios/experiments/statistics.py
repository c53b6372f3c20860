"""Statistics of a study's rows, joint by joint: errors, coverage and pass rates.

Parts of a study are read one at a time, so it needs memory for three numbers per trial and joint with a gain.

Pass rule: for each joint, the number of misses among N trials is compared with the binomial distribution at the
required rate. A joint fails if that many misses, or more, have a probability below `false_alarm` / n. A method with the
required rate on every joint therefore fails in less than `false_alarm` of all studies (Bonferroni).
"""

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from pydantic import BaseModel, ConfigDict, Field
from scipy import stats

from ident.support.arrays import Array, Mask
from scenarios.experiments.study_folder import StudyFolder

CONFIDENCE = 0.95
"""Level of the intervals of shares of trials."""
FALSE_ALARM = 0.01
"""Largest probability that a scenario whose joints have the required pass rate fails."""
COLUMNS = ("joint", "true", "std", "rel_error", "z", "identifiable", "passed", "failure", "tolerance")
"""Columns of a study that statistics and figures need."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointRows:
    """One joint in all trials of a study.

    Attributes:
        joint: Joint number, from 1.
        trials: Number of trials; of those without any estimate (`failed`); and of those that passed.
        tolerance: Largest relative error that passes, of the first trial.
        rel_error: Relative errors of the trials that gave a gain, shape (K,), as the following arrays.
        claimed: Estimated relative standard deviations.
        z: Errors over estimated standard deviations; NaN if there is none.
    """

    joint: int
    trials: int
    failed: int
    passed: int
    tolerance: float
    rel_error: Array
    claimed: Array
    z: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StudyRows:
    """All rows of a study, by joint; `failures` counts trials without any estimate by kind, most frequent first."""

    joints: tuple[JointRows, ...]
    failures: Mapping[str, int]


def rows_in(folder: StudyFolder) -> StudyRows:
    """Gather the rows of a study's folder; raises as `StudyFolder.tables`."""
    return study_rows(folder.tables(COLUMNS))


def study_rows(tables: Iterable[pa.Table]) -> StudyRows:
    """Gather the rows of a study.

    `tables` have one row per trial and joint, in any order and division, with `COLUMNS`.
    """
    numbers, counts = defaultdict[int, list[Array]](list), defaultdict[int, Counter[str]](Counter)
    kinds, tolerance = defaultdict[int, Counter[str]](Counter), dict[int, float]()
    for table in tables:
        joint, failure = table["joint"].to_numpy(), table["failure"]
        identifiable, passed = (pc.fill_null(table[name], False).to_numpy() for name in ("identifiable", "passed"))
        true, std, error, z = (table[name].to_numpy() for name in ("true", "std", "rel_error", "z"))
        each = np.stack([error, std / np.abs(true), z])
        for number in np.unique(joint).tolist():
            rows = np.flatnonzero(joint == number)
            tolerance.setdefault(number, table["tolerance"][rows[0]].as_py())
            counts[number].update(trials=len(rows), passed=int(np.count_nonzero(passed[rows])))
            kinds[number].update(failure.take(rows).drop_null().to_pylist())
            numbers[number].append(each[:, rows[identifiable[rows]]])
    joints: list[JointRows] = []
    for number in sorted(tolerance):
        error, claimed, z = np.hstack(numbers.pop(number))
        joints.append(
            JointRows(
                joint=number,
                trials=counts[number]["trials"],
                failed=kinds[number].total(),
                passed=counts[number]["passed"],
                tolerance=tolerance[number],
                rel_error=error,
                claimed=claimed,
                z=z,
            )
        )
    return StudyRows(joints=tuple(joints), failures=dict(kinds[joints[0].joint].most_common()) if joints else {})


class JointStatistics(BaseModel):
    """One joint over all trials of a study; values are null if no trial gave a gain."""

    model_config = ConfigDict(extra="allow", frozen=True)
    joint: int = Field(description="Joint number, from 1")
    trials: int = Field(description="Number of trials of the study")
    failed: int = Field(description="Number of trials without any estimate")
    refused: int = Field(description="Number of trials with an estimate but without a gain for this joint")
    bias: float | None = Field(description="Mean relative error")
    bias_std: float | None = Field(description="Standard deviation of `bias`, relative to the gain")
    spread: float | None = Field(description="Standard deviation of the relative error")
    p95: float | None = Field(description="95th percentile of the magnitude of the relative error")
    claimed: float | None = Field(description="Root mean square of the estimated relative standard deviation")
    cover_1: float | None = Field(
        description="Share of gains with an error below 1 estimated standard deviation (normal: 0.683)"
    )
    cover_2: float | None = Field(
        description="Share of gains with an error below 2 estimated standard deviations (normal: 0.954)"
    )
    pass_rate: float = Field(description="Share of trials that passed; a failed trial did not pass")
    pass_low: float = Field(description="Lower end of the 95 % interval of that share (Clopper and Pearson)")
    pass_high: float = Field(description="Upper end of the interval of the share of passes")
    wanted: float = Field(description="Share of passes that the scenario requires")
    allowed: int = Field(description="Largest number of misses that is compatible with it")
    held: bool = Field(
        description="Whether the trials are compatible with that pass rate; for too few trials to test it, whether all "
        "passed"
    )

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


def error_statistics(rel_error: Array, claimed: Array) -> dict[str, float | None]:
    """Return `bias`, `spread`, `p95` and `claimed` as in `JointStatistics`; None without data."""
    return {
        "bias": float(np.mean(rel_error)) if len(rel_error) else None,
        "spread": float(np.std(rel_error, ddof=1)) if len(rel_error) > 1 else None,
        "p95": float(np.percentile(np.abs(rel_error), 95.0)) if len(rel_error) else None,
        "claimed": root_mean_square(claimed),
    }


def root_mean_square(values: Array) -> float | None:
    """Return the root mean square, None without values."""
    return float(np.sqrt(np.mean(values**2))) if len(values) else None


def joint_statistics(joints: Sequence[JointRows], *, wanted: float, false_alarm: float) -> tuple[JointStatistics, ...]:
    """Compute statistics of a study, and apply the pass rule.

    `wanted` is the required pass rate, and `false_alarm` the largest probability that some joint fails although every
    joint has it.
    """
    found: list[JointStatistics] = []
    for rows in joints:
        passed, gains = coverage_of(rows.passed, rows.trials), len(rows.rel_error)
        allowed = allowed_misses(rows.trials, wanted, false_alarm / len(joints))
        errors = error_statistics(rows.rel_error, rows.claimed)
        within = {k: float(np.mean(np.abs(rows.z) < k)) if gains else None for k in (1.0, 2.0)}
        found.append(
            JointStatistics(
                joint=rows.joint,
                trials=rows.trials,
                failed=rows.failed,
                refused=rows.trials - rows.failed - gains,
                **errors,
                bias_std=None if errors["spread"] is None else errors["spread"] / float(np.sqrt(gains)),
                cover_1=within[1.0],
                cover_2=within[2.0],
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
