"""The page of answers to problems with unknown true gains: gains of all methods, and reasons for missing ones."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from statistics import median

from ident.support.naming import one_line
from scenarios.benchmark.methods.answers import ANSWERS, AnswerRow, read_answers
from scenarios.rendering.content import Heading, Paragraph, Part, Report, Table, column, pairs_table, table
from scenarios.rendering.plot import TONES, Axis, Plot, about, intervals
from scenarios.reports.answers import MEANING, answers_report, side_by_side
from scenarios.support.errors import ScenarioError

UNKNOWN = (
    "The true gains of these problems are unknown, so methods are compared with each other only; methods "
    "that agree may share an error. Answers to sealed problems are scored by `rx90 compare --open`."
)


def page(folder: Path) -> Report:
    """Return the page of a folder.

    Raises:
        ScenarioError: If its file is damaged, of another version, or holds no answer.
    """
    path = folder / ANSWERS
    rows = read_answers(path)
    if not rows:
        raise ScenarioError(f"{one_line(path)}: contains no answer; create answers with rx90 compare FOLDER --out")
    told = answers_report(rows, path)
    parts: list[Part] = [told.parts[0], Paragraph(UNKNOWN), Paragraph(MEANING)]
    for problem in dict.fromkeys(row.problem for row in rows):
        own = [row for row in rows if row.problem == problem]
        parts += [Heading(problem), *_drawn(own), replace(side_by_side(problem, own), title=""), *_reasons(own)]
    parts += _origin(rows)
    return Report(told.title, tuple(parts), told.document)


def _drawn(rows: Sequence[AnswerRow]) -> list[Plot]:
    """Return the plot of a problem's gains by method, if there are any."""
    best = [row for row in rows if any(claim.value is not None for claim in row.claims)]
    if not best:
        return []
    shown = best[: len(TONES)]
    left = len(best) - len(shown)
    names = tuple(str(joint) for joint in range(1, max(len(row.claims) for row in shown) + 1))
    middles = [_middle([row.claims[j].value for row in best if j < len(row.claims)]) for j in range(len(names))]
    series = [
        intervals(
            row.method,
            [name for name, claim in zip(names, row.claims, strict=False) if claim.value is not None],
            [
                about(100.0 * (claim.value / middle - 1.0), 200.0 * (claim.std or 0.0) / abs(middle))
                for middle, claim in zip(middles, row.claims, strict=False)
                if claim.value is not None
            ],
            tone,
        )
        for row, tone in zip(shown, TONES, strict=False)
    ]
    more = f" {left} more in the table only." if left else ""
    plot = Plot(
        title="Gains relative to the median of all methods",
        caption=f"Bars: two standard deviations; without a bar, the method estimates none.{more}",
        x=Axis(title="joint", categories=names),
        y=Axis(title="difference from the median", unit="%", zero=True),
        series=tuple(series),
    )
    return [plot]


def _middle(gains: Sequence[float | None]) -> float:
    """Return the median of the existing gains."""
    found = [gain for gain in gains if gain is not None]
    return median(found) if found else 1.0


def _reasons(rows: Sequence[AnswerRow]) -> list[Table]:
    """Return the reasons for missing answers or gains, in the words of the method."""
    found = [(row.method, "all", row.reason) for row in rows if row.failure is not None and row.reason]
    found += [
        (row.method, str(joint), claim.reason)
        for row in rows
        for joint, claim in enumerate(row.claims, 1)
        if claim.value is None and claim.reason
    ]
    reasons = table(
        found,
        column("Method", lambda row: row[0], words=True),
        column("Joint", lambda row: row[1]),
        column("Reason", lambda row: row[2], words=True),
        title="Joints without a gain, and the reason",
    )
    return [reasons] if found else []


def _origin(rows: Sequence[AnswerRow]) -> list[Part]:
    """Return the digests of problems and of the methods' files."""
    files = {f"{row.method}: {name}": digest for row in rows for name, digest in row.files.items()}
    problems = {row.problem: row.digest for row in rows}
    parts: list[Part] = [Heading("Problems"), pairs_table("Problem", "SHA-256 of its files", problems)]
    return [*parts, *([pairs_table("Method and its file", "Digest or version", files)] if files else [])]
