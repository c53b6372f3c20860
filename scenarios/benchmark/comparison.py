"""The result of a comparison: scores, errors and coverage of every method on every scenario.

A gain is wrong if its error exceeds both `FAR` of it and `SURE` of its standard deviations. One that the data should
not identify is wrong unless its error is below both, and its standard deviation below `FAR`. The score is the number of
gains within `RANKED_BY` minus wrong gains, as a share of the gains that the data should identify.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from pydantic import Field

from ident.diagnosis.diagnosis import two_digits
from scenarios.benchmark.study import METHOD
from scenarios.experiments.statistics import Coverage, coverage, error_statistics, root_mean_square
from scenarios.rendering.content import Cell, Heading, Mood, Paragraph, Part, Report, column, table
from scenarios.rendering.plot import SERIES, Plot, draw_bars, intervals_plot
from scenarios.rendering.result import ResultModel
from scenarios.rendering.wording import many, number, percent
from scenarios.results.record import read_result, repeated
from scenarios.results.studies import NORMAL, in_percent

DOCUMENT = "report.json"
NEEDED = (METHOD, "trial", "joint", "true", "estimate", "std", "rel_error", "expected", "seconds", "failure")
"""Columns of the study that the statistics use."""
SOLVED = (0.01, 0.03, 0.10)
"""Largest relative errors of a solved gain."""
RANKED_BY = 0.03
"""The one of them that is used for ranking."""
FAR, SURE = 0.10, 3.0
"""Errors of a wrong gain: a share of it, and a number of its standard deviations."""
RULE = (
    f"Score: the number of gains within {100.0 * RANKED_BY:g} % minus the number of wrong gains, over the number of "
    "gains that the data should determine, so refusing everything scores 0. A gain is wrong if its error exceeds both "
    f"{100.0 * FAR:g} % and {SURE:g} of its estimated standard deviations. If the scenario says that the data do not "
    "determine the gain, it is wrong unless its error is below both limits and its estimated standard deviation is "
    f"below {100.0 * FAR:g} %. A gain lost to a crash, a time-out or an invalid answer is neither solved nor refused. "
    "Time: median of a call, including process start and reading of files."
)
MEANING = (
    "Bias, std: mean and standard deviation of the error. Within: share of trials with an error below two estimated "
    "standard deviations (95.4 % if these are correct)."
)


class MethodJoint(ResultModel):
    """One method on one joint, over all trials; values are null without data."""

    joint: int  # joint number, from 1
    expected: int  # number of trials whose data should identify the gain
    gains: int  # number of trials in which the method gave a gain
    bias: float | None  # mean of the relative error
    spread: float | None  # standard deviation of the relative error
    rms: float | None  # root mean square of the relative error
    p95: float | None  # 95th percentile of the magnitude of the relative error
    cover_1: Coverage | None  # coverage of 1 estimated standard deviation (normal: 0.683)
    cover_2: Coverage | None  # coverage of 2 estimated standard deviations (normal: 0.954)
    claimed: float | None  # root mean square of the estimated relative standard deviation


class MethodSummary(ResultModel):
    """One method on one scenario."""

    method: str  # text that names the method
    trials: int  # number of trials given to it
    wanted: int  # number of gains that their data should identify
    score: float  # number of gains within 3 % minus wrong gains, as a share of `wanted`; 0 if everything is refused
    solved: tuple[float, ...]  # share of the `wanted` gains within 1, 3 and 10 %
    refused_rightly: int  # number of refused gains that the data do not identify
    refused_wrongly: int  # number of refused gains that the data should identify, in valid answers
    wrong_claims: int = Field(
        description="Number of gains with an error above both 10 % and 3 of their standard deviations; of gains that "
        "should not be identifiable, all except those with an error below both and a standard deviation below 10 %"
    )
    wrong_signs: int  # number of gains with the wrong sign
    failures: dict[str, int]  # number of crashes, time-outs and invalid answers by kind
    seconds: float | None  # median wall time of a call [s]; null without a call
    joints: tuple[MethodJoint, ...]  # one entry per joint

    @property
    def rms(self) -> float | None:
        """Root mean square of the relative errors of all gains that it gave, None without any."""
        given = [(each.gains, each.rms**2) for each in self.joints if each.rms is not None]
        return (sum(k * square for k, square in given) / sum(k for k, _ in given)) ** 0.5 if given else None


class ComparedScenario(ResultModel):
    """Results of methods on a scenario."""

    name: str  # name of the scenario
    trials: int  # number of trials given to each method
    unposed: int  # number of these trials that failed before any method was called
    methods: list[MethodSummary] = Field(min_length=1)  # one entry per method, the best score first, then the least rms

    def parts(self) -> Iterable[Part]:
        """Scores and failures of methods, then errors and coverage by joint."""
        yield Heading(f"{self.name}, {many(self.trials, 'trial')}")
        yield from self._plots()
        yield table(
            self.methods,
            column("Method", lambda each: each.method, words=True),
            column("Score [%]", lambda each: percent(each.score, ".1f")),
            column("Rms [%]", lambda each: percent(each.rms, ".3g")),
            *(
                column(f"Within\n{100.0 * share:g} % [%]", lambda each, k=k: percent(each.solved[k], ".1f"))
                for k, share in enumerate(SOLVED)
            ),
            column("Refused\nrightly", lambda each: each.refused_rightly),
            column("Refused\nwrongly", lambda each: each.refused_wrongly),
            column("Wrong\ngains", lambda each: _bad(each.wrong_claims)),
            column("Wrong\nsigns", lambda each: _bad(each.wrong_signs)),
            column("Failed\ncalls", lambda each: _bad(sum(each.failures.values()))),
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
            column("Within\n2 sigma [%]", lambda row: percent(getattr(row[1].cover_2, "share", None), ".1f")),
            column("Estimated\nstd [%]", lambda row: percent(row[1].claimed)),
        )
        if self.unposed:
            yield Paragraph(f"{self.unposed} of them failed before any method was run.")

    def _plots(self) -> Iterable[Plot]:
        best, more = self.methods[: len(SERIES)], len(self.methods) - len(SERIES)
        left = f" {more} more in the table only." if more > 0 else ""
        joints = [each.joint for each in self.methods[0].joints]
        rms = {m.method: {j.joint: 100.0 * j.rms for j in m.joints if j.rms is not None} for m in best}
        held = {m.method: {j.joint: in_percent(j.cover_2) for j in m.joints if j.cover_2 is not None} for m in best}
        yield Plot(
            title="Rms error",
            caption=f"Gains that each method gave; no bar where it gave none.{left}",
            x="Joint",
            y="Rms error [%]",
            draw=partial(draw_bars, joints=joints, series=rms),
        )
        yield intervals_plot(
            "Coverage of two estimated standard deviations",
            f"Bars: 95 % intervals. Dashed: {100.0 * NORMAL:.1f} %, the nominal coverage.{left}",
            "Held [% of gains]",
            joints,
            held,
            limit=100.0 * NORMAL,
        )


class Comparison(ResultModel):
    """What `rx90 compare --json` prints."""

    about: dict[str, str]  # what is needed to repeat the comparison: command, date, versions, external methods
    scenarios: list[ComparedScenario] = Field(min_length=1)  # one entry per scenario

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
        """The best method of each scenario and the next one, every scenario, and how scores are counted."""
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
    """Return the page of a folder; raises `ScenarioError` if its document is damaged, or of another version."""
    found = read_result(folder, Comparison, DOCUMENT)
    others = {key: text for key, text in found.about.items() if key != "Command"}
    return found.report(found.title, *repeated({"Original command": found.about.get("Command", "")}, others, {}))


def _best(methods: Sequence[MethodSummary]) -> str:
    """Return score and rms error of the best method and of the next one; `methods` are in order."""
    rms = ["" if each.rms is None else f" (rms error {two_digits(100.0 * each.rms)} %)" for each in methods]
    said = zip(methods, rms, strict=True)
    return ", ".join([f"{each.method} scores {100.0 * each.score:.1f} %{error}" for each, error in said][:2])


def _bad(count: int) -> Cell:
    return Cell(str(count), Mood.BAD if count else Mood.PLAIN)


def compared(name: str, rows: pd.DataFrame, methods: Sequence[str]) -> ComparedScenario:
    """Compute statistics of a comparison on one scenario; rows have the columns `NEEDED`."""
    posed = rows.dropna(subset=["seconds"]).sort_values("trial", kind="stable")
    estimate, true, std, error = posed[["estimate", "true", "std", "rel_error"]].to_numpy(np.float64).T
    off, expected, claimed = np.abs(estimate - true), posed["expected"].to_numpy(bool), np.isfinite(estimate)
    near, honest = np.abs(error) <= FAR, off <= SURE * std  # without a standard deviation, none is honest
    good = np.where(expected, near | honest, near & honest & (std <= FAR * np.abs(estimate)))
    refused = posed["failure"].isna().to_numpy(bool) & ~claimed
    posed = posed.assign(
        off=off,
        claimed=claimed,
        wrong_claims=claimed & ~good,
        wrong_signs=estimate * true < 0.0,
        refused_rightly=refused & ~expected,
        refused_wrongly=refused & expected,
        **{f"within {share}": expected & (np.abs(error) <= share) for share in SOLVED},
    )
    found = (_summary(method, posed.query(f"{METHOD} == @method")) for method in methods)
    ranked = sorted(found, key=lambda each: (-each.score, np.inf if each.rms is None else each.rms))
    trials, reached = (each["trial"].unique().size for each in (rows, posed))
    return ComparedScenario(name=name, trials=trials, unposed=trials - reached, methods=ranked)


def _summary(method: str, rows: pd.DataFrame) -> MethodSummary:
    counted, within = ("refused_rightly", "refused_wrongly", "wrong_claims", "wrong_signs"), "within {}".format
    count = {name: int(rows[name].to_numpy(bool).sum()) for name in ("expected", *counted, *map(within, SOLVED))}
    wanted, calls = max(count["expected"], 1), rows.drop_duplicates("trial")
    return MethodSummary(
        method=method,
        trials=len(calls),
        wanted=count["expected"],
        score=(count[within(RANKED_BY)] - count["wrong_claims"]) / wanted,
        solved=tuple(count[within(share)] / wanted for share in SOLVED),
        **{name: count[name] for name in counted},
        failures=dict(Counter(calls["failure"].dropna().tolist())),
        seconds=float(np.median(calls["seconds"].to_numpy())) if len(calls) else None,
        joints=tuple(_joint(each, rows.query("joint == @each")) for each in np.unique(rows["joint"]).tolist()),
    )


def _joint(joint: int, rows: pd.DataFrame) -> MethodJoint:
    error = rows.loc[rows["claimed"], "rel_error"].to_numpy(np.float64)
    off, std, true = rows.loc[rows["claimed"] & rows["std"].notna(), ["off", "std", "true"]].to_numpy(np.float64).T
    return MethodJoint(
        joint=joint,
        expected=int(rows["expected"].to_numpy(bool).sum()),
        gains=len(error),
        rms=root_mean_square(error),
        cover_1=coverage(off <= std),
        cover_2=coverage(off <= 2.0 * std),
        **error_statistics(error, std / true),
    )
