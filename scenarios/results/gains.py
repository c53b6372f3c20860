"""The result of a run or an identification: gains, their intervals, verdicts and reasons for refusals."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

from pydantic import Field

from ident.diagnosis.alternative import two_digits
from ident.diagnosis.diagnosis import SPOILS, Severity
from ident.estimation.estimate import FoundParameter, GainEstimate, IdentifiedGain, RefusedGain
from ident.identification import Identification, refused_for_faults
from ident.model.parameters import INERTIAL, UNITS
from ident.parameters.weighing import GainsOutcome
from ident.payload.payload import standard_parameters
from ident.unseen import Unseen
from scenarios.rendering.content import (
    Cell,
    Column,
    ColumnOf,
    Heading,
    Mood,
    Paragraph,
    Part,
    Table,
    cells,
    column,
    in_unit,
    joints_named,
    many,
    percent,
    rounded,
    sentence,
    table,
    two_sigma,
)
from scenarios.rendering.plot import TONES, Axis, Mark, Plot, Series, Tone, about, intervals, values
from scenarios.rendering.result import FromOne, ResultModel
from scenarios.results.cost import ResultCost
from scenarios.results.diagnoses import (
    MOODS,
    DiagnosedResult,
    counted,
    diagnosed_values,
    diagnosis_parts,
    doubt_paragraphs,
)
from scenarios.results.unseen import unseen_parts, unseen_verdict

if TYPE_CHECKING:  # the simulator is not needed by a process that only identifies
    from scenarios.experiments.judge import GainVerdict
    from scenarios.experiments.run import Run

MEANING = (
    "2 sigma: two standard deviations of the gain, from the residual, the payload's specified uncertainty and the "
    "model together. If the model's contribution is zero, errors of geometry, friction law and elasticity are not "
    "included."
)


class ResultGain(ResultModel):
    """One joint's gain; fields that need a true value are null if it is unknown."""

    joint: int = Field(ge=1, description="Number of the joint, from 1")
    true: float | None = Field(description="Injected gain, in `unit`")
    estimate: float | None = Field(description="Identified gain, in `unit`, null if refused")
    std: float | None = Field(description="Total standard deviation of the estimate, in `unit`")
    rel_error: float | None = Field(description="Relative error of the estimate")
    z: float | None = Field(description="Error of the estimate in standard deviations, error over `std`")
    tolerance: float | None = Field(description="Largest relative error that passes")
    identifiable: bool = Field(description="Whether there is an estimate")
    passed: bool | None = Field(description="Whether the result is what the scenario expects")
    reason: str | None = Field(description="Why the joint is refused")
    name: str | None = Field(None, description="Name of the joint in the robot's model")
    unit: str = Field("N m/unit", description="Unit of the gains: N m, of a prismatic joint N, per drive unit")
    residual_std: float | None = Field(None, description="Contribution of the residuals to `std`, in `unit`")
    payload_std: float | None = Field(
        None, description="Contribution of the payload's specified uncertainty, in `unit`"
    )
    model_std: float | None = Field(None, description="Contribution of the model's assumptions, in `unit`")
    predicted_rel_std: float | None = Field(None, description="Predicted relative standard deviation of the gain")
    residual_share: float | None = Field(
        None, description="Ratio of the norms of the joint's residuals and currents, null without rows"
    )

    @classmethod
    def of(cls, joint: int, estimate: GainEstimate, verdict: "GainVerdict | None", unit: str) -> "ResultGain":
        """Return the result of a joint, from 1, with its verdict if the true gain is known."""
        found = estimate.joints[joint - 1]
        gain = found if isinstance(found, IdentifiedGain) else None
        judged = dict.fromkeys(("true", "rel_error", "z", "tolerance", "passed")) | {
            "estimate": gain and gain.value,
            "std": gain and gain.std,
            "identifiable": gain is not None,
            "reason": found.reason if isinstance(found, RefusedGain) else None,
        }
        own = {
            "joint": joint,
            "name": found.joint,
            "unit": unit,
            "residual_std": gain and gain.residual_std,
            "payload_std": gain and gain.payload_std,
            "model_std": gain and gain.model_std,
            "predicted_rel_std": found.predicted_rel_std,
            "residual_share": estimate.residual_share(joint - 1),
        }
        return cls.model_validate({**(judged if verdict is None else asdict(verdict)), **own})


class ResultParameter(ResultModel):
    """A parameter of the payload that the method also estimates."""

    parameter: str = Field(description="Name of the parameter: XX to ZZ, MX, MY, MZ or M")
    true: float | None = Field(
        default=None, description="True value of the mounted payload, null if unknown [kg m^2, kg m or kg]"
    )
    estimate: float = Field(description="Estimate [kg m^2, kg m or kg]")
    std: float = Field(
        description="Standard deviation of the estimate, including that of the gains [kg m^2, kg m or kg]"
    )


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
    cost: ResultCost | None = Field(
        None, description="Results with a-priori and with identified gains, null if not requested"
    )
    unseen: FromOne[Unseen] | None = Field(
        None, description="Prediction of a motion that was not used in any fit, null if none is given"
    )

    @classmethod
    def of_run(cls, run: "Run") -> "Result":
        """Return the result of a run, with true values."""
        bodies = list(run.setup.true_payloads.values())
        true = {}  # with several payloads, a name is ambiguous
        if len(bodies) == 1:
            numbers = standard_parameters(bodies[0].mass, bodies[0].com, bodies[0].inertia).tolist()
            true = dict(zip(map(str, INERTIAL), numbers, strict=True))
        units = gain_units(run.setup.structure.arm.revolute.tolist())
        judged = zip(run.verdict.gains, units, strict=True)
        return cls(
            scenario=run.setup.scenario.name,
            seed=run.seed,
            passed=run.passed,
            gains=[ResultGain.of(j, run.estimate, *each) for j, each in enumerate(judged, 1)],
            payload=_payload(run.estimate.payload, true),
            fit=ResultFit.model_validate(run.estimate, from_attributes=True),
            timing=ResultTiming(simulate_s=run.simulate_s, identify_s=run.identify_s),
            notes=list(run.notes),
            cost=None if run.cost is None else ResultCost.of_verdict(run.cost, run.estimate.joints),
            **diagnosed_values(run.found),
        )

    @classmethod
    def of_identification(
        cls,
        found: Identification,
        identify_s: float,
        a_priori: GainsOutcome | None = None,
        unseen: Unseen | None = None,
    ) -> "Result":
        """Return the result of an identification, without true values. `identify_s` is a wall time [s]."""
        estimate, prepared = found.estimate, found.prepared
        revolute = [True] * len(estimate.joints)
        if prepared is not None:
            revolute = prepared.problem.structure.arm.revolute.tolist()
        return cls(
            scenario=None,
            seed=None,
            passed=None,
            gains=[ResultGain.of(j, estimate, None, unit) for j, unit in enumerate(gain_units(revolute), 1)],
            payload=_payload(estimate.payload, {}),
            fit=ResultFit.model_validate(estimate, from_attributes=True),
            timing=ResultTiming(simulate_s=None, identify_s=identify_s),
            notes=list(found.notes),
            cost=None if a_priori is None else ResultCost.of_outcome(a_priori, estimate.joints),
            unseen=unseen,
            **diagnosed_values(found.found),
        )

    @property
    def judged(self) -> bool:
        """Whether true gains are known."""
        return all(gain.true is not None for gain in self.gains)

    def parts(self) -> Iterable[Part]:
        """Verdict, gains, meaning of units and interval, findings, refusals, effect of the a-priori gains, plots."""
        found, unit = self.found, common_unit([gain.unit for gain in self.gains])
        yield conclusion(self.gains) if self.judged else _summary(self)
        if self.unseen is not None:
            yield from unseen_verdict(self.unseen)
        yield Heading("Gains", file_only=True)
        yield _judged_table(self.gains, unit) if self.judged else _identified_table(self.gains, unit)
        yield from _tolerances(self.gains) if self.judged else ()
        yield meaning([gain.unit for gain in self.gains])
        yield from doubt_paragraphs(found)
        yield from (Paragraph(sentence(f"Note: {note}")) for note in self.notes)
        simulated = "" if self.timing.simulate_s is None else f"simulated in {self.timing.simulate_s:.2f} s, "
        yield Paragraph(
            f"{self.fit.rows} rows by {self.fit.method}, relative residual {100.0 * self.fit.rel_error_norm:.2f} %; "
            f"{simulated}identified in {self.timing.identify_s:.2f} s."
        )
        if any(gain.identifiable for gain in self.gains):
            yield _error_plot(self.gains) if self.judged else self._value_plot()
            yield _share_plot(self.gains)
        yield from diagnosis_parts(found)
        refused = [gain for gain in self.gains if gain.reason is not None]
        yield from [Heading("Refused or failed joints", file_only=True)] if refused else ()
        yield from (Paragraph(sentence(f"Joint {gain.joint}: {gain.reason}")) for gain in refused)
        yield from _changed_gains(self)
        yield from _payload_table(self.payload)
        if self.unseen is not None:
            yield Heading("A motion that was not used in any fit", file_only=True)
            yield from unseen_parts(self.unseen)
        if self.cost is not None:
            yield Heading("Effect of a-priori gains", file_only=True)
            yield from self.cost.parts(unit)

    def _value_plot(self) -> Plot:
        believed = {} if self.cost is None else {each.joint: each.a_priori_gain for each in self.cost.joints}
        return _value_plot(self.gains, {joint: gain for joint, gain in believed.items() if gain})


def _payload(found: tuple[FoundParameter, ...], true: Mapping[str, float]) -> list[ResultParameter]:
    return [
        ResultParameter(parameter=each.name, true=true.get(each.name), estimate=each.value, std=each.std)
        for each in found
    ]


def gain_units(revolute: Sequence[bool]) -> list[str]:
    """Return the unit of each joint's gain."""
    return ["N m/unit" if each else "N/unit" for each in revolute]


def common_unit(units: Sequence[str]) -> str:
    """Return the unit of a column of gains."""
    return units[0] if len(set(units)) == 1 else "N (m)/unit"


def meaning(units: Sequence[str]) -> Paragraph:
    """Return the meaning of a table of gains with these units: units and interval."""
    sliding = [joint for joint, unit in enumerate(units, 1) if unit == "N/unit"]
    if len(sliding) == len(units):
        return Paragraph(f"Gains in N per drive unit. {MEANING}")
    apart = f", of prismatic {joints_named(sliding)} in N per drive unit" if sliding else ""
    return Paragraph(f"Gains in N m per drive unit{apart}. {MEANING}")


def conclusion(gains: Sequence[ResultGain]) -> Paragraph:
    """Return the verdict on gains whose true values are known, in a sentence."""
    failed = [gain for gain in gains if not gain.passed]
    found = [gain for gain in failed or gains if gain.identifiable]
    refused = [gain.joint for gain in failed or gains if not gain.identifiable]
    said = list[str]()
    if not failed:
        said += [f"{many(len(found), 'gain')} within tolerance ({_worst(found)})"] if found else []
        said += [f"{joints_named(refused)} refused, as the scenario expects"] if refused else []
        return Paragraph(f"PASSED: {'; '.join(said)}.", Mood.GOOD, strong=True)
    off = [gain for gain in found if _excess(gain) > 1.0]
    unexpected = [gain.joint for gain in found if _excess(gain) <= 1.0]
    if off:
        exceed = "exceed their" if off[1:] else "exceeds its"
        said.append(f"{joints_named([gain.joint for gain in off])} {exceed} tolerance ({_worst(off)})")
    said += [f"{joints_named(unexpected)} identified, where the scenario expects a refusal"] if unexpected else []
    said += [f"{joints_named(refused)} refused, where the scenario expects a gain"] if refused else []
    return Paragraph(f"FAILED: {'; '.join(said)}.", Mood.BAD, strong=True)


def _excess(gain: ResultGain) -> float:
    """Return the ratio of a gain's error to its tolerance."""
    return abs(gain.rel_error or 0.0) / (gain.tolerance or 1.0)


def _worst(gains: Sequence[ResultGain]) -> str:
    """Return the gain with the largest ratio of error to tolerance, in words."""
    worst = max(gains, key=_excess)
    which = f"worst: joint {worst.joint}, " if gains[1:] else ""
    error = two_digits(100.0 * (worst.rel_error or 0.0), sign="+")
    return f"{which}{error} %, tolerance {100.0 * (worst.tolerance or 0.0):.3g} %"


def _tolerances(gains: Sequence[ResultGain]) -> list[Paragraph]:
    """Return the tolerances of gains if they differ; otherwise the verdict contains the tolerance."""
    each = {gain.joint: percent(gain.tolerance, ".3g") for gain in gains if gain.identifiable}
    listed = ", ".join(f"{size} % (joint {joint})" for joint, size in each.items())
    return [Paragraph(f"Tolerances: {listed}.")] if len(set(each.values())) > 1 else []


def _summary(result: Result) -> Paragraph:
    """Return a sentence on the number of gains, the quality of the fit, gains refused for a fault, and findings."""
    found, share = result.found, 100.0 * result.fit.rel_error_norm
    count = sum(gain.identifiable for gain in result.gains)
    said = (
        f"{count} of {len(result.gains)} gains identified from {result.fit.rows} rows, relative residual {share:.2f} %"
    )
    lost = [joint + 1 for joint in refused_for_faults(found.diagnoses)]
    said += f"; {joints_named(lost)} refused because of a fault of the logs." if lost else "."
    if found.findings:
        return Paragraph(f"{said} See {counted(found)} below.", MOODS[found.severity], strong=True)
    return Paragraph(said, Mood.BAD if lost else Mood.PLAIN, strong=True)


def _changed_gains(result: Result) -> list[Paragraph]:
    """Return gains that a fault changes by less than the limit: each joint once, with the largest effect."""
    largest = dict[int, float]()
    for wrong in result.diagnoses:
        for each in wrong.effects if wrong.severity is Severity.WRONG else ():
            if each.matters and result.gains[each.joint].identifiable:
                largest[each.joint] = max(largest.get(each.joint, 0.0), each.percent, key=abs)
    moved = [f"joint {joint + 1} by {two_digits(largest[joint], sign='+')} %" for joint in sorted(largest)]
    said = f"Gains kept although a fault changes them, by less than {SPOILS:g} standard deviations: {', '.join(moved)}."
    return [Paragraph(said, Mood.DOUBTFUL)] if moved else []


def _interval_columns() -> tuple[ColumnOf[ResultGain], ...]:
    """Return the columns of a gain's interval and of its contributions (only in files), in percent of the gain."""

    def share(gain: ResultGain, std: float | None) -> str:
        return two_sigma(None if std is None or gain.estimate is None else std / abs(gain.estimate))

    return (
        column("2 sigma [%]", lambda gain: share(gain, gain.std)),
        column("From residual [%]", lambda gain: share(gain, gain.residual_std), file_only=True),
        column("From payload [%]", lambda gain: share(gain, gain.payload_std), file_only=True),
        column("From model [%]", lambda gain: share(gain, gain.model_std), file_only=True),
    )


def _judged_table(gains: Sequence[ResultGain], unit: str) -> Table:
    """Return the table of injected and identified gains."""
    interval, *shares = _interval_columns()

    def verdict(gain: ResultGain) -> Cell:
        if not gain.passed:
            return Cell("FAILED", Mood.BAD)
        return Cell("passed" if gain.identifiable else "refused", Mood.GOOD)

    return table(
        gains,
        column("Joint", lambda gain: gain.joint),
        column(f"Injected [{unit}]", lambda gain: rounded(gain.true, gain.std and 2.0 * gain.std)),
        column(f"Identified [{unit}]", lambda gain: rounded(gain.estimate, gain.std and 2.0 * gain.std)),
        interval,
        column("Error [%]", lambda gain: percent(gain.rel_error, "+.3f")),
        *shares,
        column("Tolerance [%]", lambda gain: percent(gain.tolerance, ".3g"), file_only=True),
        column("Verdict", verdict, words=True),
    )


def _identified_table(gains: Sequence[ResultGain], unit: str) -> Table:
    """Return the table of gains whose true values are unknown."""
    found, refused = Cell("identified", Mood.GOOD), Cell("refused", Mood.DOUBTFUL)
    return table(
        gains,
        column("Joint", lambda gain: gain.joint),
        column("Name", lambda gain: gain.name or "", words=True),
        column(f"Gain [{unit}]", lambda gain: rounded(gain.estimate, gain.std and 2.0 * gain.std)),
        *_interval_columns(),
        column("Residual [% of rms]", lambda gain: percent(gain.residual_share, ".1f")),
        column("Verdict", lambda gain: found if gain.identifiable else refused, words=True),
    )


def quantity_row(
    name: str, unit: str, value: float | None, spread: float | None, *shares: float | None
) -> tuple[Cell, ...]:
    """Return the cells of a number, of its uncertainty, of the unit, and of shares, all rounded by the uncertainty."""
    shown, numbers = in_unit(unit, value, spread, *shares)
    estimate, own, *others = (rounded(each, numbers[1]) for each in numbers)
    return cells(name, estimate, own, shown, *others)


def _payload_table(found: Sequence[ResultParameter]) -> list[Table]:
    """Return a table of the payload parameters that a method also estimated, if any."""
    rows = tuple(quantity_row(p.parameter, UNITS[p.parameter], p.estimate, 2.0 * p.std) for p in found)
    columns = (
        Column(title="Payload", words=True),
        Column(title="Estimate"),
        Column(title="2 sigma"),
        Column(title="Unit", words=True),
    )
    return [Table(columns=columns, rows=rows)] if rows else []


def _error_plot(gains: Sequence[ResultGain]) -> Plot:
    """Return the plot of errors with their intervals and the tolerance; joints without a gain are empty."""
    found = [gain for gain in gains if gain.rel_error is not None]
    there = [str(gain.joint) for gain in found]
    errors = [about(100.0 * (g.rel_error or 0.0), 200.0 * (g.std or 0.0) / abs(g.true or 1.0)) for g in found]
    return Plot(
        title="Error of each gain, with its interval",
        caption=(
            "Point: identified minus injected gain. Bar: plus and minus two standard deviations, all contributions "
            "included. A 95 % interval should contain zero in 19 of 20 cases. Wide band: tolerance."
        ),
        x=Axis(title="joint", categories=tuple(str(gain.joint) for gain in gains)),
        y=Axis(title="error", unit="%", zero=True),
        series=(
            intervals("Tolerance", there, [about(0.0, 100.0 * (gain.tolerance or 0.0)) for gain in found], Tone.QUIET),
            intervals("Error, 2 sigma", there, errors, Tone.FIRST),
        ),
    )


def _value_plot(gains: Sequence[ResultGain], nominal: Mapping[int, float]) -> Plot:
    """Return the plot of gains with intervals in percent, relative to a-priori gains if there are any."""
    middle = {gain.joint: nominal.get(gain.joint) if nominal else gain.estimate for gain in gains}
    found = [(g.joint, g.estimate, g.std or 0.0, middle[g.joint]) for g in gains if g.estimate is not None]
    of = "the a-priori gain" if nominal else "the gain"
    there = [(j, about(100.0 * (value / m - 1.0), 200.0 * std / abs(m))) for j, value, std, m in found if m]
    return Plot(
        title=f"Interval of each gain, relative to {of}",
        caption=(
            "Bar: plus and minus two standard deviations, all contributions included. Refused joints have no number."
        ),
        x=Axis(title="joint", categories=tuple(str(gain.joint) for gain in gains)),
        y=Axis(title="gain", unit=f"% from {of}", zero=True),
        series=(intervals("Gain, 2 sigma", [str(joint) for joint, _ in there], [e for _, e in there], Tone.FIRST),),
    )


def _share_plot(gains: Sequence[ResultGain]) -> Plot:
    """Return the plot of the contributions to each interval."""
    found = [(gain, abs(gain.estimate)) for gain in gains if gain.estimate is not None]
    shares = {
        "Residual": [(gain.residual_std or 0.0) / size for gain, size in found],
        "Payload": [(gain.payload_std or 0.0) / size for gain, size in found],
        "Model": [(gain.model_std or 0.0) / size for gain, size in found],
    }
    there = tuple(str(gain.joint) for gain, _ in found)
    return Plot(
        title="Contributions to the intervals",
        caption="Two standard deviations of each contribution; the half-width of the interval is the root of the sum "
        "of their squares.",
        x=Axis(title="joint", categories=tuple(str(gain.joint) for gain in gains)),
        y=Axis(title="2 sigma", unit="%", zero=True),
        series=tuple(
            Series(label=label, mark=Mark.BARS, tone=tone, x=there, y=values([200.0 * share for share in numbers]))
            for (label, numbers), tone in zip(shares.items(), TONES, strict=False)
        ),
    )


def budget_verdict(joints: Sequence[tuple[int, float | None, float, str | None]]) -> Paragraph:
    """Return a sentence on the size of errors, the joints within tolerance, and the dominant sources.

    The arguments have for each joint: number, relative rms error, tolerance, largest source or None.
    """
    errors = [100.0 * error for _, error, _, _ in joints if error is not None]
    by_source = dict[str, list[int]]()
    for joint, _, _, source in joints:
        if source is not None:
            by_source.setdefault(source, []).append(joint)
    if not errors:
        return Paragraph("No joint has a gain with all sources on.", Mood.BAD, strong=True)
    size = " to ".join(dict.fromkeys(two_digits(each) for each in (min(errors), max(errors))))
    tolerances = {100.0 * tolerance for _, _, tolerance, _ in joints}
    missed = [joint for joint, error, tolerance, _ in joints if error is None or error > tolerance]
    met = [joint for joint, *_ in joints if joint not in missed]
    mood = Mood.DOUBTFUL if met and missed else Mood.BAD if missed else Mood.GOOD
    few = len(met) < len(missed)
    who = "every joint" if met else "no joint"
    if met and missed:
        who = f"only {joints_named(met)}" if few else f"all but {joints_named(missed)}"
    several = met and missed and not (few and len(met) == 1)
    meets, own = ("meet", "their tolerance") if several else ("meets", "its tolerance")
    aim = f"{tolerances.pop():.3g} %" if len(tolerances) == 1 else own
    words = [f"Expected error {size} % rms: {who} {meets} {aim}"]
    if by_source:
        (first, its), *others = by_source.items()
        dominates = [f"{source} {joints_named(which)}" for source, which in others]
        words.append(", ".join([f"{first} dominates {joints_named(its)}", *dominates]))
    return Paragraph(f"{'; '.join(words)}.", mood, strong=True)
