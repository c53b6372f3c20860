"""Statistics of a study's rows, joint by joint: errors, coverage and pass rates.

Pass rule: for each joint, the number of misses among N trials is compared with the binomial distribution at the
required rate. A joint fails if that many misses, or more, have a probability below `false_alarm` / n. A method with the
required rate on every joint therefore fails in less than `false_alarm` of all studies (Bonferroni).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd
from pydantic import BaseModel, ConfigDict
from scipy import stats

from ident.support.arrays import Array, Mask

CONFIDENCE = 0.95
"""Level of the intervals of shares of trials."""
FALSE_ALARM = 0.01
"""Largest probability that a scenario whose joints have the required pass rate fails."""
COLUMNS = ("trial", "seed", "joint", "true", "std", "rel_error", "z", "identifiable", "passed", "failure", "tolerance")
"""Columns of a study that statistics and figures need."""


def by_joint(rows: pd.DataFrame) -> Iterator[tuple[int, pd.DataFrame, pd.DataFrame]]:
    """Yield each joint, its rows, and those with a gain, which have its estimated relative deviation as `claimed`."""
    for joint in np.unique(rows["joint"].to_numpy()).tolist():
        own = rows.query(f"joint == {joint}")
        found = own.query("identifiable")
        yield joint, own, found.assign(claimed=found["std"].to_numpy() / np.abs(found["true"].to_numpy()))


class JointStatistics(BaseModel):
    """One joint over all trials of a study; values are null if no trial gave a gain."""

    model_config = ConfigDict(extra="allow", frozen=True)
    joint: int  # joint number, from 1
    trials: int  # number of trials of the study
    failed: int  # number of trials without any estimate
    refused: int  # number of trials with an estimate but without a gain for this joint
    bias: float | None  # mean relative error
    bias_std: float | None  # standard deviation of `bias`, relative to the gain
    spread: float | None  # standard deviation of the relative error
    p95: float | None  # 95th percentile of the magnitude of the relative error
    claimed: float | None  # root mean square of the estimated relative standard deviation
    cover_1: float | None  # share of gains with an error below 1 estimated standard deviation (normal: 0.683)
    cover_2: float | None  # share of gains with an error below 2 estimated standard deviations (normal: 0.954)
    pass_rate: float  # share of trials that passed; a failed trial did not pass
    pass_low: float  # lower end of the 95 % interval of that share (Clopper and Pearson)
    pass_high: float  # upper end of the interval of the share of passes
    wanted: float  # share of passes that the scenario requires
    allowed: int  # largest number of misses that is compatible with it
    held: bool  # whether the trials are compatible with that rate; if too few to test it, whether all passed

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
    """Coverage of an interval."""

    share: float  # share of intervals that contain the true value, of trials with a gain and a standard deviation
    low: float  # lower end of the 95 % interval of that share (Clopper and Pearson)
    high: float  # upper end of the interval of that share


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


def joint_statistics(rows: pd.DataFrame, *, wanted: float, false_alarm: float) -> tuple[JointStatistics, ...]:
    """Return statistics of a study with `COLUMNS`; `wanted` and `false_alarm` are those of the pass rule."""
    found, joints = list[JointStatistics](), len(np.unique(rows["joint"].to_numpy()))
    for joint, own, with_gain in by_joint(rows):
        trials, gains, z = len(own), len(with_gain), with_gain["z"].to_numpy()
        passes, failed = (int(np.count_nonzero(each)) for each in (own["passed"], own["failure"].notna()))
        passed, allowed = coverage_of(passes, trials), allowed_misses(trials, wanted, false_alarm / joints)
        errors = error_statistics(with_gain["rel_error"].to_numpy(), with_gain["claimed"].to_numpy())
        errors["bias_std"] = None if errors["spread"] is None else errors["spread"] / float(np.sqrt(gains))
        errors |= {f"cover_{k}": float(np.mean(np.abs(z) < k)) if gains else None for k in (1, 2)}
        rates = {"pass_rate": passed.share, "pass_low": passed.low, "pass_high": passed.high, "wanted": wanted}
        # With too few trials to test the rate, every one must pass.
        held = trials - passes <= (allowed if allowed < trials else 0)
        counts = {"joint": joint, "trials": trials, "failed": failed, "refused": trials - failed - gains}
        found.append(JointStatistics.model_validate({**counts, **errors, **rates, "allowed": allowed, "held": held}))
    return tuple(found)


def allowed_misses(trials: int, wanted: float, false_alarm: float) -> int:
    """Return the number of misses that a pass rate of `wanted` exceeds in at most `false_alarm` of studies."""
    return int(stats.binom.isf(false_alarm, trials, 1.0 - wanted))
