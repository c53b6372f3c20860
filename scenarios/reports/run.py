"""What `rx90 run` says: injected against identified gains, the reasons, the verdict."""

from collections.abc import Sequence

from ident.diagnosis.alternative import two_digits
from ident.support.arrays import Array
from scenarios.experiments.run import Run
from scenarios.reports.content import Cell, Column, Mood, Paragraph, Part, Report, Table, cells, number, percent
from scenarios.reports.cost import cost_parts
from scenarios.reports.diagnoses import horizon_paragraphs, many
from scenarios.reports.gains import (
    INTERVAL,
    gain_unit,
    interval,
    joints_named,
    note_paragraphs,
    payload_tables,
    reason_paragraph,
)
from scenarios.results.models.gains import ResultGain
from scenarios.results.models.run import Result


def run_report(run: Run) -> Report:
    """The table of injected against identified gains, the reasons, and the verdict."""
    scenario, revolute = run.setup.scenario, run.setup.structure.arm.revolute
    result = Result.of_run(run)
    parts: list[Part] = [judged_table(result.gains, revolute)]
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
    parts.append(conclusion(result.gains))
    title = f"Scenario {scenario.name}, seed {run.seed}: {scenario.table.description}"
    return Report(title, tuple(parts), result.model_dump(mode="json"))


def judged_table(gains: Sequence[ResultGain], revolute: Array) -> Table:
    """Injected against identified gains.

    Args:
        gains: One a joint, judged.
        revolute: Whether each joint turns, shape (n,).
    """
    rows = tuple(
        cells(
            str(gain.joint),
            number(gain.true, ".4f"),
            number(gain.estimate, ".4f"),
            *interval(gain),
            percent(gain.rel_error, "+.3f"),
            percent(gain.tolerance, ".3g"),
            _verdict(gain),
        )
        for gain in gains
    )
    columns = (
        Column(title="Joint"),
        Column(title="Injected", unit=gain_unit(revolute)),
        Column(title="Identified", unit=gain_unit(revolute)),
        *INTERVAL,
        Column(title="Error", unit="%"),
        Column(title="Tolerance", unit="%"),
        Column(title="Verdict", words=True),
    )
    return Table(columns=columns, rows=rows)


def _verdict(gain: ResultGain) -> Cell:
    if not gain.passed:
        return Cell("FAILED", Mood.BAD)
    return Cell("passed", Mood.GOOD) if gain.identifiable else Cell("refused", Mood.GOOD)


def conclusion(gains: Sequence[ResultGain]) -> Paragraph:
    """Whether all joints passed, in a sentence."""
    if all(gain.passed for gain in gains):
        return Paragraph(f"PASSED: {_passed(gains)}.", Mood.GOOD, strong=True)
    return Paragraph(f"FAILED: {_failed([gain for gain in gains if not gain.passed])}.", Mood.BAD, strong=True)


def _passed(gains: Sequence[ResultGain]) -> str:
    found = [gain for gain in gains if gain.identifiable]
    refused = [gain.joint for gain in gains if not gain.identifiable]
    parts = list[str]()
    if found:
        worst = two_digits(100.0 * max(abs(gain.rel_error or 0.0) for gain in found))
        parts.append(f"{many(len(found), 'gain')} within tolerance (worst error {worst} %)")
    if refused:
        parts.append(f"{joints_named(refused)} refused, as the scenario expects")
    return "; ".join(parts)


def _failed(failed: Sequence[ResultGain]) -> str:
    """Which joints exceed their tolerance, by how much the worst, and which are against the scenario's expectation."""
    off = [gain for gain in failed if gain.identifiable and _excess(gain) > 1.0]
    unexpected = [gain.joint for gain in failed if gain.identifiable and _excess(gain) <= 1.0]
    refused = [gain.joint for gain in failed if not gain.identifiable]
    parts = list[str]()
    if off:
        worst = max(off, key=_excess)
        error = (
            f"{two_digits(100.0 * (worst.rel_error or 0.0), sign='+')} %, tolerance "
            f"{100.0 * (worst.tolerance or 0.0):.3g} %"
        )
        if off[1:]:
            named = joints_named([gain.joint for gain in off])
            parts.append(f"{named} exceed their tolerance (worst: joint {worst.joint}, {error})")
        else:
            parts.append(f"joint {worst.joint} exceeds its tolerance ({error})")
    if unexpected:
        parts.append(f"{joints_named(unexpected)} identified, where the scenario expects a refusal")
    if refused:
        parts.append(f"{joints_named(refused)} refused, where the scenario expects a gain")
    return "; ".join(parts)


def _excess(gain: ResultGain) -> float:
    """Error of a gain over its tolerance."""
    return abs(gain.rel_error or 0.0) / (gain.tolerance or 1.0)
