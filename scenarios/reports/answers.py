"""What methods answered to problems whose truth is not known: their gains side by side."""

from collections.abc import Sequence
from pathlib import Path

from scenarios.benchmark.methods.answers import AnswerRow, Answers
from scenarios.reports.content import (
    NONE,
    VERDICT,
    Cell,
    Column,
    Mood,
    Paragraph,
    Report,
    Table,
    cells,
    number,
    percent,
)

COLUMNS = (
    Column(title="Problem", words=True),
    Column(title="Method", words=True),
    Column(title="Joint"),
    Column(title="Gain", unit="N (m)/unit"),
    Column(title="2 sigma", unit="%"),
    VERDICT,
)


def answers_report(rows: Sequence[AnswerRow], path: Path) -> Report:
    """A row a problem, method and joint; of a call without an answer, one with its failure."""
    lines = [line for row in rows for line in _lines(row)]
    parts = (_counted(rows), Table(columns=COLUMNS, rows=tuple(lines)), Paragraph(f"Answers in {path}."))
    return Report(f"{len(rows)} answers", parts, Answers(answers=list(rows)).model_dump(mode="json"))


def _counted(rows: Sequence[AnswerRow]) -> Paragraph:
    """What there is, first of all calls without an answer."""
    claims = [claim for row in rows for claim in row.claims]
    given, failed = sum(claim.value is not None for claim in claims), sum(row.failure is not None for row in rows)
    methods, problems = (len({getattr(row, key) for row in rows}) for key in ("method", "problem"))
    said = (
        f"{len(rows)} answers of {methods} {'method' if methods == 1 else 'methods'} to {problems} "
        f"{'problem' if problems == 1 else 'problems'}: {given} gains, {len(claims) - given} refused, "
        f"{failed} {'call' if failed == 1 else 'calls'} without any answer."
    )
    return Paragraph(said, Mood.BAD if failed else Mood.PLAIN, strong=True)


def _lines(row: AnswerRow) -> list[tuple[Cell, ...]]:
    if row.failure is not None:
        return [cells(row.problem, row.method, NONE, NONE, NONE, Cell(row.failure, Mood.BAD))]
    return [
        cells(
            row.problem,
            row.method,
            str(joint),
            number(claim.value, ".4f"),
            percent(None if claim.std is None or not claim.value else 2.0 * claim.std / abs(claim.value), ".2f"),
            Cell("refused", Mood.DOUBTFUL) if claim.value is None else Cell("identified", Mood.GOOD),
        )
        for joint, claim in enumerate(row.claims, 1)
    ]
