"""Statistics of many trials, joint by joint: how far off, how honest the claim, how often within tolerance."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
import pandas as pd
from pydantic import Field
from scipy import stats

from scenarios.experiments.files.schema import Scenario
from scenarios.experiments.studies.joint_rows import JointRows, StudyRows
from scenarios.experiments.studies.pass_rule import FALSE_ALARM, JointRule, pass_rule
from scenarios.support.result_model import ResultModel

CONFIDENCE = 0.95
"""Of the intervals of pass rates."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JointStatistics:
    """One joint over all trials of a study; None where no trial gave a gain.

    Attributes:
        joint: Joint number, from 1.
        trials: Trials of the study.
        failed: Trials without any estimate.
        refused: Trials that were carried out and gave no gain for this joint.
        bias: Mean relative error.
        bias_std: Standard deviation of that mean, relative to the gain too.
        spread: Standard deviation of the relative error.
        p95: 95th percentile of the magnitude of the relative error.
        claimed: Root mean square of the claimed relative standard deviation.
        cover_1: Share of gains that err by less than 1 claimed standard deviation (normal: 0.683).
        cover_2: Share of gains that err by less than 2 claimed standard deviations (normal: 0.954).
        pass_rate: Share of trials that passed; one that failed did not.
        pass_low, pass_high: Ends of the 95 % interval of that share (Clopper and Pearson).
        wanted: Share of passes that the scenario asks for.
        allowed: Misses that do not contradict it.
        held: False if the trials contradict that pass rate; of trials too few to do so, whether all passed.
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
    """What `rx90 monte-carlo --json` prints.

    Attributes:
        scenario: Its name.
        seed: Of the first trial.
        trials: Carried out; the folder may hold more than were asked for.
        passed: Whether no joint contradicts the pass rate that the scenario asks for.
        joints: One entry a joint, in their order.
    """

    scenario: str
    seed: int
    trials: int
    passed: bool
    joints: list[JointStatistics]
    failures: dict[str, int] = Field(description="trials without any estimate, by kind")


def study_result(scenario: Scenario, seed: int, rows: StudyRows) -> StudyResult:
    """Sum up a study by the pass rate that its scenario asks for.

    Args:
        scenario: That was repeated.
        seed: Of the first trial.
        rows: All of the study.
    """
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
    """Sum up a study.

    Args:
        joints: Its rows.
        wanted: Pass rate asked for.
        false_alarm: Chance that some joint is said to miss that rate although every joint has it.
    """
    rules = pass_rule(joints, wanted=wanted, false_alarm=false_alarm)
    return tuple(_one_joint(rule, rows) for rule, rows in zip(rules, joints, strict=True))


def statistics_table(statistics: Sequence[JointStatistics]) -> pd.DataFrame:
    """As a table, a row a joint; the file `summary.parquet`."""
    return pd.DataFrame([asdict(joint) for joint in statistics])


def _one_joint(rule: JointRule, rows: JointRows) -> JointStatistics:
    interval = stats.binomtest(rule.passed, rule.trials).proportion_ci(CONFIDENCE, method="exact")
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
        pass_rate=rule.passed / rule.trials,
        pass_low=float(interval.low),
        pass_high=float(interval.high),
        wanted=rule.wanted,
        allowed=rule.allowed,
        held=rule.held if rule.allowed < rule.trials else rule.passed == rule.trials,
    )
