"""Statistics of a study's rows, joint by joint: errors, coverage and pass rates.

Parts of a study are read one at a time, so it needs memory for three numbers per trial and joint with a gain.

Pass rule: for each joint, the number of misses among N trials is compared with the binomial distribution at the
required rate. A joint fails if that many misses, or more, have a probability below `false_alarm` / n. A method with the
required rate on every joint therefore fails in less than `false_alarm` of all studies (Bonferroni).
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from scipy import stats

from ident.support.arrays import Array, Mask
from scenarios.experiments.study_folder import StudyFolder

CONFIDENCE = 0.95
"""Level of the intervals of shares of trials."""
FALSE_ALARM = 0.01
"""Largest probability that a scenario whose joints have the required pass rate fails."""
SHOWN = 5000
"""Least number of injected gains kept per joint (if available); figures show no more points."""
COLUMNS = ("joint", "true", "std", "rel_error", "z", "identifiable", "passed", "failure", "tolerance")
"""Columns of a study that statistics and figures need."""


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
