"""Report of answers to problems with unknown true gains: the gains of all methods."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from scenarios.benchmark.methods.answers import AnswerRow, Answers
from scenarios.rendering.content import NONE, Cell, Mood, Paragraph, Report, Table, column, plus_minus, table

MEANING = "Gains with two standard deviations, if the method estimates these."


def answers_report(rows: Sequence[AnswerRow], path: Path) -> Report:
    """Return the report: one table per problem, one row per joint, one column per method."""
    problems = dict.fromkeys(row.problem for row in rows)
    tables = (side_by_side(problem, [row for row in rows if row.problem == problem]) for problem in problems)
    parts = (_counted(rows), *tables, Paragraph(MEANING), Paragraph(f"Answers in {path}."))
    return Report(f"{len(rows)} answers", parts, Answers(answers=list(rows)).model_dump(mode="json"))


def _counted(rows: Sequence[AnswerRow]) -> Paragraph:
    """Return the summary, first the calls without an answer."""
    claims = [claim for row in rows for claim in row.claims]
    given, failed = sum(claim.value is not None for claim in claims), sum(row.failure is not None for row in rows)
    methods, problems = (len({getattr(row, key) for row in rows}) for key in ("method", "problem"))
    said = (
        f"{len(rows)} answers of {methods} {'method' if methods == 1 else 'methods'} to {problems} "
        f"{'problem' if problems == 1 else 'problems'}: {given} gains, {len(claims) - given} refused, "
        f"{failed} {'call' if failed == 1 else 'calls'} without any answer."
    )
    return Paragraph(said, Mood.BAD if failed else Mood.PLAIN, strong=True)


def side_by_side(problem: str, rows: Sequence[AnswerRow]) -> Table:
    """Return the gains of a problem: a row per joint, a column per method; rows of a failed call have its failure."""
    joints = max((len(row.claims) for row in rows), default=0)
    methods = (column(f"{row.method} [N (m)/unit]", partial(_answer, row), words=True) for row in rows)
    return table(range(max(joints, 1)), column("Joint", lambda j: j + 1), *methods, title=problem)


def _answer(row: AnswerRow, joint: int) -> Cell:
    if row.failure is not None:
        return Cell(row.failure, Mood.BAD)
    claim = row.claims[joint] if joint < len(row.claims) else None
    if claim is None:
        return Cell(NONE)
    if claim.value is None:
        return Cell("refused", Mood.DOUBTFUL)
    return Cell(f"{claim.value:.5g}" if claim.std is None else plus_minus(claim.value, 2.0 * claim.std))
