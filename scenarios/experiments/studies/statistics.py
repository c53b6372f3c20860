"""Statistics of many trials, joint by joint: errors, coverage of intervals, pass rates."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from pydantic import Field
from scipy import stats

from ident.support.arrays import Mask
from scenarios.experiments.files.schema import Scenario
from scenarios.experiments.studies.joint_rows import JointRows, StudyRows
from scenarios.experiments.studies.pass_rule import FALSE_ALARM, JointRule, pass_rule
from scenarios.rendering.result import ResultModel

SUMMARY = "summary.parquet"
CONFIDENCE = 0.95
"""Level of the intervals of shares of trials."""


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


class StudyResult(ResultModel):
    """What `rx90 monte-carlo --json` prints."""

    scenario: str = Field(description="Name of the scenario")
    seed: int = Field(description="Seed of the first trial")
    trials: int = Field(description="Number of trials in the folder, which may exceed the number requested")
    passed: bool = Field(description="Whether every joint is compatible with the pass rate that the scenario requires")
    joints: list[JointStatistics] = Field(description="One entry per joint, in order")
    failures: dict[str, int] = Field(description="Number of trials without any estimate, by kind of failure")


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
    return _share(int(held.sum()), len(held)) if len(held) else None


def _share(count: int, trials: int) -> Coverage:
    interval = stats.binomtest(count, trials).proportion_ci(CONFIDENCE, method="exact")
    return Coverage(share=count / trials, low=float(interval.low), high=float(interval.high))


def study_result(scenario: Scenario, seed: int, rows: StudyRows) -> StudyResult:
    """Compute statistics of a study with the pass rate that its scenario requires."""
    joints = joint_statistics(rows.joints, wanted=scenario.table.tolerance.pass_rate, false_alarm=FALSE_ALARM)
    return StudyResult(
        scenario=scenario.name,
        seed=seed,
        trials=joints[0].trials,
        passed=all(joint.held for joint in joints),
        joints=list(joints),
        failures=dict(rows.failures),
    )


def joint_statistics(joints: Sequence[JointRows], *, wanted: float, false_alarm: float) -> tuple[JointStatistics, ...]:
    """Compute statistics of a study. `false_alarm` as in `pass_rule`."""
    rules = pass_rule(joints, wanted=wanted, false_alarm=false_alarm)
    return tuple(_one_joint(rule, rows) for rule, rows in zip(rules, joints, strict=True))


def write_summary(statistics: Sequence[JointStatistics], folder: Path) -> Path:
    """Write `summary.parquet`, one row per joint.

    Raises:
        OSError: If it cannot be written.
    """
    pd.DataFrame([asdict(joint) for joint in statistics]).to_parquet(folder / SUMMARY, index=False)
    return folder / SUMMARY


def _one_joint(rule: JointRule, rows: JointRows) -> JointStatistics:
    passed = _share(rule.passed, rule.trials)
    error, z = rows.rel_error, rows.z
    some, several = rows.gains > 0, rows.gains > 1
    spread = float(np.std(error, ddof=1)) if several else None
    return JointStatistics(
        joint=rule.joint,
        trials=rows.trials,
        failed=rows.failed,
        refused=rows.trials - rows.failed - rows.gains,
        bias=float(np.mean(error)) if some else None,
        bias_std=None if spread is None else spread / float(np.sqrt(rows.gains)),
        spread=spread,
        p95=float(np.percentile(np.abs(error), 95.0, overwrite_input=True)) if some else None,
        claimed=float(np.sqrt(np.mean(rows.claimed**2))) if some else None,
        cover_1=float(np.mean(np.abs(z) < 1.0)) if some else None,
        cover_2=float(np.mean(np.abs(z) < 2.0)) if some else None,
        pass_rate=passed.share,
        pass_low=passed.low,
        pass_high=passed.high,
        wanted=rule.wanted,
        allowed=rule.allowed,
        held=rule.held if rule.allowed < rule.trials else rule.passed == rule.trials,
    )
