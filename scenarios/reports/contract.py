"""What a method keeps of what any method should keep."""

from collections.abc import Sequence
from dataclasses import asdict

from scenarios.benchmark.comparison.contract import Check
from scenarios.reports.content import Cell, Column, Mood, Paragraph, Report, Table, cells
from scenarios.reports.gains import sentence

COLUMNS = (Column(title="Any method keeps", words=True), Column(title="Verdict", words=True))


def contract_report(method: str, found: Sequence[Check]) -> Report:
    """A row a promise, a sentence on each that is broken, the verdict."""
    rows = tuple(
        cells(check.promise, Cell("broken", Mood.BAD) if check.broken else Cell("kept", Mood.GOOD)) for check in found
    )
    broken = [check for check in found if check.broken is not None]
    said = [Paragraph(sentence(f"Not fulfilled: {check.promise}: {check.broken}")) for check in broken]
    verdict = (
        Paragraph(f"BROKEN: {len(broken)} of {len(found)} promises.", Mood.BAD, strong=True)
        if broken
        else Paragraph(f"KEPT: {len(found)} promises.", Mood.GOOD, strong=True)
    )
    document: dict[str, object] = {
        "method": method,
        "passed": not broken,
        "checks": [{**asdict(check), "kept": check.broken is None} for check in found],
    }
    return Report(f"Method {method}", (Table(columns=COLUMNS, rows=rows), *said, verdict), document)
