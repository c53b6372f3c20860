"""Report of `rx90 run`: verdict, injected and identified gains, reasons."""

from collections.abc import Sequence

from ident.diagnosis.alternative import two_digits
from ident.support.arrays import Array
from scenarios.experiments.run import Run
from scenarios.reports.content import Cell, Mood, Paragraph, Part, Report, Table, column, percent, rounded, table
from scenarios.reports.cost import cost_parts
from scenarios.reports.diagnoses import horizon_paragraphs, many
from scenarios.reports.gains import (
    gain_unit,
    interval_columns,
    joints_named,
    note_paragraphs,
    payload_tables,
    reason_paragraph,
)
from scenarios.results.models.gains import ResultGain
from scenarios.results.models.run import Result


def run_report(run: Run) -> Report:
    """Return the report: verdict, table of injected and identified gains, and reasons."""
    scenario, revolute = run.setup.scenario, run.setup.structure.arm.revolute
    result = Result.of_run(run)
    parts: list[Part] = [conclusion(result.gains), judged_table(result.gains, revolute), *_tolerances(result.gains)]
    parts += note_paragraphs(result.notes, run.found, revolute)
    parts += horizon_paragraphs(run.found)
    parts += [reason_paragraph(gain.joint, gain.reason) for gain in result.gains if gain.reason is not None]
    parts += payload_tables(result.payload)
    parts += cost_parts(result.cost, revolute)
    parts.append(
        Paragraph(
            f"{result.fit.rows} rows, relative residual {100.0 * result.fit.rel_error_norm:.2f} %; "
            f"simulated in {run.simulate_s:.2f} s, identified in {run.identify_s:.2f} s."
        )
    )
    title = f"Scenario {scenario.name}, seed {run.seed}: {scenario.table.description}"
    return Report(title, tuple(parts), result.model_dump(mode="json"))


def judged_table(gains: Sequence[ResultGain], revolute: Array) -> Table:
    """Return the table of injected and identified gains; `revolute`, shape (n,), is the mask of revolute joints."""
    unit, (interval, *shares) = gain_unit(revolute), interval_columns()
    return table(
        gains,
        column("Joint", lambda gain: gain.joint),
        column(f"Injected [{unit}]", lambda gain: rounded(gain.true, gain.std and 2.0 * gain.std)),
        column(f"Identified [{unit}]", lambda gain: rounded(gain.estimate, gain.std and 2.0 * gain.std)),
        interval,
        column("Error [%]", lambda gain: percent(gain.rel_error, "+.3f")),
        *shares,
        column("Tolerance [%]", lambda gain: percent(gain.tolerance, ".3g"), file_only=True),
        column("Verdict", _verdict, words=True),
    )


def _verdict(gain: ResultGain) -> Cell:
    if not gain.passed:
        return Cell("FAILED", Mood.BAD)
    return Cell("passed", Mood.GOOD) if gain.identifiable else Cell("refused", Mood.GOOD)


def conclusion(gains: Sequence[ResultGain]) -> Paragraph:
    """Return the verdict in a sentence."""
    if all(gain.passed for gain in gains):
        return Paragraph(f"PASSED: {_passed(gains)}.", Mood.GOOD, strong=True)
    return Paragraph(f"FAILED: {_failed([gain for gain in gains if not gain.passed])}.", Mood.BAD, strong=True)


def _passed(gains: Sequence[ResultGain]) -> str:
    found = [gain for gain in gains if gain.identifiable]
    refused = [gain.joint for gain in gains if not gain.identifiable]
    parts = list[str]()
    if found:
        parts.append(f"{many(len(found), 'gain')} within tolerance ({_worst(found)})")
    if refused:
        parts.append(f"{joints_named(refused)} refused, as the scenario expects")
    return "; ".join(parts)


def _failed(failed: Sequence[ResultGain]) -> str:
    """Return joints that exceed their tolerance, the worst error, and joints contrary to the expectation."""
    off = [gain for gain in failed if gain.identifiable and _excess(gain) > 1.0]
    unexpected = [gain.joint for gain in failed if gain.identifiable and _excess(gain) <= 1.0]
    refused = [gain.joint for gain in failed if not gain.identifiable]
    parts = list[str]()
    if off:
        exceed = "exceed their" if off[1:] else "exceeds its"
        parts.append(f"{joints_named([gain.joint for gain in off])} {exceed} tolerance ({_worst(off)})")
    if unexpected:
        parts.append(f"{joints_named(unexpected)} identified, where the scenario expects a refusal")
    if refused:
        parts.append(f"{joints_named(refused)} refused, where the scenario expects a gain")
    return "; ".join(parts)


def _worst(gains: Sequence[ResultGain]) -> str:
    """Return the gain with the largest ratio of error to tolerance."""
    worst = max(gains, key=_excess)
    which = f"worst: joint {worst.joint}, " if gains[1:] else ""
    error = two_digits(100.0 * (worst.rel_error or 0.0), sign="+")
    return f"{which}{error} %, tolerance {100.0 * (worst.tolerance or 0.0):.3g} %"


def _tolerances(gains: Sequence[ResultGain]) -> list[Paragraph]:
    """Return the tolerances of gains if they differ; otherwise the verdict contains the tolerance."""
    each = {gain.joint: percent(gain.tolerance, ".3g") for gain in gains if gain.identifiable}
    told = ", ".join(f"{size} % (joint {joint})" for joint, size in each.items())
    return [Paragraph(f"Tolerances: {told}.")] if len(set(each.values())) > 1 else []


def _excess(gain: ResultGain) -> float:
    """Return the ratio of a gain's error to its tolerance."""
    return abs(gain.rel_error or 0.0) / (gain.tolerance or 1.0)
