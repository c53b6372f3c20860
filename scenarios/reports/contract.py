"""What a method keeps of what any method should keep."""

from scenarios.benchmark.comparison.contract import Contract
from scenarios.reports.content import VERDICT, Cell, Column, Mood, Paragraph, Report, Table, cells
from scenarios.reports.gains import sentence

COLUMNS = (Column(title="Property", words=True), VERDICT)


def contract_report(found: Contract) -> Report:
    """The verdict, a row a promise, a sentence on each that is broken."""
    rows = tuple(
        cells(check.promise, Cell("holds", Mood.GOOD) if check.kept else Cell("FAILS", Mood.BAD))
        for check in found.checks
    )
    broken = [check for check in found.checks if not check.kept]
    said = [Paragraph(sentence(f"Not fulfilled: {check.promise}: {check.broken}")) for check in broken]
    verdict = (
        Paragraph(f"FAILED: {len(broken)} of {len(found.checks)} properties do not hold.", Mood.BAD, strong=True)
        if broken
        else Paragraph(f"PASSED: all {len(found.checks)} properties hold.", Mood.GOOD, strong=True)
    )
    parts = (verdict, Table(columns=COLUMNS, rows=rows), *said)
    return Report(f"Method {found.method}", parts, found.model_dump(mode="json"))
