"""The result of a comparison: scores, errors and coverage of every method on every scenario.

A gain is wrong if its error exceeds both `FAR` of it and `SURE` of its standard deviations. One that the data should
not identify is wrong unless its error is below both, and its standard deviation below `FAR`. The score is the number of
gains within `RANKED_BY` minus wrong gains, as a share of the gains that the data should identify.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from ident.support.arrays import Array
from ident.support.naming import enumerated, one_line
from scenarios.benchmark.study import METHOD
from scenarios.experiments.statistics import Coverage, coverage
from scenarios.rendering.content import (
    NONE,
    Cell,
    Heading,
    Mood,
    Paragraph,
    Part,
    Report,
    column,
    many,
    number,
    percent,
    table,
)
from scenarios.rendering.plot import SERIES, Plot, draw_bars, draw_intervals
from scenarios.rendering.result import ResultModel
from scenarios.results.record import read_result, repeated
from scenarios.results.studies import NORMAL, in_percent
from scenarios.support.errors import ScenarioError

DOCUMENT = "report.json"
NEEDED = (METHOD, "trial", "joint", "true", "estimate", "std", "rel_error", "expected", "seconds", "failure")
"""Columns of the study that the statistics use."""
SOLVED = (0.01, 0.03, 0.10)
"""Largest relative errors of a solved gain."""
RANKED_BY = 0.03
"""The one of them that is used for ranking."""
FAR, SURE = 0.10, 3.0
"""Errors of a wrong gain: a share of it, and a number of its standard deviations."""
CRASHES = ("MethodCrashed", "MethodOutOfMemory", "MethodNotStarted")
TIME_OUT = "MethodTimedOut"
RULE = (
    f"Score: the number of gains within {100.0 * RANKED_BY:g} % minus the number of wrong gains, over the number of "
    "gains that the data should determine, so refusing everything scores 0. A gain is wrong if its error exceeds both "
    f"{100.0 * FAR:g} % and {SURE:g} of its estimated standard deviations. If the scenario says that the data do not "
    "determine the gain, it is wrong unless its error is below both limits and its estimated standard deviation is "
    f"below {100.0 * FAR:g} %. A gain lost to a crash, a time-out or an invalid answer is neither solved nor refused. "
    "Time: median of a call, including process start and reading of files."
)
MEANING = (
    "Bias, std: mean and standard deviation of the error. Within: share of trials with an error below 1 or 2 "
    "estimated standard deviations (68.3 % and 95.4 % if these are correct), with the 95 % interval of the latter "
    "(Clopper and Pearson). Bound: Cramer-Rao, of all joints together for the injected current noise at "
    "its level in the band of the rows, without encoder noise and errors of payload or model. If a scenario draws "
    "values, the bound is computed with the values in its file."
)


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
        cover_1: Coverage of 1 estimated standard deviation (normal: 0.683).
        cover_2: Coverage of 2 estimated standard deviations (normal: 0.954).
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
        score: Number of gains within 3 % minus wrong gains, as a share of `wanted`; 0 if everything is refused.
        solved: Share of the `wanted` gains within 1, 3 and 10 %.
        refused_rightly: Number of refused gains that the data do not identify.
        refused_wrongly: Number of refused gains that the data should identify, in valid answers.
        wrong_claims: Number of gains with an error above both 10 % and 3 of their standard deviations; of gains that
            should not be identifiable, all except those with an error below both and a standard deviation below 10 %.
        wrong_signs: Number of gains with the wrong sign.
        crashes: Number of crashes.
        time_outs: Number of time-outs.
        misfits: Number of invalid answers.
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
    """Results of methods on a scenario.

    Attributes:
        name: Name of the scenario.
        trials: Number of trials given to each method.
        unposed: Number of these trials that failed before any method was called.
        methods: One entry per method, the best score first.
    """

    name: str
    trials: int
    unposed: int
    methods: list[MethodSummary]

    def parts(self) -> Iterable[Part]:
        """Scores and failures of methods, then errors and coverage by joint."""
        yield Heading(f"{self.name}, {many(self.trials, 'trial')}")
        yield from self._plots()
        yield table(
            self.methods,
            column("Method", lambda each: each.method, words=True),
            column("Score [%]", lambda each: percent(each.score, ".1f")),
            *(column(f"Within\n{100.0 * share:g} % [%]", _solved(k)) for k, share in enumerate(SOLVED)),
            column("Refused\nrightly", lambda each: each.refused_rightly),
            column("Refused\nwrongly", lambda each: each.refused_wrongly),
            column("Wrong\ngains", lambda each: _bad(each.wrong_claims)),
            column("Wrong\nsigns", lambda each: _bad(each.wrong_signs)),
            column("Crashes", lambda each: _bad(each.crashes), file_only=True),
            column("Time\nouts", lambda each: _bad(each.time_outs), file_only=True),
            column("Invalid\nanswers", lambda each: _bad(each.misfits), file_only=True),
            column("Time [s]", lambda each: number(each.seconds, ".2g")),
        )
        for each in self.methods:
            if each.failures:
                failures = ", ".join(f"{count} {kind}" for kind, count in each.failures.items())
                yield Paragraph(f"{each.method}: {failures}.")
        yield table(
            [(each.method, joint) for each in self.methods for joint in each.joints],
            column("Method", lambda row: row[0], words=True),
            column("Joint", lambda row: row[1].joint),
            column("Gains", lambda row: row[1].gains),
            column("Bias [%]", lambda row: percent(row[1].bias, "+.3f")),
            column("Std [%]", lambda row: percent(row[1].spread)),
            column("Rms [%]", lambda row: percent(row[1].rms)),
            column("95 %\nbelow [%]", lambda row: percent(row[1].p95)),
            column("Within\n1 sigma [%]", lambda row: _share(row[1].cover_1), file_only=True),
            column("Within\n2 sigma [%]", lambda row: _share(row[1].cover_2)),
            column("95 % interval [%]", lambda row: _interval(row[1].cover_2), file_only=True),
            column("Estimated\nstd [%]", lambda row: percent(row[1].claimed)),
            column("Bound [%]", lambda row: percent(row[1].bound)),
            column("Std\nover bound", lambda row: number(row[1].spread_over_bound, ".2f"), file_only=True),
            column("Estimated std\nover bound", lambda row: number(row[1].claimed_over_bound, ".2f"), file_only=True),
        )
        if self.unposed:
            yield Paragraph(f"{self.unposed} of them failed before any method was run.")

    def _plots(self) -> Iterable[Plot]:
        """Errors and coverage of the best methods by joint."""
        best, more = self.methods[: len(SERIES)], len(self.methods) - len(SERIES)
        left = f" {more} more in the table only." if more > 0 else ""
        joints = [each.joint for each in self.methods[0].joints]
        rms = {
            method.method: {each.joint: 100.0 * each.rms for each in method.joints if each.rms is not None}
            for method in best
        }
        held = {
            method.method: {each.joint: in_percent(each.cover_2) for each in method.joints if each.cover_2 is not None}
            for method in best
        }
        yield Plot(
            title="Rms error",
            caption=f"Gains that each method gave; no bar where it gave none.{left}",
            x="Joint",
            y="Rms error [%]",
            draw=partial(draw_bars, joints=joints, series=rms),
        )
        yield Plot(
            title="Coverage of two estimated standard deviations",
            caption=f"Bars: 95 % intervals. Dashed: {100.0 * NORMAL:.1f} %, the nominal coverage.{left}",
            x="Joint",
            y="Held [% of gains]",
            draw=partial(draw_intervals, joints=joints, series=held, limit=100.0 * NORMAL),
        )


class Comparison(ResultModel):
    """What `rx90 compare --json` prints.

    Attributes:
        about: What is needed to repeat the comparison: command, date, versions, external methods.
        scenarios: One entry per scenario.
    """

    about: dict[str, str]
    scenarios: list[ComparedScenario]

    @property
    def title(self) -> str:
        """Title of a report."""
        methods = many(len(self.scenarios[0].methods), "method")
        return f"{methods} compared on {', '.join(each.name for each in self.scenarios)}"

    @property
    def ran(self) -> bool:
        """Whether a method was run on any trial."""
        return any(each.unposed < each.trials for each in self.scenarios)

    def parts(self) -> Iterable[Part]:
        """The best methods of each scenario and the next one, every scenario, and how scores are counted."""
        if self.ran:
            text = "; ".join(f"on {each.name} {_best(each.methods)}" for each in self.scenarios)
            yield Paragraph(f"{text[0].upper()}{text[1:]}.", strong=True)
        else:
            yield Paragraph("No method was run: every trial failed before.", Mood.BAD, strong=True)
        for each in self.scenarios:
            yield from each.parts()
        yield Paragraph(RULE)
        yield Paragraph(MEANING)


def page(folder: Path) -> Report:
    """Return the page of a folder.

    Raises:
        ScenarioError: If its document is damaged, or of another version.
    """
    path = folder / DOCUMENT
    found = read_result(folder, Comparison, DOCUMENT)
    if not found.scenarios or not all(each.methods for each in found.scenarios):
        raise ScenarioError(f"{one_line(path)}: compares nothing")
    others = {key: text for key, text in found.about.items() if key != "Command"}
    command = {"Original command": found.about.get("Command", "")}
    return found.report(found.title, *repeated(command, others, {}))


def _best(methods: Sequence[MethodSummary]) -> str:
    """Return the methods with the highest score, as it is shown, and the next one; `methods` are in order of score."""
    scores = [f"{100.0 * each.score:.1f} %" for each in methods]
    first = [each.method for each, score in zip(methods, scores, strict=True) if score == scores[0]]
    best, rest = f"{enumerated(first)} {'score' if first[1:] else 'scores'} {scores[0]}", len(first)
    return f"{best}, {methods[rest].method} {scores[rest]}" if rest < len(methods) else best


def _solved(k: int) -> Callable[[MethodSummary], str]:
    return lambda each: percent(each.solved[k], ".1f")


def _bad(count: int) -> Cell:
    return Cell(str(count), Mood.BAD if count else Mood.PLAIN)


def _share(found: Coverage | None) -> str:
    return percent(found and found.share, ".1f")


def _interval(found: Coverage | None) -> str:
    return NONE if found is None else f"{percent(found.low, '.1f')}..{percent(found.high, '.1f')}"


def compared(name: str, rows: pd.DataFrame, methods: Sequence[str], bound: Array | None) -> ComparedScenario:
    """Compute statistics of a comparison on one scenario.

    The rows have the columns `NEEDED`; `bound` is the smallest relative standard deviation of each joint, shape (n,).
    Equal scores keep the order given.
    """
    posed = rows.dropna(subset=["seconds"]).sort_values("trial", kind="stable")
    estimate, true, std, error = posed[["estimate", "true", "std", "rel_error"]].to_numpy(np.float64).T
    off, expected, claimed = np.abs(estimate - true), posed["expected"].to_numpy(bool), np.isfinite(estimate)
    near, honest = np.abs(error) <= FAR, off <= SURE * std  # without a standard deviation, none is honest
    good = np.where(expected, near | honest, near & honest & (std <= FAR * np.abs(estimate)))
    refused = posed["failure"].isna().to_numpy(bool) & ~claimed
    posed = posed.assign(
        off=off,
        claimed=claimed,
        wrong=claimed & ~good,
        wrong_sign=estimate * true < 0.0,
        refused_rightly=refused & ~expected,
        refused_wrongly=refused & expected,
        **{f"within {share}": expected & (np.abs(error) <= share) for share in SOLVED},
    )
    found = (_summary(method, posed.query(f"{METHOD} == @method"), bound) for method in methods)
    ranked = sorted(found, key=lambda summary: -summary.score)
    trials, reached = (each["trial"].unique().size for each in (rows, posed))
    return ComparedScenario(name=name, trials=trials, unposed=trials - reached, methods=ranked)


def _summary(method: str, rows: pd.DataFrame, bound: Array | None) -> MethodSummary:
    names = ("expected", "wrong", "wrong_sign", "refused_rightly", "refused_wrongly", *(f"within {s}" for s in SOLVED))
    count = {name: int(rows[name].to_numpy(bool).sum()) for name in names}
    wanted = max(count["expected"], 1)
    calls = rows.drop_duplicates("trial")
    failures = dict(Counter(calls["failure"].dropna().tolist()))
    crashes, time_outs = sum(failures.get(kind, 0) for kind in CRASHES), failures.get(TIME_OUT, 0)
    return MethodSummary(
        method=method,
        trials=len(calls),
        wanted=count["expected"],
        score=(count[f"within {RANKED_BY}"] - count["wrong"]) / wanted,
        solved=tuple(count[f"within {share}"] / wanted for share in SOLVED),
        refused_rightly=count["refused_rightly"],
        refused_wrongly=count["refused_wrongly"],
        wrong_claims=count["wrong"],
        wrong_signs=count["wrong_sign"],
        crashes=crashes,
        time_outs=time_outs,
        misfits=sum(failures.values()) - crashes - time_outs,
        failures=failures,
        seconds=float(np.median(calls["seconds"].to_numpy())) if len(calls) else None,
        joints=tuple(_joint(each, rows.query("joint == @each"), bound) for each in np.unique(rows["joint"]).tolist()),
    )


def _joint(joint: int, rows: pd.DataFrame, bound: Array | None) -> MethodJoint:
    error = rows.loc[rows["claimed"], "rel_error"].to_numpy(np.float64)
    off, std, true = rows.loc[rows["claimed"] & rows["std"].notna(), ["off", "std", "true"]].to_numpy(np.float64).T
    claimed = _rms(std / true)
    spread = float(np.std(error, ddof=1)) if len(error) > 1 else None
    least = None if bound is None or not np.isfinite(bound[joint - 1]) else float(bound[joint - 1])
    return MethodJoint(
        joint=joint,
        expected=int(rows["expected"].to_numpy(bool).sum()),
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
