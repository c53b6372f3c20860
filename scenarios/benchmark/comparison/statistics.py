"""Statistics of methods on one scenario: errors and intervals by joint, and scores."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from pydantic import Field

from ident.support.arrays import Array
from scenarios.benchmark.comparison.study import METHOD
from scenarios.experiments.statistics import Coverage, coverage
from scenarios.rendering.result import ResultModel

NEEDED = (METHOD, "trial", "joint", "true", "estimate", "std", "rel_error", "expected", "seconds", "failure")
"""Columns of a comparison that its statistics use."""
SOLVED = (0.01, 0.03, 0.10)
"""Largest relative errors of a solved gain."""
RANKED_BY = 0.03
"""The one of them that is used for ranking."""
FAR, SURE = 0.10, 3.0
"""A gain is wrong if its error exceeds this share of it and this number of its standard deviations.

A gain that should not be identifiable is wrong unless its error is below both limits, and its standard deviation below
the first.
"""
CRASHES = ("MethodCrashed", "MethodOutOfMemory", "MethodNotStarted")
TIME_OUTS = ("MethodTimedOut",)


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodJoint:
    """One method on one joint, over all trials; values are None without data.

    Attributes:
        joint: Joint number, from 1.
        expected: Number of trials whose data should identify the gain.
        gains: Number of trials in which the method gave a gain.
        bias: Mean of the relative error.
        spread: Standard deviation of the relative error.
        rms: Root mean square of the relative error.
        p95: 95th percentile of the magnitude of the relative error.
        cover_1, cover_2: Coverage of 1 and 2 estimated standard deviations (normal: 0.683 and 0.954).
        claimed: Root mean square of the estimated relative standard deviation.
        bound: Smallest relative standard deviation that the injected noise allows.
        claimed_over_bound: Ratio of `claimed` to that bound.
        spread_over_bound: Ratio of `spread` to that bound.
    """

    joint: int
    expected: int
    gains: int
    bias: float | None
    spread: float | None
    rms: float | None
    p95: float | None
    cover_1: Coverage | None
    cover_2: Coverage | None
    claimed: float | None
    bound: float | None
    claimed_over_bound: float | None
    spread_over_bound: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodSummary:
    """One method on one scenario.

    Attributes:
        method: Text that names the method.
        trials: Number of trials given to it.
        wanted: Number of gains that their data should identify.
        score: Number of gains within `RANKED_BY`, 3 %, minus wrong gains, as a share of `wanted`; 0 if everything is
            refused.
        solved: Share of the `wanted` gains within each of `SOLVED`, 1, 3 and 10 %.
        refused_rightly: Number of refused gains that the data do not identify.
        refused_wrongly: Number of refused gains that the data should identify, in valid answers.
        wrong_claims: Number of gains with an error above both `FAR`, 10 %, and `SURE`, 3, of their standard deviations;
            of gains that should not be identifiable, all except those with an error below both and a standard deviation
            below `FAR`.
        wrong_signs: Number of gains with the wrong sign.
        crashes, time_outs, misfits: Number of crashes, time-outs and invalid answers.
        failures: Number of failures by kind.
        seconds: Median wall time of a call [s]; None without a call.
        joints: One entry per joint.
    """

    method: str
    trials: int
    wanted: int
    score: float
    solved: tuple[float, ...]
    refused_rightly: int
    refused_wrongly: int
    wrong_claims: int
    wrong_signs: int
    crashes: int
    time_outs: int
    misfits: int
    failures: Mapping[str, int]
    seconds: float | None
    joints: tuple[MethodJoint, ...]


class ComparedScenario(ResultModel):
    """Results of methods on a scenario."""

    name: str = Field(description="Name of the scenario, or of the scenario of sealed problems")
    trials: int = Field(description="Number of trials given to each method")
    unposed: int = Field(description="Number of these trials that failed before any method was called")
    methods: list[MethodSummary] = Field(description="One entry per method, the best score first")


class Comparison(ResultModel):
    """What `rx90 compare --json` prints for scenarios, and with --open for sealed problems."""

    about: dict[str, str] = Field(
        description="What is needed to repeat the comparison: command, date, versions, external methods"
    )
    scenarios: list[ComparedScenario] = Field(description="One entry per scenario")


def summaries(rows: pd.DataFrame, methods: Sequence[str], bound: Array | None) -> tuple[MethodSummary, ...]:
    """Compute statistics of a comparison on one scenario.

    The rows, one per trial, method and joint, have `NEEDED`; `bound` is the smallest relative standard deviation of
    each joint, shape (n,).

    Returns:
        One entry per method, the best first; equal ones in the order given.
    """
    judged = _judged(rows)
    found = [_summary(method, judged.query(f"{METHOD} == @method"), bound) for method in methods]
    return tuple(sorted(found, key=lambda summary: -summary.score))


def _judged(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of trials that reached the methods, with derived columns.

    Without a standard deviation, any error above the limit is wrong. A gain that the scenario does not expect can still
    be correct, with a small standard deviation and error.
    """
    posed = rows.dropna(subset=["seconds"]).sort_values("trial", kind="stable")
    estimate, true, std, error = posed[["estimate", "true", "std", "rel_error"]].to_numpy(np.float64).T
    off, expected, claimed = np.abs(estimate - true), posed["expected"].to_numpy(bool), np.isfinite(estimate)
    near, honest = np.abs(error) <= FAR, off <= SURE * std
    good = np.where(expected, near | honest, near & honest & (std <= FAR * np.abs(estimate)))
    refused = posed["failure"].isna().to_numpy(bool) & ~claimed
    return posed.assign(
        off=off,
        claimed=claimed,
        wrong=claimed & ~good,
        wrong_sign=estimate * true < 0.0,
        refused_rightly=refused & ~expected,
        refused_wrongly=refused & expected,
        **{f"within {share}": expected & (np.abs(error) <= share) for share in SOLVED},
    )


def _summary(method: str, rows: pd.DataFrame, bound: Array | None) -> MethodSummary:
    wanted, wrong = _count(rows, "expected"), _count(rows, "wrong")
    calls = rows.drop_duplicates("trial")
    failures = dict(Counter(calls["failure"].dropna().tolist()))
    crashes, time_outs = (sum(failures.get(kind, 0) for kind in kinds) for kinds in (CRASHES, TIME_OUTS))
    return MethodSummary(
        method=method,
        trials=len(calls),
        wanted=wanted,
        score=(_count(rows, f"within {RANKED_BY}") - wrong) / max(wanted, 1),
        solved=tuple(_count(rows, f"within {share}") / max(wanted, 1) for share in SOLVED),
        refused_rightly=_count(rows, "refused_rightly"),
        refused_wrongly=_count(rows, "refused_wrongly"),
        wrong_claims=wrong,
        wrong_signs=_count(rows, "wrong_sign"),
        crashes=crashes,
        time_outs=time_outs,
        misfits=sum(failures.values()) - crashes - time_outs,
        failures=failures,
        seconds=float(np.median(calls["seconds"].to_numpy())) if len(calls) else None,
        joints=tuple(_joint(each, rows.query("joint == @each"), bound) for each in np.unique(rows["joint"]).tolist()),
    )


def _count(rows: pd.DataFrame, column: str) -> int:
    return int(rows[column].to_numpy(bool).sum())


def _joint(joint: int, rows: pd.DataFrame, bound: Array | None) -> MethodJoint:
    error = rows.loc[rows["claimed"], "rel_error"].to_numpy(np.float64)
    off, std, true = rows.loc[rows["claimed"] & rows["std"].notna(), ["off", "std", "true"]].to_numpy(np.float64).T
    claimed = _rms(std / true)
    spread = float(np.std(error, ddof=1)) if len(error) > 1 else None
    least = None if bound is None or not np.isfinite(bound[joint - 1]) else float(bound[joint - 1])
    return MethodJoint(
        joint=joint,
        expected=_count(rows, "expected"),
        gains=len(error),
        bias=float(np.mean(error)) if len(error) else None,
        spread=spread,
        rms=_rms(error),
        p95=float(np.percentile(np.abs(error), 95.0)) if len(error) else None,
        cover_1=coverage(off <= std),
        cover_2=coverage(off <= 2.0 * std),
        claimed=claimed,
        bound=least,
        claimed_over_bound=None if claimed is None or least is None else claimed / least,
        spread_over_bound=None if spread is None or least is None else spread / least,
    )


def _rms(values: Array) -> float | None:
    return float(np.sqrt(np.mean(values**2))) if len(values) else None
