"""The result of a run or an identification: gains, their intervals, verdicts and reasons for refusals."""

from collections.abc import Iterable, Mapping, Sequence
from operator import itemgetter
from typing import TYPE_CHECKING

from pydantic import Field

from ident.diagnosis.diagnosis import SPOILS, Severity, two_digits
from ident.diagnosis.gain_checks import IMPLAUSIBLE, LINK_MASSES
from ident.estimation.estimate import GainCurve, GainEstimate, IdentifiedGain
from ident.identification import Identification, refused_for_faults
from ident.model.parameters import INERTIAL, UNITS
from ident.parameters.weighing import GainsOutcome
from ident.payload.payload import standard_parameters
from ident.unseen import Unseen
from scenarios.experiments.verdict import GainVerdict
from scenarios.rendering.content import Cell, ColumnOf, Heading, Mood, Paragraph, Part, Table, column, table, verdict
from scenarios.rendering.plot import Plot, intervals_plot
from scenarios.rendering.result import NAME, VALUE, FromOne, ResultModel
from scenarios.rendering.wording import in_unit, joints_named, many, percent, rounded, sentence, two_sigma
from scenarios.results.cost import ResultCost
from scenarios.results.diagnoses import (
    MOODS,
    REFUSED,
    DiagnosedResult,
    doubt_paragraphs,
    horizon_fold,
    unseen_parts,
    unseen_verdict,
)

if TYPE_CHECKING:  # the simulator is not needed by a process that only identifies
    from scenarios.experiments.run import Run
    from scenarios.experiments.schema import SourceTable

MEANING = (
    "A unit is that of the logged current. 2 sigma: two standard deviations of the gain, from the residual, the "
    "payload's specified uncertainty and the model."
)
WITHOUT_MODEL = " Errors of geometry, friction law and elasticity are not included."
JUDGED = ("true", "rel_error", "z", "tolerance", "passed")
"""What needs a true value."""
SHARES = {"residual_std": "residual", "payload_std": "payload", "model_std": "model"}
"""Contributions to a standard deviation, with their words."""


class ResultGain(GainVerdict):
    """One joint's gain, with its unit, the contributions to its interval, and its curve."""

    name: str | None = Field(None, description="Name of the joint in the robot's model")
    unit: str = Field("N m/unit", description="Unit of the gains: N m, of a prismatic joint N, per drive unit")
    residual_std: float | None = Field(None, description="Contribution of the residuals to `std`, in `unit`")
    payload_std: float | None = Field(None, description="Contribution of the payload's uncertainty, in `unit`")
    model_std: float | None = Field(None, description="Contribution of the model's assumptions, in `unit`")
    predicted_rel_std: float | None = Field(None, description="Predicted relative standard deviation of the gain")
    residual_share: float | None = Field(None, description="Ratio of the norms of residuals and currents")
    curve: GainCurve | None = Field(None, description="Gain over current, by laws that correct it; null if constant")

    @classmethod
    def of(cls, j: int, estimate: GainEstimate, *, revolute: bool) -> "ResultGain":
        """Return the result of a joint, from 0, whose true gain is unknown."""
        found = estimate.joints[j]
        known = {name: getattr(found, name, None) for name in ("reason", "std", *SHARES, "predicted_rel_std", "curve")}
        return cls(
            joint=j + 1,
            name=found.joint,
            unit="N m/unit" if revolute else "N/unit",
            estimate=getattr(found, "value", None),
            identifiable=isinstance(found, IdentifiedGain),
            residual_share=estimate.residual_share(j),
            **known | dict.fromkeys(JUDGED),
        )

    def rel(self, name: str) -> float | None:
        """Return a standard deviation relative to the estimate, None if refused."""
        std: float | None = getattr(self, name)
        return None if std is None or self.estimate is None else std / abs(self.estimate)

    @property
    def excess(self) -> float:
        """Ratio of the error to its tolerance."""
        return abs(self.rel_error or 0.0) / (self.tolerance or 1.0)


class ResultParameter(ResultModel):
    """A parameter of the payload that the method also estimates."""

    parameter: str = Field(validation_alias=NAME, description="Name of the parameter: XX to ZZ, MX, MY, MZ or M")
    true: float | None = Field(None, description="True value, null if unknown [kg m^2, kg m or kg]")
    estimate: float = Field(validation_alias=VALUE, description="Estimate [kg m^2, kg m or kg]")
    std: float = Field(description="Standard deviation, including that of the gains [kg m^2, kg m or kg]")


class ResultFit(ResultModel):
    """Quality of the fit."""

    method: str = Field(description="Name of the estimator")
    rows: int = Field(description="Number of rows of the linear systems of all joints")
    error_norm: float = Field(description="Norm of the residuals of all joints [drive units]")
    rel_error_norm: float = Field(description="Ratio of this norm to the norm of the currents")
    sigma: float = Field(description="Standard deviation of the residuals of all joints [drive units]")


class ResultTiming(ResultModel):
    """Wall times [s]."""

    simulate_s: float | None = Field(description="Time of the simulation of all motions [s]")
    identify_s: float = Field(description="Time of the identification [s]")


class Result(DiagnosedResult):
    """What `rx90 run --json` and `rx90 identify --json` print."""

    scenario: str | None = Field(description="Name of the scenario")
    seed: int | None = Field(description="Seed of every random number")
    passed: bool | None = Field(description="The verdict")
    gains: list[ResultGain] = Field(description="One entry per joint, in order")
    payload: list[ResultParameter] = Field(description="Parameters of the payload, if the method estimates them")
    fit: ResultFit = Field(description="Quality of the fit")
    timing: ResultTiming = Field(description="Wall times")
    notes: list[str] = Field(default_factory=list[str], description="What the method selected, and remarks")
    cost: ResultCost | None = Field(None, description="Results with assumed gains, null if not requested")
    sources: str | None = Field(None, description="Which of the scenario's error sources were simulated, null without")
    mass: float | None = Field(None, description="Specified mass of the payload [kg], null if not one alone is known")
    unseen: FromOne[Unseen] | None = Field(None, description="Prediction of an unseen motion, null if none is given")

    @classmethod
    def of_run(cls, run: "Run") -> "Result":
        """Return the result of a run, with true values."""
        result, cost, scenario = cls.of_identification(run.identification, run.identify_s), run.cost, run.setup.scenario
        for gain, judged in zip(result.gains, run.verdict.gains, strict=True):
            for name in (*JUDGED, "reason"):
                setattr(gain, name, getattr(judged, name))
        bodies = [*run.setup.true_payloads.values()]
        if len(bodies) == 1:  # with several payloads, a name is ambiguous
            numbers = standard_parameters(bodies[0].mass, bodies[0].com, bodies[0].inertia).tolist()
            true = dict(zip(map(str, INERTIAL), numbers, strict=True))
            for each in result.payload:
                each.true = true[each.parameter]
        result.scenario, result.seed, result.passed = scenario.name, run.seed, run.passed
        result.timing.simulate_s = run.simulate_s
        result.sources = sources_simulated(scenario.table.sources)
        result.cost = None if cost is None else ResultCost.of(cost.assumed, run.estimate.joints, cost)
        return result

    @classmethod
    def of_identification(
        cls, found: Identification, identify_s: float, assumed: GainsOutcome | None = None, unseen: Unseen | None = None
    ) -> "Result":
        """Return the result of an identification, without true values. `identify_s` is a wall time [s]."""
        estimate, prepared = found.estimate, found.prepared
        revolute, masses = [True] * len(estimate.joints), set[float]()
        if prepared is not None:
            revolute = prepared.problem.structure.arm.revolute.tolist()
            payloads = {each.payload for each in prepared.motions}
            masses = {each.mass for each in payloads if each is not None and each.known != "none"}
        return cls(
            scenario=None,
            seed=None,
            passed=None,
            gains=[ResultGain.of(j, estimate, revolute=turns) for j, turns in enumerate(revolute)],
            payload=list(map(ResultParameter.model_validate, estimate.payload)),
            fit=ResultFit.model_validate(estimate),
            timing=ResultTiming(simulate_s=None, identify_s=identify_s),
            notes=list(found.notes),
            cost=None if assumed is None else ResultCost.of(assumed, estimate.joints),
            mass=masses.pop() if len(masses) == 1 else None,
            unseen=unseen,
            **cls.values_of(found.found),
        )

    @property
    def judged(self) -> bool:
        """Whether true gains are known."""
        return all(gain.true is not None for gain in self.gains)

    def parts(self) -> Iterable[Part]:
        """Verdict, gains, meaning of units and interval, findings, refusals, effect of the assumed gains, plots."""
        found, unit, gains = self.found, common_unit([gain.unit for gain in self.gains]), self.gains
        if self.judged and self.cost is not None:
            yield self.cost.verdict()
            yield self.cost.plot_of_masses()
        yield self._conclusion() if self.judged else self._summary()
        yield from unseen_verdict(self.unseen)
        yield Heading("Gains", file_only=True)
        yield self._table(unit)
        yield Paragraph(MEANING + (WITHOUT_MODEL if any(gain.model_std == 0.0 for gain in gains) else ""))
        yield from doubt_paragraphs(found)
        yield from (Paragraph(sentence(f"Note: {note}")) for note in self.notes)
        yield from self.undetected_note("; rx90 check --all lists the others")
        simulated = "" if self.timing.simulate_s is None else f"simulated in {self.timing.simulate_s:.2f} s, "
        yield Paragraph(
            f"{self.fit.rows} rows by {self.fit.method}, relative residual {100.0 * self.fit.rel_error_norm:.2f} %; "
            f"{simulated}identified in {self.timing.identify_s:.2f} s."
        )
        if any(gain.identifiable for gain in gains):
            yield self._interval_plot()
        yield from self.every_check("Diagnoses")
        yield from horizon_fold(self.excluded, self.untold, file_only=True)
        refused = [gain for gain in gains if gain.reason is not None]
        yield from [Heading("Refused or failed joints", file_only=True)] if refused else ()
        yield from (Paragraph(sentence(f"Joint {gain.joint}: {gain.reason}")) for gain in refused)
        yield from self._changed()
        if self.payload:
            yield quantity_table((p.parameter, UNITS[p.parameter], p.estimate, 2.0 * p.std) for p in self.payload)
        if self.unseen is not None:
            yield Heading("A motion that was not used in any fit", file_only=True)
            yield from unseen_parts(self.unseen)
        if self.cost is not None:
            yield Heading("Effect of assumed gains", file_only=True)
            yield from self.cost.parts(unit)

    def _conclusion(self) -> Paragraph:
        """Return the verdict on gains whose true values are known."""
        failed = [gain for gain in self.gains if not gain.passed]
        found, refused = ([x for x in failed or self.gains if x.identifiable is given] for given in (True, False))
        sized = [gain for gain in found if not failed or gain.excess > 1.0]
        unexpected, said = [gain for gain in found if gain not in sized], list[str]()
        if sized:
            most = max(sized, key=lambda gain: gain.excess)
            worst = f"worst: joint {most.joint}, " if sized[1:] else ""
            worst += f"{two_digits(100.0 * (most.rel_error or 0.0), sign='+')} %"
            who = f"{_named(sized)} beyond" if failed else f"{many(len(sized), 'gain')} within"
            said.append(f"{who} tolerance ({worst}, tolerance {100.0 * (most.tolerance or 0.0):.3g} %)")
        expected = "where the scenario expects a gain" if failed else "as the scenario expects"
        said += [f"{_named(unexpected)} identified, where the scenario expects a refusal"] if unexpected else []
        said += [f"{_named(refused)} refused, {expected}"] if refused else []
        said.append(f"{said.pop()}. {self.sources}" if self.sources else said.pop())
        return verdict("; ".join(said), not failed)

    def _summary(self) -> Paragraph:
        """Return a sentence on the number of gains, the quality of the fit, gains refused for a fault, and findings."""
        found, count = self.found, sum(gain.identifiable for gain in self.gains)
        said = f"{count} of {len(self.gains)} gains identified"
        if intervals := {gain.joint: 200.0 * (gain.rel("std") or 0.0) for gain in self.gains if gain.identifiable}:
            worst = max(intervals, key=intervals.__getitem__)
            sizes = " to ".join(dict.fromkeys(map(two_digits, (min(intervals.values()), intervals[worst]))))
            said += f", ±{sizes} %" + (f" (worst: joint {worst})" if intervals.keys() - {worst} else "")
            if self.mass is not None:
                best = min(intervals, key=intervals.__getitem__)
                error = two_digits(0.01 * intervals[best] * self.mass)
                said += f"; joint {best} alone weighs the {self.mass:.4g} kg to ±{error} kg"
        said += f"; {joints_named(self._in_doubt)} in doubt" if self._in_doubt and not self.judged else ""
        lost = [joint + 1 for joint in refused_for_faults(found.diagnoses)]
        said += f"; {joints_named(lost)} refused because of a fault of the logs." if lost else "."
        if found.findings:
            return Paragraph(f"{said} See {self.counted} below.", MOODS[found.severity], strong=True)
        return Paragraph(said, Mood.BAD if lost else Mood.PLAIN, strong=True)

    @property
    def _in_doubt(self) -> list[int]:
        """Joints, from 1, whose gains are implausible, by a warning; link masses doubt the payload, hence all gains."""
        weak = [each for each in self.diagnoses if each.severity is Severity.WEAK and each.name in IMPLAUSIBLE]
        joints = {j for each in weak for j in (range(len(self.gains)) if each.name == LINK_MASSES else each.joints)}
        return sorted(j + 1 for j in joints if self.gains[j].identifiable)

    def _changed(self) -> list[Paragraph]:
        """Return gains that a fault changes by less than the limit: each joint once, with the largest effect."""
        largest = dict[int, float]()
        for wrong in self.diagnoses:
            for each in wrong.effects if wrong.severity is Severity.WRONG else ():
                if each.matters and self.gains[each.joint].identifiable:
                    largest[each.joint] = max(largest.get(each.joint, 0.0), each.percent, key=abs)
        moved = ", ".join(f"joint {j + 1} by {two_digits(largest[j], sign='+')} %" for j in sorted(largest))
        said = f"Gains kept although a fault changes them, by less than {SPOILS:g} standard deviations: {moved}."
        return [Paragraph(said, Mood.DOUBTFUL)] if moved else []

    def _table(self, unit: str) -> Table:
        """Return the table of gains, beside the injected ones if these are known; contributions only in files."""
        judged, alike = self.judged, len({gain.tolerance for gain in self.gains if gain.identifiable}) < 2

        def verdict(gain: ResultGain) -> Cell:
            if judged and not gain.passed:
                return Cell("FAILED", Mood.BAD)
            if not judged and gain.identifiable and gain.joint in self._in_doubt:
                return Cell("in doubt", Mood.DOUBTFUL)
            return Cell("passed" if judged else "identified", Mood.GOOD) if gain.identifiable else REFUSED

        def value(title: str, name: str) -> ColumnOf[ResultGain]:
            return column(f"{title} [{unit}]", lambda gain: rounded(getattr(gain, name), gain.std and 2.0 * gain.std))

        def share(title: str, name: str, *, file_only: bool = False) -> ColumnOf[ResultGain]:
            return column(f"{title} [%]", lambda gain: two_sigma(gain.rel(name)), file_only=file_only)

        columns: list[ColumnOf[ResultGain]] = [column("Joint", lambda gain: gain.joint)]
        if judged:
            columns += [value("Injected", "true"), value("Identified", "estimate"), share("2 sigma", "std")]
            columns += [column("Error [%]", lambda gain: percent(gain.rel_error, "+.3f"))]
        else:
            columns.append(column("Name", lambda gain: gain.name or "", words=True))
            columns += [value("Gain", "estimate"), share("2 sigma", "std")]
        columns += [share(f"From {words}", name, file_only=True) for name, words in SHARES.items()]
        if judged:
            columns += [column("Tolerance [%]", lambda gain: percent(gain.tolerance, ".3g"), file_only=alike)]
        else:
            columns += [column("Residual [% of rms]", lambda gain: percent(gain.residual_share, ".1f"))]
        return table(self.gains, *columns, column("Verdict", verdict, words=True))

    def _interval_plot(self) -> Plot:
        """Return the plot of errors with tolerances; without true gains, of gains relative to assumed ones if any."""
        nominal = {} if self.cost is None else {each.joint: each.assumed_gain for each in self.cost.joints}
        stated, joints = any(nominal.values()), [gain.joint for gain in self.gains]  # a refused one is empty
        ends, allowed = dict[int, tuple[float, float, float]](), dict[int, tuple[float, float, float]]()
        for gain in self.gains:
            middle = gain.true if self.judged else nominal.get(gain.joint) if stated else gain.estimate
            if gain.estimate is not None and middle:
                away = 100.0 * (gain.rel_error or 0.0 if self.judged else gain.estimate / middle - 1.0)
                reach = 200.0 * (gain.std or 0.0) / abs(middle)
                ends[gain.joint] = away, away - reach, away + reach
                limit = 100.0 * (gain.tolerance or 0.0)
                allowed[gain.joint] = 0.0, -limit, limit
        bar, line = "plus and minus two standard deviations, all contributions included.", 0.0 if stated else None
        if self.judged:
            title, series = "Error of each gain, with its interval", {"Error, 2 sigma": ends, "Tolerance": allowed}
            caption = f"Error: identified minus injected gain, {bar} It should contain zero in 19 of 20 cases."
            return intervals_plot(title, caption, "Error [%]", joints, series)
        of = "the assumed gain" if stated else "the gain"
        title, y, series = f"Interval of each gain, relative to {of}", f"Gain [% from {of}]", {"Gain, 2 sigma": ends}
        caption = f"Bar: {bar} Refused joints have no number." + " Dashed: the assumed gain." * stated
        return intervals_plot(title, caption, y, joints, series, limit=line)


def sources_simulated(sources: "Mapping[str, SourceTable]") -> str | None:
    """Return a sentence on the error sources of a scenario that its runs include: noises of the scenario's own size."""
    on = [name for name, each in sources.items() if each.stream is not None and each.size is None]
    many_on = f"Errors simulated: {', '.join(on) or 'none'} ({len(on)} of {len(sources)} sources"
    return f"{many_on}; rx90 predict estimates the others)" if sources else None


def _named(gains: Sequence[ResultGain]) -> str:
    return joints_named([gain.joint for gain in gains])


def common_unit(units: Sequence[str]) -> str:
    """Return the unit of a column of gains."""
    return units[0] if len(set(units)) == 1 else "N (m)/unit"


def quantity_table(rows: Iterable[tuple[str, str, float | None, *tuple[float | None, ...]]]) -> Table:
    """Return a payload's table: name, unit, value, uncertainty, which rounds the row, contributions to this."""
    shown: list[tuple[str, ...]] = []
    for name, own, *stated in rows:
        unit, numbers = in_unit(own, *stated)
        value, spread, *shares = (rounded(each, numbers[1]) for each in numbers)
        shown.append((name, value, spread, unit, *shares))
    titles = ("Payload", "Estimate", "2 sigma", "Unit", "From residual", "From gains", "From model")
    count = max(map(len, shown), default=4)
    heads = (column(titles[k], itemgetter(k), words=k in (0, 3), file_only=k > 3) for k in range(count))
    return table(shown, *heads)


def budget_verdict(joints: Sequence[tuple[int, float | None, float, str | None]]) -> Paragraph:
    """Return a sentence on the size of errors, the joints within tolerance, and the dominant sources.

    The arguments have for each joint: number, relative rms error, tolerance, largest source or None.
    """
    errors = [100.0 * error for _, error, _, _ in joints if error is not None]
    if not errors:
        return Paragraph("No joint has a gain with all sources on.", Mood.BAD, strong=True)
    size = " to ".join(dict.fromkeys(two_digits(each) for each in (min(errors), max(errors))))
    limits = {f"{100.0 * tolerance:.3g} %" for _, _, tolerance, _ in joints}
    limit, by_source = limits.pop() if len(limits) == 1 else "tolerance", dict[str, list[int]]()
    met = [joint for joint, error, tolerance, _ in joints if error is not None and error <= tolerance]
    missed = [joint for joint, *_ in joints if joint not in met]
    words = [f"Expected error with all error sources {size} % rms"]
    words += [f"{joints_named(own)} {are} {limit}" for own, are in ((met, "within"), (missed, "beyond")) if own]
    for joint, _, _, source in joints:
        if source is not None:
            by_source.setdefault(source, []).append(joint)
    if by_source:
        words.append(", ".join(f"{source} dominates {joints_named(own)}" for source, own in by_source.items()))
    mood = Mood.DOUBTFUL if met and missed else Mood.BAD if missed else Mood.GOOD
    return Paragraph(f"{'; '.join(words)}.", mood, strong=True)
