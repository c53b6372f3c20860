"""What `rx90 run` says: injected against identified gains, the reasons, the verdict."""

from collections.abc import Sequence

from ident.support.arrays import Array
from scenarios.experiments.run import Run
from scenarios.reports.content import Cell, Column, Mood, Paragraph, Part, Report, Table, cells, number, percent
from scenarios.reports.diagnoses import horizon_paragraphs
from scenarios.reports.gains import INTERVAL, gain_unit, interval, note_paragraphs, payload_tables, reason_paragraph
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
        return Cell("MISSED", Mood.BAD)
    return Cell("passed", Mood.GOOD) if gain.identifiable else Cell("refused", Mood.GOOD)


def conclusion(gains: Sequence[ResultGain]) -> Paragraph:
    """Whether all joints passed, in a sentence."""
    missed = [str(gain.joint) for gain in gains if not gain.passed]
    if missed:
        return Paragraph(f"MISSED on joint {', '.join(missed)}.", Mood.BAD, strong=True)
    found = sum(gain.identifiable for gain in gains)
    refused = [str(gain.joint) for gain in gains if not gain.identifiable]
    rest = f"; joint {', '.join(refused)} rightly refused" if refused else ""
    return Paragraph(f"PASSED: {found} gains within tolerance{rest}.", Mood.GOOD, strong=True)
